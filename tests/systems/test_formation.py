"""Formations: slots, which drone takes which, and commands in all their forms."""

from __future__ import annotations

import math
import types

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from swarm_pz.errors import CommandError
from swarm_pz.kernels.assignment import assign
from swarm_pz.simulator import Simulator
from swarm_pz.systems.formation import Formation
from swarm_pz.systems.shapes import unit_slots
from tests.games import unchanged
from tests.systems.flights import game_of

CONFIG = game_of("formation", 20).replace(drones_per_team=10)
SQUARE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]


def parse(command, config=CONFIG):
    return Formation().parse(command, config)


def circle(radius, count):
    return [
        (radius * math.cos(2 * math.pi * i / count), radius * math.sin(2 * math.pi * i / count)) for i in range(count)
    ]


@pytest.mark.parametrize(
    ("shape", "slots"),
    [
        ("ring", circle(1, 7)),
        ("disc", [(0, 0), *circle(0.5, 3), *circle(1, 6)]),
        ("line", [(-1, 0), (-1 / 3, 0), (1 / 3, 0), (1, 0)]),
        ("wedge", [(-0.5, -math.sqrt(0.75)), (1, 0), (-0.5, math.sqrt(0.75))]),
        ("grid", [(0.5, 1), (0.5, 0), (0.5, -1), (-0.5, 0.5), (-0.5, -0.5)]),
    ],
)
def test_shapes_are_those_of_the_equations(shape, slots):
    np.testing.assert_allclose(unit_slots(shape, len(slots)), slots, atol=1e-12)


def test_a_quarter_turn_turns_against_the_clock_and_slots_keep_off_the_walls():
    command = parse({"points": SQUARE[:1] * 4, "centre": (0.5, 0.5), "size": 0.1, "turn": math.pi / 2})
    np.testing.assert_allclose(Formation().slots(command, 1), [(0.6, 0.4)])
    wide = parse({"shape": "grid", "centre": (0.0, 1.0), "size": 0.5})
    slots = Formation(margin=0.1).slots(wide, 9)
    assert slots.min() == 0.1 and slots.max() == 0.9


def test_slots_are_shared_out_as_scipy_does_also_where_costs_are_equal():
    """Catches another choice among assignments of equal cost, which would change games already played."""
    generator = np.random.default_rng(0)
    for drones in (*range(13), *range(2, 13)):
        places, slots = generator.integers(0, 5, (2, drones, 2)) / generator.choice([4.0, math.pi])
        costs = ((places[:, None] - slots[None]) ** 2).sum(axis=2)
        found = np.empty(drones, np.int64)
        for matrix in (costs, generator.random((drones, drones)), np.zeros((drones, drones))):
            assign(matrix, found)
            np.testing.assert_array_equal(found, linear_sum_assignment(matrix)[1])


def test_five_numbers_and_a_mapping_say_the_same():
    mapping = {"shape": "line", "centre": (0.2, 0.3), "size": 0.1, "turn": 0.7}
    for same in ([2, 0.2, 0.3, 0.1, 0.7], parse(mapping), types.MappingProxyType(mapping)):
        np.testing.assert_array_equal(parse(same), parse(mapping))
    drawn = parse({"points": SQUARE, "turn": 0.7 + 2 * math.pi})
    np.testing.assert_array_equal(parse(drawn), drawn)
    assert drawn[4] == pytest.approx(0.7) and drawn[5] == 4


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ([1, 2], r"got shape \(2,\)"),
        ([0, 0.5, 0.5, 0.9, 0], r"within \[0, 0.5\] at index \(3,\), got 0.9"),
        ({"shape": "rnig"}, "did you mean 'ring'"),
        ({"shape": "ring", "points": SQUARE}, "either a shape or points"),
        ({"points": SQUARE * 17}, "1 to 64 pairs"),
        ({"points": [(0, 2)] * 10}, "got values from 0 to 2"),
    ],
)
def test_what_is_no_formation_is_refused_and_says_why(command, said):
    with pytest.raises(CommandError, match=said):
        parse(command)


def test_arrays_of_policies_may_be_short_or_long():
    system = Formation()
    short = np.array([[0, 0.5, 0.5, 0.2, 0.1], [4, 0.1, 0.5, 0.2, 0.1]])
    long = system.parse_all(short, 2, CONFIG, "commands")
    assert long.shape == (2, *system.space(CONFIG).shape)
    np.testing.assert_array_equal(system.parse_all(long, 2, CONFIG, "commands"), long)
    for bad in (short[:1], long[:, :9], [[1, 2], [3]], None):
        with pytest.raises(CommandError, match="commands must be numbers of shape"):
            system.parse_all(bad, 2, CONFIG, "commands")


def test_fewer_points_than_drones_are_refused_when_sent_and_the_game_is_unchanged():
    simulator = Simulator(CONFIG, num_games=2)
    simulator.reset(range(2))
    nine, ten = {"points": (SQUARE * 3)[:9]}, {"points": (SQUARE * 3)[:10]}
    part = parse(ten)
    part[5] = 9.5  # a part of a point is no point
    for few in (nine, part):
        with unchanged(simulator), pytest.raises(CommandError, match=r"red's command: .* that is 10, got 9 points"):
            simulator.command(0, [ten, few])
    simulator.games.teams[1, 0] = 1
    simulator.command(0, [ten, nine])
    with pytest.raises(CommandError, match="that is 11, got 10"):
        simulator.command(1, [ten], rows=[1])
    simulator.games.teams[0, 10] = 0  # the team grows: a drone shares a point
    simulator.advance(30)
    assert simulator.sizes[0, 0] == 11


def test_watchers_see_the_slots():
    command = parse({"points": [(-1, -1)] * 10, "size": 0.25})
    density, ring = Formation().to_densities(np.stack([command, parse({"shape": "ring"})]), CONFIG)
    np.testing.assert_allclose(density[2, 2], 1.0)
    assert density.sum() == pytest.approx(1.0)
    assert ring.max() == 1.0 and ring[4:6, 4:6].max() == 0.0
    unequal = CONFIG.replace(drones_per_team=(1, 2))
    pair = parse({"points": [(-0.8, -0.8), (0.8, 0.8)], "size": 0.5}, unequal)
    two = Formation().to_densities(pair[None], unequal)[0]
    assert two[:5, :5].any() and two[5:, 5:].any(), "of the larger team"
