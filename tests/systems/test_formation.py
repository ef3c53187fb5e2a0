"""Formations: slots, who takes which, commands in all their forms, and beside a slow reference."""

from __future__ import annotations

import itertools
import math
import types

import numpy as np
import pytest

from swarm_pz import parallel_env
from swarm_pz.config import CaptureConfig, ControllerConfig, GameConfig
from swarm_pz.envs import BatchEnv
from swarm_pz.errors import CommandError, ConfigError, PolicyError
from swarm_pz.simulator import Simulator
from swarm_pz.spaces.formats import Format
from swarm_pz.systems.formation import Formation
from swarm_pz.systems.shapes import SHAPES, unit_slots
from tests.systems import reference_formation
from tests.systems.drawn_flights import flight_of, permuted, random_flight, together, turn, turned_flight

CONFIG = GameConfig(controllers="formation", capture=CaptureConfig(enabled=False))
SYMMETRIES = list(itertools.product((False, True), repeat=3))
SQUARE = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]


def parse(command, config=CONFIG):
    return Formation().parse(command, config)


# --- the slow reference -----------------------------------------------------------------------


def test_it_flies_as_the_equations_say():
    assert reference_formation.compare(60, seed=0) < 1e-4


def test_the_game_flies_it_so_with_a_talk_radius_and_lost_messages(monkeypatch):
    seen, solve = [], Formation.solve
    monkeypatch.setattr(
        Formation, "solve", lambda self, flight, config: seen.append(flight) or solve(self, flight, config)
    )
    config = CONFIG.replace(controller=ControllerConfig(communication_radius=0.3, message_loss=0.2))
    simulator = Simulator(config, num_games=2)
    command = {"shape": "disc", "centre": (0.4, 0.6), "size": 0.3, "turn": 0.5}
    for team in range(2):
        simulator.command(team, [command] * 2)
    simulator.advance(1)
    assert len(seen) == 2
    for team, flight in enumerate(seen):
        assert not flight.heard[flight.own].all(axis=-1).any()
        for row in range(2):
            expected = reference_formation.accelerations(flight, row, command, Formation(), 1.0)
            expected /= np.maximum(1.0, np.linalg.norm(expected, axis=1, keepdims=True))
            own = flight.own[row]
            np.testing.assert_allclose(simulator.games.accelerations[row][own], expected[own], atol=1e-4)
            assert (simulator.games.teams[row] == team).tolist() == own.tolist()


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


@pytest.mark.parametrize(("drones", "chosen"), [(6, [0, 1, 2, 3, 4, 5]), (3, [0, 2, 4]), (8, [0, 1, 2, 3, 4, 5, 0, 1])])
def test_a_smaller_team_keeps_the_whole_drawing_and_a_larger_one_shares_its_points(drones, chosen):
    points = np.stack([np.linspace(-1, 1, 6), np.zeros(6)], axis=1)
    command = parse({"points": points, "centre": (0.5, 0.4), "size": 0.2})
    np.testing.assert_allclose(Formation().slots(command, drones), (0.5, 0.4) + 0.2 * points[chosen])


def test_a_quarter_turn_turns_against_the_clock_and_slots_keep_off_the_walls():
    command = parse({"points": SQUARE[:1] * 4, "centre": (0.5, 0.5), "size": 0.1, "turn": math.pi / 2})
    np.testing.assert_allclose(Formation().slots(command, 1), [(0.6, 0.4)])
    wide = parse({"shape": "grid", "centre": (0.0, 1.0), "size": 0.5})
    slots = Formation(margin=0.1).slots(wide, 9)
    assert slots.min() == 0.1 and slots.max() == 0.9


# --- flight -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "command", [{"shape": "ring"}, {"shape": "wedge", "turn": 2.0, "centre": (0.2, 0.7)}, {"points": SQUARE * 3}]
)
def test_drones_fly_to_the_slots_each_to_its_own_and_stand_there(command):
    simulator = Simulator(CONFIG)
    simulator.reset([3])
    simulator.command(0, [command])
    simulator.advance(240)
    places = simulator.positions[0, simulator.teams[0] == 0]
    left = Formation().slots(parse(command), 10).tolist()
    for place in places:
        nearest = min(left, key=lambda slot: math.dist(slot, place))
        assert math.dist(nearest, place) < 0.01
        left.remove(nearest)
    assert np.abs(simulator.velocities[0, simulator.teams[0] == 0]).max() < 0.01


def test_when_a_drone_is_captured_the_others_close_ranks():
    simulator = Simulator(CONFIG)
    simulator.reset([3])
    simulator.command(0, [{"shape": "ring"}])
    simulator.games.teams[0, 4] = 1
    simulator.advance(240)
    places = simulator.positions[0, simulator.teams[0] == 0]
    slots = Formation().slots(parse({"shape": "ring"}), 9)
    assert len(places) == 9
    assert np.linalg.norm(places[:, None] - slots, axis=-1).min(axis=1).max() < 0.01


def test_the_sum_of_squared_distances_is_the_least():
    generator, system = np.random.default_rng(0), Formation(stiffness=1.0, damping=0.0)
    command = parse({"shape": "grid"})
    for _ in range(10):
        flight = flight_of(generator.random((6, 2)), (0, 0), command)
        taken = flight.positions[0] + system.solve(flight, CONFIG)[0]
        slots = system.slots(command, 6)
        costs = [((flight.positions[0] - slots[list(order)]) ** 2).sum() for order in itertools.permutations(range(6))]
        assert ((flight.positions[0] - taken) ** 2).sum() == pytest.approx(min(costs))


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


def test_the_numbers_of_drones_do_not_matter():
    generator, system = np.random.default_rng(2), Formation()
    for shape in SHAPES:
        flight = random_flight(generator, parse({"shape": shape}), 10, 3)
        order = generator.permutation(13)
        expected = system.solve(flight, CONFIG)[:, order]
        np.testing.assert_allclose(system.solve(permuted(flight, order), CONFIG), expected, atol=1e-12)


def test_a_game_alone_and_among_others_is_the_same_bit_for_bit():
    generator, system = np.random.default_rng(3), Formation()
    commands = [parse({"shape": shape, "turn": generator.random()}) for shape in SHAPES * 3]
    flights = [random_flight(generator, command, own % 13, 12 - own % 13) for own, command in enumerate(commands)]
    many = system.solve(together(flights), CONFIG)
    for row, flight in enumerate(flights):
        np.testing.assert_array_equal(system.solve(flight, CONFIG)[0], many[row])


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("place", [(0.5, 0.5), (0.0, 0.3), (1.0, 1.0)])
def test_drones_at_one_point_on_a_wall_or_in_a_corner_fly_finitely(shape, place):
    command = parse({"shape": shape, "centre": place, "size": 0.0})
    for count in (1, 2, 9):
        assert np.isfinite(Formation().solve(flight_of([place] * count, (0, 0), command), CONFIG)).all()


def test_a_team_without_drones_flies():
    flight = random_flight(np.random.default_rng(0), parse({"shape": "ring"}), 0, 3)
    assert (Formation().solve(flight, CONFIG) == 0).all()


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


def test_learners_and_people_play_it_in_the_environment():
    env = parallel_env(controllers="formation", time_limit=2.0)
    env.reset(seed=0)
    for agent in env.agents:
        assert env.action_space(agent).shape == (5,)
        env.action_space(agent).seed(0)
    env.step({agent: env.action_space(agent).sample() for agent in env.agents})
    named = Format(CONFIG, CONFIG.observations[0], action="discrete")
    assert named.command_names[:2] == ("ring_20_20", "ring_20_50")
    np.testing.assert_array_equal(named.read_one(0, "action"), parse({"shape": "ring", "centre": (0.2, 0.2)}))


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
        ({"shape": ["ring"]}, "there is no shape"),
        ({"shape": np.array(["ring", "disc"])}, "there is no shape"),
        ({"shape": "ring", "center": (0.5, 0.5)}, "has no 'center'; did you mean 'centre'"),
        ({"shape": "ring", 5: 5}, "has no 5"),
        ({"shape": "ring", "points": SQUARE}, "either a shape or points"),
        ({"size": 0.1}, "either a shape or points"),
        ({"shape": "ring", "size": -0.1}, r"size must be numbers in \[0, 0.5\]"),
        ({"shape": "ring", "centre": (0.5, 1.5)}, r"centre must be numbers in \[0, 1\]"),
        ({"shape": "ring", "turn": math.inf}, "turn must be numbers"),
        ({"points": []}, "must be 1 to 64 pairs"),
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


def test_there_is_room_for_a_point_for_each_drone_of_a_large_game():
    config = GameConfig(drones_per_team=50, controllers="formation")
    points = np.random.default_rng(0).uniform(-1, 1, (100, 2))
    command = parse({"points": points, "size": 0.3}, config)
    np.testing.assert_allclose(Formation().slots(command, 100), 0.5 + 0.3 * points)


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
    ring = Formation().to_densities(np.stack([command, parse({"shape": "ring"})]), CONFIG)[1]
    assert ring.max() == 1.0 and ring[4:6, 4:6].max() == 0.0


@pytest.mark.parametrize("number", [{"stiffness": -1.0}, {"damping": "x"}, {"margin": 0.6}])
def test_its_numbers_are_checked(number):
    with pytest.raises(ConfigError, match=f"formation.{next(iter(number))} must be"):
        Formation(**number)
