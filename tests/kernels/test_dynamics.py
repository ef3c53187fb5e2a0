"""Least airspeed, drone by drone."""

import numpy as np

from swarm_pz.config import DynamicsConfig, GameConfig
from swarm_pz.simulator import Simulator


def test_no_drone_flies_slower_than_the_least_airspeed_and_none_stays_at_a_wall():
    config = GameConfig(controllers="formation", dynamics=DynamicsConfig(min_speed=0.3))
    simulator = Simulator(config)
    simulator.reset([0])
    at_wall = np.zeros(config.num_drones, int)
    for _ in range(600):
        simulator.advance(1)
        assert (np.linalg.norm(simulator.velocities[0], axis=1) > 0.3 - 1e-5).all()
        is_at_wall = ((simulator.positions[0] == 0.0) | (simulator.positions[0] == 1.0)).any(axis=1)
        at_wall = np.where(is_at_wall, at_wall + 1, 0)
        assert at_wall.max() <= 2


def test_a_drone_at_rest_flies_towards_the_middle_and_one_in_the_middle_flies():
    simulator = Simulator(GameConfig(controllers="direct", drones_per_team=1, dynamics=DynamicsConfig(min_speed=0.3)))
    simulator.reset([0])
    simulator.games.positions[0] = (0.2, 0.8), (0.5, 0.5)
    simulator.advance(1)
    np.testing.assert_allclose(simulator.velocities[0, 0], (0.3 / 2**0.5, -0.3 / 2**0.5), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(simulator.velocities[0, 1]), 0.3, atol=1e-6)
