"""Messages as the bytes that ROS 2 sends them in: CDR, little-endian, of the types in `definitions`."""

from __future__ import annotations

import re
import struct
from functools import cache
from typing import Any

import numpy as np

from swarm_pz.play.ros.definitions import DEFINITIONS

_HEADER = b"\x00\x01\x00\x00"
"""Plain CDR, little-endian; what follows is aligned as if it came first."""
_NUMBERS = {
    "bool": "u1",
    "byte": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int32": "<i4",
    "uint32": "<u4",
    "float32": "<f4",
    "float64": "<f8",
}
_FIELD = re.compile(r"^([A-Za-z0-9_/]+)(\[\])? ([a-z0-9_]+)(?: .*)?$")


def serialise(kind: str, message: dict[str, Any]) -> bytes:
    """Write a message of a type of `DEFINITIONS`, named without `msg`."""
    out = bytearray()
    _write(out, kind, message)
    return _HEADER + bytes(out)


@cache
def _fields(kind: str) -> tuple[tuple[str, bool, str], ...]:
    """Return each field's type, whether it is a list, and its name."""
    found = []
    for line in DEFINITIONS[kind].splitlines():
        field = _FIELD.match(line)
        if field is None:
            raise ValueError(f"{kind} has a field that is none: {line!r}")
        found.append((field[1], field[2] is not None, field[3]))
    return tuple(found)


def _write(out: bytearray, kind: str, value: Any) -> None:
    if kind in _NUMBERS:
        _numbers(out, kind, [value])
    elif kind == "string":
        data = value.encode() + b"\0"
        _length(out, len(data))
        out += data
    else:
        for part, is_list, name in _fields(kind):
            if is_list:
                _list(out, part, value[name])
            else:
                _write(out, part, value[name])


def _list(out: bytearray, kind: str, values: list[Any]) -> None:
    _length(out, len(values))
    if kind in _NUMBERS and values:
        _numbers(out, kind, values)
    elif kind not in _NUMBERS:
        for value in values:
            _write(out, kind, value)


def _numbers(out: bytearray, kind: str, values: list[Any]) -> None:
    code = _NUMBERS[kind]
    size = int(code[-1])
    out += bytes(-len(out) % size)
    out += np.asarray(values, code).tobytes()


def _length(out: bytearray, length: int) -> None:
    out += bytes(-len(out) % 4)
    out += struct.pack("<I", length)
