"""Messages to subscribers: each moment once, teams as they change, capture fields, altitudes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.play.frames import Frame, decode_frame
from swarm_pz.play.ros.shown import Shown
from swarm_pz.play.server.views import frame_of
from swarm_pz.simulator import Simulator


def frame(tick, teams=(0, 0, 1)):
    """Return a moment of drones in the middle."""
    places = np.full((len(teams), 2), 0.5)
    teams = np.array(teams, np.int8)
    return Frame(sequence=0, tick=tick, server_ms=0.0, positions=places, velocities=0 * places, teams=teams)


class Everybody:
    """A rosbridge of which everything is wanted."""

    def __init__(self):
        self.told = []

    def wanted(self, topic):
        return True

    def publish(self, topic, message, but=None):
        self.told.append((topic, message))

    def of(self, topic):
        return [message for name, message in self.told if name == topic]


def test_a_moment_is_shown_once_and_teams_as_they_change_and_in_a_new_game_anew():
    everybody = Everybody()
    shown = Shown(everybody)
    for moment in (frame(0), frame(0), frame(3), frame(6, teams=(0, 1, 1))):
        shown.show(moment)
    assert len(everybody.of("/clock")) == 3
    told = [message["data"] for message in everybody.of("/agent_team_status")]
    assert told == ["agent0 red", "agent1 red", "agent2 blue", "agent1 blue"]
    everybody.told.clear()
    shown.show(frame(0))
    assert [message["data"] for message in everybody.of("/agent_team_status")] == told[:3]


def test_altitudes_of_the_keyframe_hold_for_all_messages_of_its_game():
    everybody, heights = Everybody(), np.array([0.5, 1.0, 1.5])
    shown = Shown(everybody)
    shown.show(replace(frame(0), altitudes=heights))
    shown.show(frame(3))
    for message in everybody.of("/tf"):
        assert [one["transform"]["translation"]["z"] for one in message["transforms"]] == heights.tolist()
    shown.show(replace(frame(0, teams=(0, 1)), altitudes=2 * heights[:2]))
    *_, last = everybody.of("/tf")
    assert [one["transform"]["translation"]["z"] for one in last["transforms"]] == [1.0, 2.0], "of the next game"


@pytest.mark.parametrize("preset", ["paper", "released"])
def test_a_ck_plot_is_the_capture_field_by_which_the_rules_decide(preset):
    simulator, everybody = Simulator(GameConfig.preset(preset)), Everybody()
    simulator.reset([3])
    simulator.advance(150)
    Shown(everybody).show(decode_frame(frame_of(simulator, 0, 0.0, fields=True)))
    for team, name in enumerate(("red", "blue")):
        (plot,) = everybody.of(f"/{name}_ck_plot")
        values = np.array(plot["data"]).reshape(50, 50)
        np.testing.assert_array_equal(values >= 0.75, simulator.captures_here[0, team])
        field = simulator.capture_field[0, team]
        wanted = field / field.max()
        np.testing.assert_allclose(values, wanted, atol=1.01 / 255)
        assert values.max() == 1.0
