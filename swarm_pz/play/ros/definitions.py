"""Message types of ROS 2 Humble, from rosbags, and of the tablet app; and messages as bytes (CDR)."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

_store = get_typestore(Stores.ROS2_HUMBLE)
_store.register(
    get_types_from_msg(
        "string name\nstring team\nfloat32[] data\nint32 map_width\nint32 map_height",
        "ergodic_humanswarmcollab_sim/msg/tablet",
    )
)


def definition(name: str) -> str:
    """Return the definition of a type and, after it, of all types that it is made of, as MCAP keeps it."""
    return _store.generate_msgdef(full_name(name), ros_version=2)[0]


def plain_name(name: str) -> str:
    """Return a type's name as `pkg/Type`, as here and in ROS 1; ROS 2 writes `pkg/msg/Type`."""
    return re.sub(r"^([^/]*)/msg/([^/]*)$", r"\1/\2", name)


def full_name(name: str) -> str:
    """Return a type's name as ROS 2 writes it, `pkg/msg/Type`."""
    return name.replace("/", "/msg/", 1)


def serialise(name: str, message: dict[str, Any]) -> bytes:
    """Return a message of a type as CDR bytes, as ROS 2 sends it."""
    kind = full_name(name)
    return bytes(_store.serialize_cdr(_typed((Nodetype.NAME, kind), message), kind, little_endian=True))


def _typed(node: Any, value: Any) -> Any:
    """Return a dict, list or plain value as the store's type: a dataclass, an array or the value."""
    kind, of = node
    if kind == Nodetype.NAME:
        fields = _store.get_msgdef(of).fields
        return _store.types[of](**{name: _typed(part, value[name]) for name, part in fields})
    if kind == Nodetype.SEQUENCE:
        element, _ = of
        is_number = element[0] == Nodetype.BASE
        return np.array(value, element[1][0]) if is_number else [_typed(element, one) for one in value]
    return value
