"""Coverage and potential fields: where teams come to rest, and what watchers see."""

from __future__ import annotations

import numpy as np

from swarm_pz.config import GameConfig
from swarm_pz.simulator import Simulator
from swarm_pz.spaces.densities import named_commands
from swarm_pz.systems.potential_field import PotentialField
from tests.systems.flights import game_of

EMPTY, FULL, LEFT = np.zeros((10, 10)), np.ones((10, 10)), named_commands(10)[3]
FIELD, CONFIG = PotentialField(), GameConfig()


def spot(row, column):
    return np.eye(100)[10 * row + column].reshape(10, 10)


def flown(name, command, seconds=30, games=2):
    """Return games of one team of ten without captures, some seconds after a command."""
    simulator = Simulator(game_of(name, 10), num_games=games)
    simulator.reset(range(games))
    simulator.command(0, np.stack([command] * games))
    simulator.advance(30 * seconds)
    return simulator


def cost_of(places, density):
    """Return the locational cost: the density-weighted mean of the squared distance to the nearest drone."""
    x, y = np.meshgrid(*[(np.arange(50) + 0.5) / 50] * 2)
    squared = (x - places[:, 0, None, None]) ** 2 + (y - places[:, 1, None, None]) ** 2
    return float((np.kron(density / density.mean(), np.ones((5, 5))) * squared.min(axis=0)).mean())


def test_coverages_locational_cost_falls_until_drones_rest():
    begin, end = (flown("coverage", LEFT, seconds) for seconds in (0, 45))
    for before, after in zip(begin.positions.astype(float), end.positions.astype(float), strict=True):
        assert cost_of(after, LEFT) < 0.3 * cost_of(before, LEFT)
    assert np.abs(end.velocities).max() < 0.02


def test_a_density_attracts_and_watchers_see_it_but_nothing_where_it_repels():
    densities = np.random.default_rng(8).random((3, 10, 10))
    commands = FIELD.from_densities(densities, CONFIG)
    assert commands.shape == (3, *FIELD.space(CONFIG).shape) and not commands[:, 1].any()
    seen = FIELD.to_densities(commands, CONFIG)
    np.testing.assert_allclose(seen, densities / densities.max(axis=(1, 2), keepdims=True))
    pictures = FIELD.to_densities(np.stack([[EMPTY, EMPTY], [FULL, FULL], [EMPTY, spot(3, 4)]]), CONFIG)
    np.testing.assert_array_equal(pictures, [FULL, FULL, FULL - spot(3, 4)])
    assert FIELD.to_densities(np.zeros((0, 2, 10, 10)), CONFIG).shape == (0, 10, 10)
