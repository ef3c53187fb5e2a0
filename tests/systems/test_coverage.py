"""Coverage: what the page says of it, and what must not matter to it."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, ControllerConfig, DynamicsConfig, GameConfig
from swarm_pz.errors import ConfigError
from swarm_pz.simulator import Simulator
from swarm_pz.spaces.densities import cell_centres, disc
from swarm_pz.systems.coverage import Coverage
from tests.systems import random_image_flights, reference_coverage
from tests.systems.random_image_flights import CONFIG, SYMMETRIES, permuted, random_flight, stacked, turn_points, turned
from tests.systems.reference_coverage import cost_of

SYSTEM = Coverage()
PEACE = CaptureConfig(enabled=False)


def named(name):
    return SYSTEM.named(CONFIG)[name]


def two_discs():
    x, y = cell_centres(10)
    return disc(np.hypot(x - 0.25, y - 0.25), 0.08) + disc(np.hypot(x - 0.75, y - 0.75), 0.08)


def flown(density, drones=10, seconds=30, system=SYSTEM, games=4, **options):
    """Return games of one team without captures, some seconds after a command."""
    config = GameConfig(drones_per_team=(drones, 0), controllers=system, capture=PEACE, **options)
    simulator = Simulator(config, num_games=games)
    simulator.reset(range(games))
    simulator.command(0, np.repeat(density[None] / density.max(), games, axis=0))
    simulator.advance(30 * seconds)
    return simulator


def test_it_is_its_slow_mirror():
    assert reference_coverage.compare(60, seed=0) < 1e-4


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


@pytest.mark.parametrize("image", ["empty", "one cell", "uniform"])
def test_drones_at_one_place_on_walls_and_in_corners_fly_on(image):
    generator = np.random.default_rng(4)
    density = {"empty": np.zeros((10, 10)), "uniform": np.ones((10, 10)), "one cell": np.eye(1, 100).reshape(10, 10)}[
        image
    ]
    odd = [
        np.full((8, 2), 0.5),
        np.full((8, 2), 0.25),
        np.zeros((8, 2)),
        np.repeat([[0.0, 0.0], [1.0, 1.0]], 4, axis=0),
        np.stack([np.arange(8) / 8, np.zeros(8)], axis=1),
        np.stack([np.arange(8) / 8, np.full(8, 0.25)], axis=1),
        0.25 + generator.integers(0, 8, (8, 2)) / 2**20,
        generator.integers(0, 2, (8, 2)).astype(float),
    ]
    own = np.ones((1, 8), bool)
    for positions in odd:
        flight = random_image_flights.Flight(
            positions=positions.astype(np.float32)[None],
            velocities=np.zeros((1, 8, 2), np.float32),
            own=own,
            heard=own[:, :, None] & own[:, None, :],
            commands=density[None],
            former=np.ones((1, 10, 10)),
            age=np.array([0.5]),
        )
        found = SYSTEM.solve(flight, CONFIG)
        assert np.isfinite(found).all()
        for symmetry in SYMMETRIES:
            if image != "one cell":
                other = SYSTEM.solve(turned(flight, symmetry), CONFIG)
                np.testing.assert_allclose(turn_points(found, symmetry, 0.0), other, atol=1e-6)


def test_who_hears_nobody_takes_the_whole_square_and_knows_of_nobody():
    flight = random_flight(np.random.default_rng(5), SYSTEM, 10)
    flight = flight._replace(heard=np.eye(flight.own.shape[1], dtype=bool)[None] & flight.own[:, :, None])
    found = SYSTEM.solve(flight, CONFIG)[0]
    i, *others = np.flatnonzero(flight.own[0])
    moved = flight.positions.copy()
    moved[0, others] = 1.0 - moved[0, others]
    np.testing.assert_array_equal(found[i], SYSTEM.solve(flight._replace(positions=moved), CONFIG)[0][i])
    alone = flown(two_discs(), drones=1)
    np.testing.assert_allclose(alone.positions[:, 0], 0.5, atol=0.01)


@pytest.mark.parametrize("name", ["uniform", "disc_50_50", "halo", "left"])
def test_the_locational_cost_falls_until_drones_rest_at_their_centroids(name):
    density = named(name)
    begin, end = flown(density, seconds=0), flown(density, seconds=60)
    for row in range(4):
        before, after = (cost_of(one.positions[row].astype(float), density) for one in (begin, end))
        assert after < 0.3 * before
        mixed = 0.98 * density / density.mean() + 0.02
        fine = reference_coverage.spread(mixed, 50)
        cells = reference_coverage.Cells(end.positions[row].astype(float), fine, np.zeros_like(fine), 1.0)
        np.testing.assert_allclose(cells.centroids, cells.places, atol=0.02)


@pytest.mark.parametrize("drones", [6, 10, 24])
def test_both_modes_of_a_density_are_served(drones):
    end = flown(two_discs(), drones)
    near = [np.linalg.norm(end.positions - place, axis=-1) < 0.25 for place in (0.25, 0.75)]
    shares = [one.mean(axis=1) for one in near]
    assert (np.min(shares, axis=0) >= 0.25).all()


def test_the_motion_of_neighbours_is_the_derivative_of_the_centroids():
    image, places, step = two_discs() + 0.5, np.random.default_rng(8).random((8, 2)), 0.005
    fine = reference_coverage.spread(image, 400)
    nothing = np.zeros_like(fine)
    cells = reference_coverage.Cells(places, fine, nothing, 1.0)
    there, back = (reference_coverage.Cells(places + sign * step * cells.first, fine, nothing, 1.0) for sign in (1, -1))
    change = (there.centroids - back.centroids) / (2 * step)
    found = [cells.follow(i, image, 0.0) for i in range(len(places))]
    np.testing.assert_allclose(found, change, atol=0.1 * np.abs(change).max())


def test_drones_go_with_a_density_that_moves():
    """A blend of 20 s from one disc to another: the middle of the team moves along."""
    one, other = (named(name) for name in ("disc_30_50", "disc_70_50"))
    simulator = flown(one, seconds=30, system=Coverage(blend=20.0, floor=0.001))
    simulator.command(0, np.repeat(other[None], 4, axis=0))
    middles = []
    for _ in range(20):
        simulator.advance(30)
        middles.append(simulator.positions[:, :, 0].mean())
    assert np.all(np.diff(middles) > -0.01)
    assert middles[-1] - middles[0] > 0.15


def test_a_former_command_counts_until_it_is_blended_out():
    flight = random_flight(np.random.default_rng(9), SYSTEM, 5)
    flight = flight._replace(heard=flight.own[:, :, None] & flight.own[:, None, :])
    solve = [
        SYSTEM.solve(flight._replace(former=former, age=np.array([age])), CONFIG)
        for age in (0.5, 1.0)
        for former in (np.ones((1, 10, 10)), two_discs()[None])
    ]
    assert np.nanmax(np.abs(solve[0] - solve[1])) > 1e-3
    np.testing.assert_allclose(solve[2], solve[3], atol=1e-9)


def test_it_reckons_with_the_speed_factor():
    slow = flown(two_discs(), seconds=60, dynamics=DynamicsConfig(speed_factor=0.5))
    usual = flown(two_discs(), seconds=60)
    costs = [np.mean([cost_of(places.astype(float), two_discs()) for places in one.positions]) for one in (slow, usual)]
    assert costs[0] < 1.2 * costs[1]


def test_who_hears_little_still_spreads():
    config = ControllerConfig(communication_radius=0.3, message_loss=0.2)
    end = flown(np.ones((10, 10)), seconds=60, controller=config)
    assert all(cost_of(places.astype(float), np.ones((10, 10))) < 0.03 for places in end.positions)


def test_a_team_that_covers_beats_one_that_does_nothing():
    simulator = Simulator(GameConfig(controllers=("coverage", "direct")), num_games=8)
    simulator.reset(range(8))
    simulator.advance(30 * 60)
    assert (simulator.sizes[:, 0] >= 10).all()
    assert simulator.sizes[:, 0].mean() > 11


@pytest.mark.parametrize(
    "numbers", [{"blend": 0.0}, {"floor": 0.0}, {"grid": 1}, {"speed": -1.0}, {"neighbours": 2}, {"gain": np.nan}]
)
def test_numbers_without_a_meaning_are_refused(numbers):
    (name,) = numbers
    with pytest.raises(ConfigError, match=f"coverage.{name}"):
        Coverage(**numbers)


def test_other_numbers_are_part_of_a_configuration():
    other = SYSTEM.replace(gain=2.0, neighbours=False)
    assert other == Coverage(gain=2.0, neighbours=False)
    config = GameConfig(controllers=(other, "ergodic"))
    assert GameConfig.from_dict(config.to_dict()) == config
    assert config.hash != GameConfig(controllers=("coverage", "ergodic")).hash
