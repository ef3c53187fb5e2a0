"""Potential fields: what the page says of them, and what must not matter to them."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.errors import ConfigError
from swarm_pz.simulator import Simulator
from swarm_pz.systems.potential_field import PotentialField
from tests.systems.image_flights import CONFIG, random_image_flight
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


@pytest.mark.parametrize("drones", [6, 24])
@pytest.mark.parametrize(("attracts", "repels"), [(EMPTY, EMPTY), (FULL, FULL)])
def test_images_that_are_empty_or_uniform_spread_drones_evenly(drones, attracts, repels):
    end = flown(attracts, repels, drones)
    for places in end.positions.astype(float):
        assert cost_of(places, FULL) < 1.6 / (6 * drones)  # 1 / (6 n) is what n squares side by side cost
        apart = np.linalg.norm(places[:, None] - places[None], axis=-1) + 9 * np.eye(drones)
        assert apart.min() > 0.4 / np.sqrt(drones)
    assert np.linalg.norm(end.velocities, axis=-1).max() < 0.02


def test_drones_go_where_it_attracts_and_leave_where_it_repels():
    gathered = flown(spot(2, 7), EMPTY).positions
    np.testing.assert_allclose(gathered.mean(axis=1), np.broadcast_to([0.75, 0.25], (4, 2)), atol=0.1)
    chased = flown(EMPTY, spot(5, 5)).positions
    free = flown(EMPTY, EMPTY).positions
    hole, usual = (np.linalg.norm(one - 0.55, axis=-1).min(axis=1).mean() for one in (chased, free))
    assert hole > usual + 0.05


def test_only_the_shape_of_an_image_counts():
    generator = np.random.default_rng(7)
    flight = random_image_flight(generator, SYSTEM, 6)
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
