"""A moment of a game as ROS messages: nested dicts, from which JSON and CDR are made.

The board is a map of 1 x 1 m in the frame `map`, x to the right and y up. Altitudes of drones are only for display.
Time is the game's: 0 at its first tick.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import TEAM_NAMES, TICKS_PER_SECOND
from swarm_pz.kernels.observation import CAPTURES_FROM
from swarm_pz.play.frames import Frame

Message = dict[str, Any]

FRAME_ID = "map"
LOG = "/rosout"
_SPHERE = 2
"""`visualization_msgs/Marker`'s number for a sphere."""
_INFO, _WARN = 20, 30
"""`rcl_interfaces/Log`'s levels for information, and for faults."""
_SIZE = 0.02
"""Diameter of a drone's sphere, in m."""
COLOURS = ((0.85, 0.20, 0.16), (0.13, 0.40, 0.85))
"""Red, green and blue of the teams, each from 0 to 1."""
TOPICS: dict[str, str] = {
    "/clock": "rosgraph_msgs/Clock",
    "/tf": "tf2_msgs/TFMessage",
    "/agent/visual": "visualization_msgs/MarkerArray",
    "/agent_team_status": "std_msgs/String",
    "/swarm/sizes": "std_msgs/Int32MultiArray",
    **{f"/swarm/{team}/poses": "geometry_msgs/PoseArray" for team in TEAM_NAMES},
    **{f"/swarm/{team}/capture_field": "nav_msgs/OccupancyGrid" for team in TEAM_NAMES},
    **{f"/{team}_team_target_dist": "nav_msgs/OccupancyGrid" for team in TEAM_NAMES},
    **{f"/{team}_ck_plot": "std_msgs/Float32MultiArray" for team in TEAM_NAMES},
    LOG: "rcl_interfaces/Log",
}
"""Topics that a server publishes, with their types."""


def makers_of(frame: Frame) -> dict[str, Callable[[], Message]]:
    """Return functions that make a frame's messages, by topic; capture fields only if the frame has them."""
    makers: dict[str, Callable[[], Message]] = {
        "/clock": partial(clock, frame.tick),
        "/tf": partial(transforms, frame),
        "/agent/visual": partial(markers, frame),
        "/swarm/sizes": partial(sizes, frame),
    }
    for team, name in enumerate(TEAM_NAMES):
        makers[f"/swarm/{name}/poses"] = partial(poses, frame, team)
        if frame.fields is not None:
            makers[f"/swarm/{name}/capture_field"] = partial(capture_field, frame.fields[team], frame.tick)
            makers[f"/{name}_ck_plot"] = partial(ck_plot, frame.fields[team])
    return makers


def nanoseconds_of(tick: int) -> int:
    """Return the time of a tick."""
    return tick * 1_000_000_000 // TICKS_PER_SECOND


def _stamp(tick: int) -> Message:
    seconds, nanoseconds = divmod(nanoseconds_of(tick), 1_000_000_000)
    return {"sec": seconds, "nanosec": nanoseconds}


def _header(tick: int) -> Message:
    return {"stamp": _stamp(tick), "frame_id": FRAME_ID}


def clock(tick: int) -> Message:
    """Return the game's time: rosgraph_msgs/Clock."""
    return {"clock": _stamp(tick)}


def team_status(drone: int, team: int) -> Message:
    """Return the team that a drone belongs to now: std_msgs/String."""
    return {"data": f"agent{drone} {TEAM_NAMES[team]}"}


def log(text: str, seconds: float, is_fault: bool) -> Message:
    """Return a line of `/rosout`, at a wall-clock time: rcl_interfaces/Log."""
    return {
        "stamp": {"sec": int(seconds), "nanosec": int(seconds % 1.0 * 1e9)},
        "level": _WARN if is_fault else _INFO,
        "name": "swarm_pz",
        "msg": text,
        "file": "",
        "function": "",
        "line": 0,
    }


def poses(frame: Frame, team: int) -> Message:
    """Return poses of a team's drones, by number, facing their direction of flight: geometry_msgs/PoseArray."""
    own = np.flatnonzero(frame.teams == team)
    return {"header": _header(frame.tick), "poses": [_pose(frame, drone) for drone in own.tolist()]}


def _pose(frame: Frame, drone: int) -> Message:
    (x, y), (speed_x, speed_y) = frame.positions[drone].tolist(), frame.velocities[drone].tolist()
    half = math.atan2(speed_y, speed_x) / 2.0
    height = 0.0 if frame.altitudes is None else float(frame.altitudes[drone])
    return {
        "position": {"x": x, "y": y, "z": height},
        "orientation": {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)},
    }


def transforms(frame: Frame) -> Message:
    """Return every drone's frame, `agent0` and so on: tf2_msgs/TFMessage."""
    stamped = []
    for drone in range(len(frame.teams)):
        pose = _pose(frame, drone)
        transform = {"translation": pose["position"], "rotation": pose["orientation"]}
        stamped.append({"header": _header(frame.tick), "child_frame_id": f"agent{drone}", "transform": transform})
    return {"transforms": stamped}


def markers(frame: Frame) -> Message:
    """Return every drone as a ball in its team's colour: visualization_msgs/MarkerArray."""
    balls = []
    for drone, team in enumerate(frame.teams.tolist()):
        colour = dict(zip("rgba", (*COLOURS[team], 1.0), strict=True))
        balls.append(
            {
                "header": _header(frame.tick),
                "ns": "agents",
                "id": drone,
                "type": _SPHERE,
                "action": 0,
                "pose": _pose(frame, drone),
                "scale": dict.fromkeys("xyz", _SIZE),
                "color": colour,
                "lifetime": {"sec": 0, "nanosec": 0},
                "frame_locked": False,
                "points": [],
                "colors": [],
                "texture_resource": "",
                "texture": {"header": _header(frame.tick), "format": "", "data": []},
                "uv_coordinates": [],
                "text": f"{TEAM_NAMES[team]} {drone}",
                "mesh_resource": "",
                "mesh_file": {"filename": "", "data": []},
                "mesh_use_embedded_materials": False,
            }
        )
    return {"markers": balls}


def sizes(frame: Frame) -> Message:
    """Return the numbers of red and blue drones: std_msgs/Int32MultiArray."""
    blue = int(frame.teams.sum(dtype=np.int64))
    return array([len(frame.teams) - blue, blue], "team")


def ck_plot(field: NDArray[np.uint8]) -> Message:
    """Return a capture field by rows from the bottom, at least 0.75 where it captures: std_msgs/Float32MultiArray."""
    return array((field / np.float32(255.0)).ravel().tolist(), "cell")


def array(data: list[Any], label: str) -> Message:
    """Return a list of numbers as a message with a one-dimensional layout."""
    dim = {"label": label, "size": len(data), "stride": len(data)}
    return {"layout": {"dim": [dim], "data_offset": 0}, "data": data}


def capture_field(field: NDArray[np.uint8], tick: int) -> Message:
    """Return where a team captures: nav_msgs/OccupancyGrid, from 0 to 100, above 75 exactly where it does."""
    values = field.astype(np.int64)
    below = values * 75 // CAPTURES_FROM
    above = 76 + (values - CAPTURES_FROM) * 24 // (255 - CAPTURES_FROM)
    return grid(np.where(values >= CAPTURES_FROM, above, below), tick)


def target(density: NDArray[Any], tick: int) -> Message:
    """Return a target (A, A) as nav_msgs/OccupancyGrid: 100 where it is densest."""
    return grid(np.rint(100.0 * density / max(float(density.max()), np.finfo(float).tiny)).astype(np.int64), tick)


def grid(values: NDArray[np.int64], tick: int) -> Message:
    """Return an image (cells, cells), row 0 at the bottom, values from 0 to 100, as nav_msgs/OccupancyGrid."""
    cells = len(values)
    corner = {"position": dict.fromkeys("xyz", 0.0), "orientation": dict.fromkeys("xyz", 0.0) | {"w": 1.0}}
    info = {"map_load_time": _stamp(0), "resolution": 1.0 / cells, "width": cells, "height": cells, "origin": corner}
    return {"header": _header(tick), "info": info, "data": values.ravel().tolist()}
