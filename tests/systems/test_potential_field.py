"""Potential fields: what the page says of them, and what must not matter to them."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.simulator import Simulator
from swarm_pz.systems import Flight
from swarm_pz.systems.potential_field import PotentialField
from tests.systems import reference_potential_field
from tests.systems.random_image_flights import CONFIG, SYMMETRIES, permuted, random_flight, stacked, turn_points, turned
from tests.systems.reference_coverage import cost_of

SYSTEM = PotentialField()
EMPTY, FULL = np.zeros((10, 10)), np.ones((10, 10))


def spot(row, column):
    image = np.zeros((10, 10))
    image[row, column] = 1.0
    return image


def flown(attracts, repels, drones=10, seconds=60, system=SYSTEM, games=4):
    """Return games of one team without captures, some seconds after a command."""
    peace = CaptureConfig(enabled=False)
    simulator = Simulator(GameConfig(drones_per_team=(drones, 0), controllers=system, capture=peace), num_games=games)
    simulator.reset(range(games))
    simulator.command(0, np.repeat(np.stack([attracts, repels])[None], games, axis=0))
    simulator.advance(30 * seconds)
    return simulator


def test_it_is_its_slow_mirror():
    assert reference_potential_field.compare(60, seed=0) < 1e-4


@pytest.mark.parametrize("symmetry", SYMMETRIES)
def test_a_turned_square_turns_the_accelerations(symmetry):
    generator = np.random.default_rng(1)
    for size in (1, 2, 7, 20):
        flight = random_flight(generator, SYSTEM, size)
        own = flight.own[0]
        one = SYSTEM.solve(flight, CONFIG)[0][own]
        other = SYSTEM.solve(turned(flight, symmetry), CONFIG)[0][own]
        np.testing.assert_allclose(turn_points(one, symmetry, 0.0), other, atol=1e-9)


def test_drones_may_have_any_numbers():
    generator = np.random.default_rng(2)
    for size in (2, 10, 30):
        flight = random_flight(generator, SYSTEM, size)
        order = generator.permutation(flight.own.shape[1])
        one, other = SYSTEM.solve(flight, CONFIG)[0], SYSTEM.solve(permuted(flight, order), CONFIG)[0]
        np.testing.assert_allclose(one[order], other, atol=1e-9)


def test_a_game_is_the_same_alone_and_among_others():
    generator = np.random.default_rng(3)
    flights = []
    while len(flights) < 6:
        flight = random_flight(generator, SYSTEM, 8)
        if flight.own.shape[1] == 10:
            flights.append(flight)
    together = SYSTEM.solve(stacked(flights), CONFIG)
    for row, flight in enumerate(flights):
        np.testing.assert_array_equal(together[row], SYSTEM.solve(flight, CONFIG)[0])


@pytest.mark.parametrize("places", [(0.5, 0.5), (0.0, 0.0), (1.0, 0.25), (0.0, 1.0)])
def test_drones_at_one_place_on_walls_and_in_corners_are_pushed_finitely_and_alike(places):
    own = np.ones((1, 8), bool)
    flight = Flight(
        positions=np.full((1, 8, 2), places, np.float32),
        velocities=np.zeros((1, 8, 2), np.float32),
        own=own,
        heard=own[:, :, None] & own[:, None, :],
        commands=np.stack([spot(0, 0), spot(9, 2)])[None],
        former=np.zeros((1, 2, 10, 10)),
        age=np.zeros(1),
    )
    found = SYSTEM.solve(flight, CONFIG)[0]
    assert np.isfinite(found).all()
    np.testing.assert_array_equal(found, np.repeat(found[:1], 8, axis=0))


def test_who_hears_nobody_knows_of_nobody():
    flight = random_flight(np.random.default_rng(5), SYSTEM, 10)
    flight = flight._replace(heard=np.eye(flight.own.shape[1], dtype=bool)[None] & flight.own[:, :, None])
    found = SYSTEM.solve(flight, CONFIG)[0]
    i, *others = np.flatnonzero(flight.own[0])
    moved = flight.positions.copy()
    moved[0, others] = 1.0 - moved[0, others]
    np.testing.assert_array_equal(found[i], SYSTEM.solve(flight._replace(positions=moved), CONFIG)[0][i])


@pytest.mark.parametrize("drones", [6, 10, 24])
@pytest.mark.parametrize(("attracts", "repels"), [(EMPTY, EMPTY), (FULL, EMPTY), (FULL, FULL), (EMPTY, FULL)])
def test_images_that_are_empty_or_uniform_spread_drones_evenly(drones, attracts, repels):
    end = flown(attracts, repels, drones)
    for places in end.positions.astype(float):
        assert cost_of(places, FULL) < 1.6 / (6 * drones)  # 1 / (6 n) is what n squares side by side cost
        apart = np.linalg.norm(places[:, None] - places[None], axis=-1) + 9 * np.eye(drones)
        assert apart.min() > 0.4 / np.sqrt(drones)
    assert np.linalg.norm(end.velocities, axis=-1).max() < 0.02


def test_mutual_repulsion_is_what_spreads_them():
    near = random_flight(np.random.default_rng(6), SYSTEM, 2)
    own = np.ones((1, 2), bool)
    flight = near._replace(
        positions=np.array([[[0.49, 0.5], [0.51, 0.5]]], np.float32),
        velocities=np.zeros((1, 2, 2), np.float32),
        own=own,
        heard=own[:, :, None] & own[:, None, :],
        commands=np.zeros((1, 2, 10, 10)),
    )
    found = SYSTEM.solve(flight, CONFIG)[0]
    assert found[0, 0] < -0.01 < 0.01 < found[1, 0]
    np.testing.assert_allclose(found[:, 1], 0.0, atol=1e-12)


def test_drones_go_where_it_attracts_and_leave_where_it_repels():
    gathered = flown(spot(2, 7), EMPTY).positions
    np.testing.assert_allclose(gathered.mean(axis=1), np.broadcast_to([0.75, 0.25], (4, 2)), atol=0.1)
    chased = flown(EMPTY, spot(5, 5)).positions
    free = flown(EMPTY, EMPTY).positions
    hole, usual = (np.linalg.norm(one - 0.55, axis=-1).min(axis=1).mean() for one in (chased, free))
    assert hole > usual + 0.05


@pytest.mark.parametrize("drones", [6, 24])
def test_both_modes_of_a_density_are_served(drones):
    end = flown(spot(2, 2) + spot(7, 7), EMPTY, drones)
    shares = [(np.linalg.norm(end.positions - place, axis=-1) < 0.3).mean(axis=1) for place in (0.25, 0.75)]
    assert (np.min(shares, axis=0) >= 0.3).all()


def test_only_the_shape_of_an_image_counts():
    generator = np.random.default_rng(7)
    flight = random_flight(generator, SYSTEM, 6)
    faint = flight._replace(commands=flight.commands * np.array([0.25, 0.5])[None, :, None, None])
    np.testing.assert_array_equal(SYSTEM.solve(flight, CONFIG), SYSTEM.solve(faint, CONFIG))


def test_a_density_attracts_and_watchers_see_it():
    densities = np.random.default_rng(8).random((3, 10, 10))
    commands = SYSTEM.from_densities(densities, CONFIG)
    assert commands.shape == (3, *SYSTEM.space(CONFIG).shape)
    assert not commands[:, 1].any()
    seen = SYSTEM.to_densities(commands, CONFIG)
    np.testing.assert_allclose(seen, densities / densities.max(axis=(1, 2), keepdims=True))


def test_watchers_see_nothing_where_it_repels_and_everything_where_nothing_is_asked():
    pictures = SYSTEM.to_densities(np.stack([[EMPTY, EMPTY], [FULL, FULL], [EMPTY, spot(3, 4)]]), CONFIG)
    np.testing.assert_array_equal(pictures, [FULL, FULL, FULL - spot(3, 4)])
    assert SYSTEM.to_densities(np.zeros((0, 2, 10, 10)), CONFIG).shape == (0, 10, 10)


def test_named_commands_are_commands():
    for name, command in SYSTEM.named(CONFIG).items():
        np.testing.assert_array_equal(SYSTEM.parse(command, CONFIG), command, err_msg=name)
    np.testing.assert_array_equal(SYSTEM.parse(SYSTEM.default(CONFIG), CONFIG), SYSTEM.default(CONFIG))


@pytest.mark.parametrize("bad", [np.zeros((10, 10)), np.full((2, 10, 10), 1.5), np.full((2, 10, 10), np.nan), "north"])
def test_what_is_no_command_is_refused(bad):
    with pytest.raises(CommandError, match="command must be numbers of shape"):
        SYSTEM.parse(bad, CONFIG)


def test_a_team_that_spreads_beats_one_that_does_nothing():
    simulator = Simulator(GameConfig(controllers=("potential_field", "direct")), num_games=8)
    simulator.reset(range(8))
    simulator.advance(30 * 60)
    assert simulator.sizes[:, 0].sum() > simulator.sizes[:, 1].sum()


@pytest.mark.parametrize("numbers", [{"softening": 0.0}, {"strength": -1.0}, {"friction": np.inf}, {"wall": "high"}])
def test_numbers_without_a_meaning_are_refused(numbers):
    (name,) = numbers
    with pytest.raises(ConfigError, match=f"potential_field.{name}"):
        PotentialField(**numbers)
