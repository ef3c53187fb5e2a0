"""Coverage: what the page says of it, and what must not matter to it."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, DynamicsConfig, GameConfig
from swarm_pz.errors import ConfigError
from swarm_pz.simulator import Simulator
from swarm_pz.spaces.densities import cell_centres, disc
from swarm_pz.systems.coverage import Coverage
from tests.systems import reference_coverage
from tests.systems.image_flights import CONFIG
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


@pytest.mark.parametrize("name", ["uniform", "left"])
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


@pytest.mark.parametrize("drones", [6, 24])
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


def test_it_reckons_with_the_speed_factor():
    slow = flown(two_discs(), seconds=60, dynamics=DynamicsConfig(speed_factor=0.5))
    usual = flown(two_discs(), seconds=60)
    costs = [np.mean([cost_of(places.astype(float), two_discs()) for places in one.positions]) for one in (slow, usual)]
    assert costs[0] < 1.2 * costs[1]


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
