"""What subscribers are shown of a game: each moment once, teams as they change, and where each has been."""

from __future__ import annotations

import numpy as np

from swarm_pz.config import GRID_CELLS, TICKS_PER_CONTROL_PERIOD, GameConfig, MemoryConfig
from swarm_pz.play.frames import Frame
from swarm_pz.play.ros.shown import Past, Shown

GAME = GameConfig(memory=MemoryConfig(controller=5.0))
LEFT_TOP, RIGHT_BOTTOM = (0.1, 0.9), (0.95, 0.15)


def frame(tick, place=LEFT_TOP, teams=(0, 0, 1)):
    """Return a moment in which red is at a place, and blue in the middle."""
    teams = np.array(teams, np.int8)
    places = np.where(teams[:, None] == 0, place, (0.5, 0.5))
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


def remembered(*places, periods=200):
    """Return the picture of where red has been, so many control periods at each place."""
    past = Past(GAME)
    for number, place in enumerate(places):
        for period in range(number * periods, (number + 1) * periods):
            past.add(frame(TICKS_PER_CONTROL_PERIOD * period, place))
    return past.picture(0)


def test_a_picture_of_the_past_has_its_rows_from_the_bottom_fades_and_is_still_a_density():
    row, column = np.unravel_index(remembered(RIGHT_BOTTOM, periods=1).argmax(), (GRID_CELLS, GRID_CELLS))
    assert abs(row - 0.15 * GRID_CELLS) < 3 and abs(column - 0.95 * GRID_CELLS) < 3
    picture = remembered(LEFT_TOP, RIGHT_BOTTOM)
    np.testing.assert_allclose(picture, remembered(RIGHT_BOTTOM), atol=0.05 * picture.max())
    assert abs(picture.mean() - 1.0) < 0.01
    half = remembered(LEFT_TOP, RIGHT_BOTTOM, periods=1)
    later, sooner = half[7, 47], half[45, 5]
    assert later > sooner > 5.0


def test_a_moment_is_shown_once_and_teams_as_they_change_and_a_new_game_begins_without_the_past():
    everybody = Everybody()
    shown = Shown(everybody, GAME)
    for moment in (frame(0), frame(0), frame(3), frame(6, teams=(0, 1, 1))):
        shown.show(moment)
    assert len(everybody.of("/clock")) == 3
    told = [message["data"] for message in everybody.of("/agent_team_status")]
    assert told == ["agent0 red", "agent1 red", "agent2 blue", "agent1 blue"]
    everybody.told.clear()
    shown.show(frame(0, RIGHT_BOTTOM))
    assert [message["data"] for message in everybody.of("/agent_team_status")] == told[:3]
    (plot,) = everybody.of("/red_ck_plot")
    np.testing.assert_allclose(plot["data"], remembered(RIGHT_BOTTOM, periods=1).ravel(), rtol=1e-5, atol=1e-5)
