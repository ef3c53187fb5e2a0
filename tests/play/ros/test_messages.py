"""Messages as ROS programs understand them: rows, strides, colours, times."""

from __future__ import annotations

import numpy as np

from swarm_pz.play.frames import Frame
from swarm_pz.play.ros import messages

IMAGE = np.arange(6.0).reshape(2, 3)


def frame(teams):
    """Return a moment of drones of these teams."""
    places = np.zeros((len(teams), 2))
    return Frame(
        sequence=0, tick=45, server_ms=0.0, positions=places, velocities=places, teams=np.array(teams, np.int8)
    )


def test_a_map_is_of_one_metre_with_its_rows_from_the_bottom():
    grid = messages.grid(np.arange(4).reshape(2, 2), 45)
    info = grid["info"]
    assert info["resolution"] * info["width"] == info["resolution"] * info["height"] == 1.0
    assert info["origin"]["position"] == {"x": 0.0, "y": 0.0, "z": 0.0} and info["origin"]["orientation"]["w"] == 1.0
    assert grid["data"] == [0, 1, 2, 3], "which ROS takes for the lowest row first"
    assert grid["header"] == {"stamp": {"sec": 1, "nanosec": 500_000_000}, "frame_id": "map"}


def test_a_field_captures_from_its_threshold_on():
    field = np.array([[0, 191], [192, 255]], np.uint8)
    assert messages.capture_field(field, 0)["data"] == [0, 74, 76, 100]


def test_strides_are_the_numbers_from_a_dimension_on():
    (dim,) = messages.sizes(frame([0, 1, 1]))["layout"]["dim"]
    assert (dim["label"], dim["size"], dim["stride"]) == ("team", 2, 2)
    told = messages.floats(IMAGE)
    assert (told["layout"]["dim"][0]["size"], told["layout"]["dim"][0]["stride"]) == (6, 6)
    assert told["data"] == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0], "row after row"


def test_drones_have_the_colours_of_their_teams():
    red, blue = (marker["color"] for marker in messages.markers(frame([0, 1]))["markers"])
    assert red["r"] > red["b"] and blue["b"] > blue["r"] and red["a"] == blue["a"] == 1.0


def test_a_line_of_the_log_is_of_its_second_and_a_warning_if_something_is_wrong():
    told, wrong = (messages.log("x", 12.5, is_fault) for is_fault in (False, True))
    assert told["stamp"] == {"sec": 12, "nanosec": 500_000_000}
    assert (told["level"], wrong["level"]) == (20, 30)
