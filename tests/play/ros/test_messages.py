"""Messages as ROS programs understand them: rows, strides, colours, times; and when they are sent."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import numpy as np

from swarm_pz.config import GameConfig
from swarm_pz.play.frames import Frame, decode_frame
from swarm_pz.play.game import TableConfig
from swarm_pz.play.ros import commands, messages, robots
from swarm_pz.play.ros.bridge import Bridge
from swarm_pz.play.server.views import frame_of
from swarm_pz.simulator import Simulator


def moment(tick, teams=(0, 0, 1)):
    """Return a frame of drones of these teams."""
    positions, velocities = np.random.default_rng(1).random((2, len(teams), 2))
    teams = np.array(teams, np.int8)
    return Frame(sequence=0, tick=tick, server_ms=0.0, positions=positions, velocities=velocities, teams=teams)


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
    sizes = messages.sizes(moment(45, [0, 1, 1, 0, 1]))
    assert sizes["layout"]["dim"] == [{"label": "team", "size": 2, "stride": 2}] and sizes["data"] == [2, 3]
    plot = messages.ck_plot(field)
    assert plot["layout"]["dim"][0]["stride"] == 4
    assert [value >= 0.75 for value in plot["data"]] == [False, False, True, True], "row after row"
    red, blue = (marker["color"] for marker in messages.markers(moment(45, [0, 1]))["markers"])
    assert red["r"] > red["b"] and blue["b"] > blue["r"] and red["a"] == blue["a"] == 1.0
    entry, wrong = (messages.log("x", 12.5, is_fault) for is_fault in (False, True))
    assert entry["stamp"] == {"sec": 12, "nanosec": 500_000_000} and (entry["level"], wrong["level"]) == (20, 30)


class Everybody(Bridge):
    """A bridge that publishes every topic, to a list."""

    def __init__(self):
        super().__init__(None, TableConfig(), [], None, "")
        self.published = []

    def wanted(self, topic):
        return True

    def publish(self, topic, message, but=None):
        self.published.append((topic, message))

    def of(self, topic):
        return [message for name, message in self.published if name == topic]


def test_a_moment_is_shown_once_and_teams_as_they_change_and_in_a_new_game_anew():
    everybody = Everybody()
    for frame in (moment(0), moment(0), moment(3), moment(6, [0, 1, 1])):
        everybody.publish_frame(frame)
    assert len(everybody.of("/clock")) == 3
    statuses = [message["data"] for message in everybody.of("/agent_team_status")]
    assert statuses == ["agent0 red", "agent1 red", "agent2 blue", "agent1 blue"]
    everybody.published.clear()
    everybody.publish_frame(moment(0))
    assert [message["data"] for message in everybody.of("/agent_team_status")] == statuses[:3]


def test_altitudes_of_the_keyframe_hold_for_all_messages_of_its_game():
    everybody, heights = Everybody(), np.array([0.5, 1.0, 1.5])
    everybody.publish_frame(replace(moment(0), altitudes=heights))
    everybody.publish_frame(moment(3))
    for message in everybody.of("/tf"):
        assert [one["transform"]["translation"]["z"] for one in message["transforms"]] == heights.tolist()
    everybody.publish_frame(replace(moment(0, [0, 1]), altitudes=2 * heights[:2]))
    *_, last = everybody.of("/tf")
    assert [one["transform"]["translation"]["z"] for one in last["transforms"]] == [1.0, 2.0], "of the next game"


def test_a_ck_plot_is_the_capture_field_by_which_the_rules_decide():
    simulator, everybody = Simulator(GameConfig.preset("released")), Everybody()
    simulator.reset([3])
    simulator.advance(150)
    everybody.publish_frame(decode_frame(frame_of(simulator, 0, 0.0, fields=True)))
    for team, name in enumerate(("red", "blue")):
        (plot,) = everybody.of(f"/{name}_ck_plot")
        values = np.array(plot["data"]).reshape(50, 50)
        np.testing.assert_array_equal(values >= 0.75, simulator.captures_here[0, team])
        field = simulator.capture_field[0, team]
        wanted = field / field.max()
        np.testing.assert_allclose(values, wanted, atol=1.01 / 255)
        assert values.max() == 1.0


def test_the_docs_explain_all_topics():
    topics = {"read": commands.INPUTS | robots.INPUTS, "published": messages.TOPICS | robots.TOPICS}
    listed = {(direction, topic, kind) for direction, kinds in topics.items() for topic, kind in kinds.items()}
    table = (Path(__file__).parents[3] / "docs/tables/ros_topics.csv").read_text()
    explained = set()
    for row in csv.DictReader(table.splitlines()):
        first, *others = row["topic"].split(", ")
        topics = [first, first.replace("red", "blue")] if others == ["..."] else [first, *others]
        explained |= {(row["direction"], topic, row["type"]) for topic in topics}
    assert {topic for _, topic, _ in explained - listed} == {"/flocking_command"}, "which takes any type"
    assert listed <= explained
