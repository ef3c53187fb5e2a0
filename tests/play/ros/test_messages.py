"""Messages as ROS programs understand them: rows, strides, colours, times; and as bytes, read by another's reader."""

from __future__ import annotations

import numpy as np
import pytest
from mcap.records import Schema
from mcap_ros2.decoder import DecoderFactory

from swarm_pz.play.frames import Frame
from swarm_pz.play.ros import messages
from swarm_pz.play.ros.definitions import definition, full_name, serialise


def frame(teams):
    """Return a moment of drones of these teams."""
    positions, velocities = np.random.default_rng(1).random((2, len(teams), 2))
    teams = np.array(teams, np.int8)
    return Frame(sequence=0, tick=45, server_ms=0.0, positions=positions, velocities=velocities, teams=teams)


FRAME = frame([0, 1, 1, 0, 1])
FIELD = np.arange(2500, dtype=np.uint8).reshape(50, 50)
MESSAGES = {
    "rosgraph_msgs/Clock": messages.clock(31),
    "tf2_msgs/TFMessage": messages.transforms(FRAME),
    "visualization_msgs/MarkerArray": messages.markers(FRAME),
    "std_msgs/String": {"data": "Käfer"},
    "std_msgs/Int32MultiArray": messages.sizes(FRAME),
    "geometry_msgs/PoseArray": messages.poses(FRAME, 1),
    "nav_msgs/OccupancyGrid": messages.capture_field(FIELD, 31),
    "std_msgs/Float32MultiArray": messages.ck_plot(FIELD),
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


@pytest.mark.parametrize("kind", MESSAGES)
def test_a_message_is_read_as_it_was_written_with_the_definition_that_viewers_are_told(kind):
    assert MESSAGES.keys() == set(messages.TOPICS.values())
    schema = Schema(id=1, name=full_name(kind), encoding="ros2msg", data=definition(kind).encode())
    read = DecoderFactory().decoder_for("cdr", schema)(serialise(kind, MESSAGES[kind]))
    assert list(leaves(read)) == list(leaves(MESSAGES[kind]))


def test_a_map_is_of_one_metre_with_its_rows_from_the_bottom():
    grid = messages.grid(np.arange(4).reshape(2, 2), 45)
    info = grid["info"]
    assert info["resolution"] * info["width"] == info["resolution"] * info["height"] == 1.0
    assert info["origin"]["position"] == {"x": 0.0, "y": 0.0, "z": 0.0} and info["origin"]["orientation"]["w"] == 1.0
    assert grid["data"] == [0, 1, 2, 3], "which ROS takes for the lowest row first"
    assert grid["header"] == {"stamp": {"sec": 1, "nanosec": 500_000_000}, "frame_id": "map"}


def test_numbers_mean_what_ros_takes_them_for():
    field = np.array([[0, 191], [192, 255]], np.uint8)
    assert messages.capture_field(field, 0)["data"] == [0, 74, 76, 100], "above 75 exactly where it captures"
    (dim,) = messages.sizes(FRAME)["layout"]["dim"]
    assert dim == {"label": "team", "size": 2, "stride": 2} and messages.sizes(FRAME)["data"] == [2, 3]
    told = messages.ck_plot(field)
    assert told["layout"]["dim"][0]["stride"] == 4
    assert [value >= 0.75 for value in told["data"]] == [False, False, True, True], "row after row"
    red, blue = (marker["color"] for marker in messages.markers(frame([0, 1]))["markers"])
    assert red["r"] > red["b"] and blue["b"] > blue["r"] and red["a"] == blue["a"] == 1.0
    told, wrong = (messages.log("x", 12.5, is_fault) for is_fault in (False, True))
    assert told["stamp"] == {"sec": 12, "nanosec": 500_000_000} and (told["level"], wrong["level"]) == (20, 30)
