"""Leaders and followers: who leads, who follows, commands in all their forms, and beside a slow reference."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.simulator import Simulator
from swarm_pz.spaces.formats import Format
from swarm_pz.systems.leader_follower import LeaderFollower
from tests.systems.drawn_flights import flight_of

PEACE = CaptureConfig(enabled=False)
CONFIG = GameConfig(controllers="leader_follower", capture=PEACE)
SYMMETRIES = list(itertools.product((False, True), repeat=3))
STILL = {"cohesion": 0.0, "alignment": 0.0, "separation": 0.0}
"""Followers stand still: whoever accelerates from rest leads."""


def leading(system, positions, places, velocities=(0, 0), heard=None) -> list[int]:
    """Return the drones that fly to a place of their own."""
    flight = flight_of(positions, velocities, np.array(places, float))
    if heard is not None:
        flight = flight._replace(heard=np.array(heard, bool)[None])
    pushed = system.replace(**STILL).solve(flight, CONFIG)[0]
    return np.flatnonzero(np.abs(pushed).sum(axis=1) > 0).tolist()


def flown(system, places, seconds, seed=3):
    """Return red's places after some seconds of one command, without captures."""
    simulator = Simulator(CONFIG.replace(controllers=system))
    simulator.reset([seed])
    simulator.command(0, [places])
    simulator.advance(30 * seconds)
    return simulator.positions[0, simulator.teams[0] == 0].astype(float), simulator


# --- the slow reference -----------------------------------------------------------------------


# --- who leads --------------------------------------------------------------------------------

LINE = [(0.1, 0.5), (0.3, 0.5), (0.6, 0.5), (0.9, 0.5)]


def test_the_nearest_to_each_place_leads_to_it():
    assert leading(LeaderFollower(), LINE, [(0.35, 0.5), (0.8, 0.5)]) == [1, 3]
    assert leading(LeaderFollower(), LINE, [(0.36, 0.5), (0.36, 0.5)]) == [1, 2]
    assert leading(LeaderFollower(leaders=1), LINE, [(0.9, 0.9)]) == [3]


def test_who_flies_to_a_place_already_is_preferred_to_who_is_as_near():
    velocities = [(0, 0), (0, 0), (0.2, 0), (0, 0)]
    flight = flight_of(LINE, velocities, np.array([(0.7, 0.5)]))
    system = LeaderFollower(leaders=1, damping=0.0, **STILL)
    assert np.flatnonzero(np.abs(system.solve(flight, CONFIG)[0]).sum(axis=1)).tolist() == [2]
    near = [(0.1, 0.5), (0.3, 0.5), (0.6, 0.5), (0.79, 0.5)]
    for foresight, leader in ((0.0, 3), (0.5, 2)):
        flight = flight_of(near, velocities, np.array([(0.7, 0.5)]))
        found = system.replace(foresight=foresight).solve(flight, CONFIG)[0]
        assert np.flatnonzero(np.abs(found).sum(axis=1)).tolist() == [leader]


def test_the_lowest_numbers_lead_if_that_is_the_rule():
    assert leading(LeaderFollower(appoint="lowest"), LINE, [(0.9, 0.9), (0.9, 0.1)]) == [0, 1]


def test_fewer_drones_than_leaders_serve_the_first_places():
    for appoint in ("nearest", "lowest"):
        system = LeaderFollower(leaders=3, appoint=appoint)
        flight = flight_of([(0.2, 0.5), (0.8, 0.5)], (0, 0), np.array([(0.8, 0.9), (0.2, 0.9), (0.5, 0.5)]))
        pushed = system.solve(flight, CONFIG)[0]
        first = 1 if appoint == "nearest" else 0
        np.testing.assert_allclose(pushed[first], 4 * ((0.8, 0.9) - flight.positions[0, first]), rtol=1e-6)
        np.testing.assert_allclose(pushed[1 - first], 4 * ((0.2, 0.9) - flight.positions[0, 1 - first]), rtol=1e-6)


@pytest.mark.parametrize("appoint", ["nearest", "lowest"])
def test_a_captured_leader_has_a_successor_at_once(appoint):
    system = LeaderFollower(leaders=1, appoint=appoint)
    places, simulator = flown(system, [(0.7, 0.3)], 6)
    red = np.flatnonzero(simulator.teams[0] == 0)
    leader = red[np.linalg.norm(places - (0.7, 0.3), axis=1).argmin()]
    assert np.linalg.norm(simulator.positions[0, leader] - (0.7, 0.3)) < 0.01
    assert appoint == "nearest" or leader == 0
    simulator.games.teams[0, leader] = 1
    simulator.advance(180)
    left = simulator.positions[0, simulator.teams[0] == 0]
    assert len(left) == 9 and np.linalg.norm(left - (0.7, 0.3), axis=1).min() < 0.01


def test_leaders_do_not_change_while_a_command_is_held():
    simulator = Simulator(CONFIG)
    simulator.reset([1])
    system, changes, former = LeaderFollower(), 0, None
    simulator.command(0, [[(0.3, 0.8), (0.8, 0.6)]])
    for _ in range(80):
        simulator.advance(3)
        own = simulator.teams[0] == 0
        ahead = simulator.positions[0, own] + system.foresight * simulator.velocities[0, own]
        first = int(np.linalg.norm(ahead - (0.3, 0.8), axis=1).argmin())
        changes += former is not None and first != former
        former = first
    assert changes <= 1


# --- flight -----------------------------------------------------------------------------------


def test_followers_gather_around_a_leader_without_sitting_on_one_point():
    places, simulator = flown(LeaderFollower(leaders=1), [(0.3, 0.6)], 12)
    assert np.linalg.norm(places - (0.3, 0.6), axis=1).max() < 0.25
    gaps = np.linalg.norm(places[:, None] - places, axis=-1)[~np.eye(10, dtype=bool)]
    assert gaps.min() > 0.03
    assert np.abs(simulator.velocities[0, simulator.teams[0] == 0]).max() < 0.05


def test_leaders_keep_off_the_walls_and_from_each_other():
    places, _ = flown(LeaderFollower(margin=0.1), [(0.0, 0.0), (0.0, 0.0)], 10)
    nearest = np.sort(np.linalg.norm(places - 0.1, axis=1))[:2]
    assert nearest.max() < 0.05 and nearest[1] > 0.01


# --- commands ---------------------------------------------------------------------------------


def test_a_place_for_each_leader_may_be_written_by_number():
    system = LeaderFollower()
    expected = np.array([(0.1, 0.2), (0.3, 0.4)])
    for command in (expected, {1: (0.3, 0.4), 0: (0.1, 0.2)}, {"0": [0.1, 0.2], "1": [0.3, 0.4]}):
        np.testing.assert_array_equal(system.parse(command, CONFIG), expected)


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ([(0.5, 0.5)], r"2 places \(x, y\), one for each leader, got list .*leaders=\.\.\."),
        ([(0.5, 0.5)] * 3, "one for each leader"),
        ([(0.5, 0.5, 0.5)] * 2, r"of shape \(2, 2\), got shape \(2, 3\)"),
        ([(0.5, 0.5), (0.5, 1.5)], r"in \[0, 1\]"),
        ([(0.5, 0.5), (0.5, np.nan)], "got nan"),
        ("ab", "must be numbers"),
        (None, "must be numbers"),
        (0.5, "must be numbers"),
        ({0: (0.5, 0.5), 2: (0.5, 0.5)}, "leaders 0 to 1, got one for 2: that leader does not exist"),
        ({0: (0.5, 0.5), -1: (0.5, 0.5)}, "got one for -1"),
        ({0: (0.5, 0.5), "first": (0.5, 0.5)}, "got one for 'first'"),
        ({0: (0.5, 0.5), None: (0.5, 0.5)}, "got one for None"),
        ({1: (0.5, 0.5)}, "got none for 0"),
        ({}, "got none for 0, 1"),
        ({0: (0.5, 0.5), 1: 7}, "must be numbers"),
    ],
)
def test_what_places_no_leaders_is_refused_and_says_why(command, said):
    simulator = Simulator(CONFIG)
    before = simulator.snapshot()
    with pytest.raises(CommandError, match=said):
        simulator.command(0, [command])
    for array, former in zip(simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, former)


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


@pytest.mark.parametrize(
    "number",
    [{"leaders": 0}, {"leaders": 1.5}, {"appoint": "best"}, {"foresight": -1.0}, {"leadership": 1.1},
     {"separation_radius": 0.0}, {"cohesion": -1.0}, {"margin": 0.6}],
)  # fmt: skip
def test_its_numbers_are_checked(number):
    with pytest.raises(ConfigError, match=f"leader_follower.{next(iter(number))} must be"):
        LeaderFollower(**number)
