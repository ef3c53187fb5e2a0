"""Formations: slots, who takes which, commands in all their forms, and beside a slow reference."""

from __future__ import annotations

import itertools
import math
import types

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.envs import BatchEnv
from swarm_pz.errors import CommandError, ConfigError, PolicyError
from swarm_pz.kernels.assignment import assign
from swarm_pz.simulator import Simulator
from swarm_pz.spaces.formats import Format
from swarm_pz.systems.formation import Formation
from swarm_pz.systems.shapes import SHAPES, unit_slots
from tests.systems.drawn_flights import random_flight, turn, turned_flight

CONFIG = GameConfig(controllers="formation", capture=CaptureConfig(enabled=False))
SYMMETRIES = list(itertools.product((False, True), repeat=3))
SQUARE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]


def parse(command, config=CONFIG):
    return Formation().parse(command, config)


# --- the slow reference -----------------------------------------------------------------------


# --- slots ------------------------------------------------------------------------------------


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("drones", [0, 1, 2, 3, 7, 10, 16, 37])
def test_a_shape_has_a_slot_for_each_drone_and_faces_along_x(shape, drones):
    slots = unit_slots(shape, drones)
    assert slots.shape == (drones, 2) and (np.abs(slots) <= 1 + 1e-12).all()
    gaps = np.linalg.norm(slots[:, None] - slots, axis=-1)[~np.eye(drones, dtype=bool)]
    assert (gaps > 0.05).all()
    mirrored = np.linalg.norm(slots[:, None] - slots * (1, -1), axis=-1)
    assert not drones or mirrored.min(axis=1).max() < 1e-12


def test_a_quarter_turn_turns_against_the_clock_and_slots_keep_off_the_walls():
    command = parse({"points": SQUARE[:1] * 4, "centre": (0.5, 0.5), "size": 0.1, "turn": math.pi / 2})
    np.testing.assert_allclose(Formation().slots(command, 1), [(0.6, 0.4)])
    wide = parse({"shape": "grid", "centre": (0.0, 1.0), "size": 0.5})
    slots = Formation(margin=0.1).slots(wide, 9)
    assert slots.min() == 0.1 and slots.max() == 0.9


# --- flight -----------------------------------------------------------------------------------


def test_slots_are_shared_out_as_scipy_does_also_where_costs_are_equal():
    """Games that were played before have gone so; a sum that is no less by another order is another game."""
    generator = np.random.default_rng(0)
    for drones, _ in itertools.product(range(13), range(20)):
        places, slots = generator.integers(0, 5, (2, drones, 2)) / generator.choice([4.0, math.pi])
        costs = ((places[:, None] - slots[None]) ** 2).sum(axis=2)
        found = np.empty(drones, np.int64)
        for given in (costs, generator.random((drones, drones)), np.zeros((drones, drones))):
            assign(given, found)
            np.testing.assert_array_equal(found, linear_sum_assignment(given)[1])


@pytest.mark.parametrize("symmetry", SYMMETRIES)
@pytest.mark.parametrize("shape", [*SHAPES, "drawn"])
def test_it_has_the_symmetries_of_the_square(shape, symmetry):
    generator, system = np.random.default_rng(1), Formation()
    centre, angle, points = generator.random(2), generator.uniform(-3, 3), generator.uniform(-1, 1, (12, 2))
    facing = turn(np.array([math.cos(angle), math.sin(angle)]), symmetry, 0.0)
    flips = sum(symmetry) % 2 == 1
    figures = ({"points": points}, {"points": points * ((1, -1) if flips else (1, 1))})
    before, after = figures if shape == "drawn" else ({"shape": shape}, {"shape": shape})
    command = parse({**before, "centre": centre, "turn": angle, "size": 0.4})
    middle = turn(centre, symmetry, 0.5)
    turned = parse({**after, "centre": middle, "turn": math.atan2(facing[1], facing[0]), "size": 0.4})
    flight = random_flight(generator, command, 9, 2)
    expected = turn(system.solve(flight, CONFIG), symmetry, 0.0)
    found = system.solve(turned_flight(flight, symmetry, turned), CONFIG)
    np.testing.assert_allclose(found, expected, atol=1e-5)


# --- commands ---------------------------------------------------------------------------------


def test_five_numbers_and_a_mapping_say_the_same():
    said = {"shape": "line", "centre": (0.2, 0.3), "size": 0.1, "turn": 0.7}
    np.testing.assert_array_equal(parse([2, 0.2, 0.3, 0.1, 0.7]), parse(said))
    np.testing.assert_array_equal(parse(parse(said)), parse(said))
    np.testing.assert_array_equal(parse(types.MappingProxyType(said)), parse(said))
    drawn = parse({"points": SQUARE, "turn": 0.7 + 2 * math.pi})
    np.testing.assert_array_equal(parse(drawn), drawn)
    assert drawn[4] == pytest.approx(0.7) and drawn[5] == 4


def test_every_shape_has_an_equal_part_of_what_learners_send():
    system = Formation()
    space = system.learner_space(CONFIG)
    assert space.shape == (5,)
    numbers = np.linspace(-1, 1, 1001)
    made = Format(CONFIG, CONFIG.observations[0], action="normalised")
    assert made.action_space.shape == (5,)
    commands = made.read(np.stack([numbers, *[0 * numbers] * 4], axis=1), 1001)
    counts = np.bincount(commands[:, 0].astype(int), minlength=len(SHAPES) + 1)
    assert counts[-1] == 0 and counts[:-1].tolist() == [200] * 4 + [201]
    assert system.slots(system.parse([5, 0.5, 0.5, 0.2, 0], CONFIG), 9).shape == (9, 2)


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ([1, 2], r"5 numbers \[shape, x, y, size, turn\], 134 with drawn points, or a mapping .* got shape \(2,\)"),
        ([[1, 2], [3]], "must be a formation"),
        ("ring", "must be a formation: .* got str 'ring'"),
        (None, "must be a formation"),
        ([0, 0.5, 0.5, 0.9, 0], r"within \[0, 0.5\] at index \(3,\), got 0.9"),
        ([0, np.nan, 0.5, 0.1, 0], "got nan at index"),
        ({"shape": "rnig"}, "there is no shape 'rnig'; did you mean 'ring'"),
        ({"shape": np.array(["ring", "disc"])}, "there is no shape"),
        ({"shape": "ring", "center": (0.5, 0.5)}, "has no 'center'; did you mean 'centre'"),
        ({"shape": "ring", 5: 5}, "has no 5"),
        ({"shape": "ring", "points": SQUARE}, "either a shape or points"),
        ({"shape": "ring", "size": -0.1}, r"size must be numbers in \[0, 0.5\]"),
        ({"shape": "ring", "centre": (0.5, 1.5)}, r"centre must be numbers in \[0, 1\]"),
        ({"shape": "ring", "turn": math.inf}, "turn must be numbers"),
        ({"points": 7}, "must be 1 to 64 pairs"),
        ({"points": SQUARE * 17}, "must be 1 to 64 pairs"),
        ({"points": [(0, 0, 0)] * 10}, r"points must be numbers in \[-1, 1\] of shape \(10, 2\)"),
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
    before = simulator.snapshot()
    with pytest.raises(CommandError, match=r"red's command: .* a point for each drone of the team, that is 10, got 9"):
        simulator.command(0, [ten, nine])
    for array, former in zip(simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, former)
    simulator.games.teams[1, 0] = 1
    simulator.command(0, [ten, nine])
    with pytest.raises(CommandError, match="that is 11, got 10"):
        simulator.command(1, [ten], rows=[1])
    simulator.games.teams[0, 10] = 0  # the team grows: a drone shares a point
    simulator.advance(30)
    assert simulator.sizes[0, 0] == 11


def test_a_part_of_a_point_is_no_point():
    simulator = Simulator(CONFIG)
    simulator.reset([0])
    command = parse({"points": (SQUARE * 3)[:10]})
    command[5] = 9.5
    with pytest.raises(CommandError, match="that is 10, got 9 points"):
        simulator.command(0, [command])


def test_environments_and_policies_cannot_send_fewer_points_than_drones():
    batch = BatchEnv(CONFIG, num_games=1)
    batch.reset([0])
    few = {"points": SQUARE}
    with pytest.raises(CommandError, match=r"blue's commands: .* that is 10, got 4"):
        batch.step(([{"shape": "ring"}], [few]))
    batch.step(([{"shape": "ring"}], [{"shape": "disc"}]))

    class Drawer:
        observation, answers = CONFIG.observations[0], "formation"

        def reset(self, seeds, rows):
            pass

        def act(self, observations, rows):
            return np.stack([parse(few) for _ in rows])

    with pytest.raises(PolicyError, match="that is 10, got 4"):
        batch.ask(Drawer(), np.array([0]), np.array([0]))


def test_watchers_see_the_slots():
    command = parse({"points": [(-1, -1)] * 10, "size": 0.25})
    density = Formation().to_densities(command[None], CONFIG)[0]
    np.testing.assert_allclose(density[2, 2], 1.0)
    assert density.sum() == pytest.approx(1.0)
    pair = [(-0.8, -0.8), (0.8, 0.8)]
    unequal = CONFIG.replace(drones_per_team=(1, 2))
    two = Formation().to_densities(parse({"points": pair, "size": 0.5}, unequal)[None], unequal)[0]
    assert two[:5, :5].any() and two[5:, 5:].any(), "of the larger team"
    ring = Formation().to_densities(np.stack([command, parse({"shape": "ring"})]), CONFIG)[1]
    assert ring.max() == 1.0 and ring[4:6, 4:6].max() == 0.0


@pytest.mark.parametrize("number", [{"stiffness": -1.0}, {"damping": "x"}, {"margin": 0.6}])
def test_its_numbers_are_checked(number):
    with pytest.raises(ConfigError, match=f"formation.{next(iter(number))} must be"):
        Formation(**number)
