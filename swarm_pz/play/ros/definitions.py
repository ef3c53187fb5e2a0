"""The message types that a table publishes or hears, as ROS 2 (release Humble) defines them, and their bytes in CDR.

The bytes are written here, since mcap-ros2-support writes CDR into MCAP files alone; its encoder is private.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np

_SEPARATOR = "\n" + 80 * "=" + "\n"
_HEADER = b"\x00\x01\x00\x00"
"""Plain CDR, little-endian; what follows is aligned as if it came first."""
_NUMBERS = {
    "bool": "u1", "int8": "i1", "uint8": "u1", "int32": "<i4", "uint32": "<u4", "float32": "<f4", "float64": "<f8",
}  # fmt: skip
_FIELD = re.compile(r"^([A-Za-z0-9_/]+)(\[\])? ([a-z0-9_]+)", re.MULTILINE)

DEFINITIONS: dict[str, str] = {
    "builtin_interfaces/Time": "int32 sec\nuint32 nanosec",
    "builtin_interfaces/Duration": "int32 sec\nuint32 nanosec",
    "std_msgs/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    "std_msgs/Empty": "",
    "std_msgs/String": "string data",
    "std_msgs/ColorRGBA": "float32 r\nfloat32 g\nfloat32 b\nfloat32 a",
    "std_msgs/MultiArrayDimension": "string label\nuint32 size\nuint32 stride",
    "std_msgs/MultiArrayLayout": "std_msgs/MultiArrayDimension[] dim\nuint32 data_offset",
    "std_msgs/Float32MultiArray": "std_msgs/MultiArrayLayout layout\nfloat32[] data",
    "std_msgs/Int32MultiArray": "std_msgs/MultiArrayLayout layout\nint32[] data",
    "geometry_msgs/Point": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Vector3": "float64 x\nfloat64 y\nfloat64 z",
    "geometry_msgs/Quaternion": "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1",
    "geometry_msgs/Pose": "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation",
    "geometry_msgs/PoseArray": "std_msgs/Header header\ngeometry_msgs/Pose[] poses",
    "geometry_msgs/Transform": "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation",
    "geometry_msgs/TransformStamped": (
        "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform"
    ),
    "tf2_msgs/TFMessage": "geometry_msgs/TransformStamped[] transforms",
    "rosgraph_msgs/Clock": "builtin_interfaces/Time clock",
    "nav_msgs/MapMetaData": (
        "builtin_interfaces/Time map_load_time\nfloat32 resolution\nuint32 width\nuint32 height\n"
        "geometry_msgs/Pose origin"
    ),
    "nav_msgs/OccupancyGrid": "std_msgs/Header header\nnav_msgs/MapMetaData info\nint8[] data",
    "sensor_msgs/CompressedImage": "std_msgs/Header header\nstring format\nuint8[] data",
    "visualization_msgs/UVCoordinate": "float32 u\nfloat32 v",
    "visualization_msgs/MeshFile": "string filename\nuint8[] data",
    "visualization_msgs/Marker": (
        "std_msgs/Header header\nstring ns\nint32 id\nint32 type\nint32 action\ngeometry_msgs/Pose pose\n"
        "geometry_msgs/Vector3 scale\nstd_msgs/ColorRGBA color\nbuiltin_interfaces/Duration lifetime\n"
        "bool frame_locked\ngeometry_msgs/Point[] points\nstd_msgs/ColorRGBA[] colors\nstring texture_resource\n"
        "sensor_msgs/CompressedImage texture\nvisualization_msgs/UVCoordinate[] uv_coordinates\nstring text\n"
        "string mesh_resource\nvisualization_msgs/MeshFile mesh_file\nbool mesh_use_embedded_materials"
    ),
    "visualization_msgs/MarkerArray": "visualization_msgs/Marker[] markers",
    "rcl_interfaces/Log": (
        "builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\nstring file\nstring function\nuint32 line"
    ),
    "ergodic_humanswarmcollab_sim/tablet": (
        "string name\nstring team\nfloat32[] data\nint32 map_width\nint32 map_height"
    ),
}
"""Fields of each type, by its name without `msg`."""


def definition(name: str) -> str:
    """Return the definition of a type and, after it, of all types that it is made of, as MCAP keeps it."""
    found = [name]
    for one in found:
        found += [
            kind for kind in dict.fromkeys(kind for kind, *_ in _fields(one)) if kind in DEFINITIONS.keys() - found
        ]
    return _SEPARATOR.join([DEFINITIONS[name], *(f"MSG: {part}\n{DEFINITIONS[part]}" for part in found[1:])])


def plain_name(name: str) -> str:
    """Return a type's name as it stands in `DEFINITIONS`: ROS 2 writes `pkg/msg/Type`, ROS 1 `pkg/Type`."""
    return re.sub(r"^([^/]*)/msg/([^/]*)$", r"\1/\2", name)


def full_name(name: str) -> str:
    """Return a type's name as ROS 2 writes it, `pkg/msg/Type`."""
    return name.replace("/", "/msg/", 1) if name.count("/") == 1 else name


def serialise(kind: str, message: dict[str, Any]) -> bytes:
    """Return a message of a type of `DEFINITIONS` as ROS 2 sends it."""
    out = bytearray()
    _write(out, kind, message)
    return _HEADER + bytes(out)


@cache
def _fields(kind: str) -> tuple[tuple[str, bool, str], ...]:
    """Return each field's type, whether it is a list, and its name."""
    return tuple((part, bool(is_list), name) for part, is_list, name in _FIELD.findall(DEFINITIONS[kind]))


def _write(out: bytearray, kind: str, value: Any) -> None:
    if kind in _NUMBERS:
        _write_numbers(out, _NUMBERS[kind], [value])
    elif kind == "string":
        data = value.encode() + b"\0"
        _write_numbers(out, "<u4", [len(data)])
        out += data
    else:
        for part, is_list, name in _fields(kind):
            if not is_list:
                _write(out, part, value[name])
                continue
            _write_numbers(out, "<u4", [len(value[name])])
            if part in _NUMBERS and value[name]:
                _write_numbers(out, _NUMBERS[part], value[name])
            elif part not in _NUMBERS:
                for one in value[name]:
                    _write(out, part, one)


def _write_numbers(out: bytearray, code: str, values: list[Any]) -> None:
    out += bytes(-len(out) % int(code[-1]))
    out += np.asarray(values, code).tobytes()
