"""Leaders and followers: who leads, who follows, and commands in all their forms."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.errors import CommandError
from swarm_pz.simulator import Simulator
from swarm_pz.spaces.formats import Format
from swarm_pz.systems.leader_follower import LeaderFollower

CONFIG = GameConfig(controllers="leader_follower", capture=CaptureConfig(enabled=False))


def flown(system, places, seconds):
    """Return red's places after some seconds of one command, without captures."""
    simulator = Simulator(CONFIG.replace(controllers=system))
    simulator.reset([3])
    simulator.command(0, [places])
    simulator.advance(30 * seconds)
    return simulator.positions[0, simulator.teams[0] == 0].astype(float), simulator


@pytest.mark.parametrize("appoint", ["nearest", "lowest"])
def test_followers_gather_around_a_leader_and_a_captured_one_has_a_successor_at_once(appoint):
    goal = (0.7, 0.3)
    places, simulator = flown(LeaderFollower(leaders=1, appoint=appoint), [goal], 10)
    away = np.linalg.norm(places - goal, axis=1)
    assert away.max() < 0.25 and away.min() < 0.01
    gaps = np.linalg.norm(places[:, None] - places, axis=-1)[~np.eye(10, dtype=bool)]
    assert gaps.min() > 0.03, "they do not sit on one point"
    leader = np.flatnonzero(simulator.teams[0] == 0)[away.argmin()]
    assert appoint == "nearest" or leader == 0
    simulator.games.teams[0, leader] = 1
    simulator.advance(150)
    left = simulator.positions[0, simulator.teams[0] == 0]
    assert len(left) == 9 and np.linalg.norm(left - goal, axis=1).min() < 0.01


def test_leaders_keep_off_the_walls_and_from_each_other():
    places, _ = flown(LeaderFollower(margin=0.1), [(0.0, 0.0), (0.0, 0.0)], 8)
    nearest = np.sort(np.linalg.norm(places - 0.1, axis=1))[:2]
    assert nearest.max() < 0.05 and nearest[1] > 0.01


def test_a_place_for_each_leader_may_be_written_by_number():
    expected = np.array([(0.1, 0.2), (0.3, 0.4)])
    for command in (expected, {1: (0.3, 0.4), 0: (0.1, 0.2)}, {"0": [0.1, 0.2], "1": [0.3, 0.4]}):
        np.testing.assert_array_equal(LeaderFollower().parse(command, CONFIG), expected)


HERE = (0.5, 0.5)


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ([HERE], "2 places"),
        ([HERE] * 3, "one for each leader"),
        ([(0.5, 0.5, 0.5)] * 2, r"got shape \(2, 3\)"),
        ([HERE, (0.5, 1.5)], r"in \[0, 1\]"),
        ("ab", "must be numbers"),
        ({0: HERE, 2: HERE}, "leaders 0 to 1, got one for 2"),
        ({0: HERE, -1: HERE}, "got one for -1"),
        ({0: HERE, "first": HERE}, "got one for 'first'"),
        ({0: HERE, None: HERE}, "got one for None"),
        ({1: HERE}, "got none for 0"),
        ({}, "got none for 0, 1"),
        ({0: HERE, 1: 7}, "must be numbers"),
    ],
)
def test_what_places_no_leaders_is_refused_and_says_why(command, said):
    with pytest.raises(CommandError, match=said):
        LeaderFollower().parse(command, CONFIG)


def test_named_commands_send_all_leaders_to_a_place_or_around_it():
    made = Format(CONFIG, CONFIG.observations[0], action="discrete")
    assert len(made.command_names) == 50
    at, around = (made.command_names.index(f"{how}_30_70") for how in ("at", "around"))
    np.testing.assert_allclose(made.read_one(at, "action"), [(0.3, 0.7), (0.3, 0.7)])
    np.testing.assert_allclose(made.read_one(around, "action"), [(0.55, 0.7), (0.05, 0.7)])
    assert len(LeaderFollower(leaders=1).named(CONFIG)) == 25


def test_watchers_see_where_leaders_are_sent():
    density = LeaderFollower().to_densities(np.array([[(0.25, 0.25), (0.75, 0.95)]]), CONFIG)[0]
    assert density.sum() == pytest.approx(2.0) and density[2, 2] == density[9, 7] == 1.0
