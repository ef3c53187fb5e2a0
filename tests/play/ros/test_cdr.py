"""Messages as bytes, read by another's reader."""

from __future__ import annotations

import numpy as np
import pytest
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory

from swarm_pz.play.frames import Frame
from swarm_pz.play.ros import messages
from swarm_pz.play.ros.bridge import TOPICS
from swarm_pz.play.ros.cdr import serialise
from swarm_pz.play.ros.commands import INPUTS
from swarm_pz.play.ros.definitions import definition, full_name, plain_name

_FRAME = Frame(
    sequence=1,
    tick=31,
    server_ms=0.0,
    positions=np.random.default_rng(1).random((5, 2)),
    velocities=np.random.default_rng(2).random((5, 2)),
    teams=np.array([0, 1, 1, 0, 1], np.int8),
)
_FIELD = np.arange(2500, dtype=np.uint8).reshape(50, 50)
_MESSAGES = {
    "rosgraph_msgs/Clock": messages.clock(31),
    "tf2_msgs/TFMessage": messages.transforms(_FRAME),
    "visualization_msgs/MarkerArray": messages.markers(_FRAME),
    "std_msgs/String": messages.text("Käfer"),
    "std_msgs/Int32MultiArray": messages.sizes(_FRAME),
    "geometry_msgs/PoseArray": messages.poses(_FRAME, 1),
    "nav_msgs/OccupancyGrid": messages.capture_field(_FIELD, 31),
    "std_msgs/Float32MultiArray": messages.floats(_FIELD),
    "rcl_interfaces/Log": messages.log("red: plays", 12.5, is_fault=True),
}


def leaves(decoded, path=""):
    """Yield what a message holds, with its place in it; numbers as a float32 holds them."""
    if hasattr(decoded, "__slots__"):
        decoded = {name: getattr(decoded, name) for name in decoded.__slots__}
    if isinstance(decoded, dict):
        for name, value in decoded.items():
            yield from leaves(value, f"{path}.{name}")
    elif isinstance(decoded, list | tuple | bytes):
        yield path, len(decoded)
        for place, value in enumerate(decoded):
            yield from leaves(value, f"{path}[{place}]")
    else:
        yield path, float(np.float32(decoded)) if isinstance(decoded, float) else decoded


def read(kind, data):
    """Read bytes with the definition that viewers are told."""
    schema = Schema(id=1, name=full_name(kind), encoding="ros2msg", data=definition(kind).encode())
    return DecoderFactory().decoder_for("cdr", schema)(data)


def test_each_type_that_is_published_is_tried():
    assert set(_MESSAGES) == set(TOPICS.values())


@pytest.mark.parametrize("kind", _MESSAGES)
def test_a_message_is_read_as_it_was_written(kind):
    message = _MESSAGES[kind]
    assert list(leaves(read(kind, serialise(kind, message)))) == list(leaves(message))


@pytest.mark.parametrize("kind", sorted(set(INPUTS.values())))
def test_types_that_are_heard_have_definitions(kind):
    assert definition(kind) is not None
    assert plain_name(full_name(kind)) == kind == plain_name(kind)
