"""Drones do not affect each other's motion, and fly at the least airspeed from rest; test_mirror.py has the rest."""

import numpy as np

from swarm_pz.config import CaptureConfig, DynamicsConfig, GameConfig
from swarm_pz.simulator import Simulator


def test_a_drone_at_rest_flies_towards_the_middle_and_one_in_the_middle_flies():
    simulator = Simulator(GameConfig(controllers="direct", drones_per_team=1, dynamics=DynamicsConfig(min_speed=0.3)))
    simulator.reset([0])
    simulator.games.positions[0] = (0.2, 0.8), (0.5, 0.5)
    simulator.advance(1)
    np.testing.assert_allclose(simulator.velocities[0, 0], (0.3 / 2**0.5, -0.3 / 2**0.5), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(simulator.velocities[0, 1]), 0.3, atol=1e-6)


def test_drones_that_meet_fly_on_as_if_each_was_alone():
    def flown(places, speeds):
        rules = GameConfig(controllers="direct", drones_per_team=(len(places), 0), capture=CaptureConfig(enabled=False))
        simulator = Simulator(rules)
        simulator.reset([0])
        simulator.games.positions[0], simulator.games.velocities[0] = places, speeds
        simulator.advance(60)
        return simulator.positions[0].copy()

    places, speeds = [(0.3, 0.5), (0.7, 0.5), (0.7, 0.5)], [(0.2, 0.0), (-0.2, 0.0), (-0.2, 0.0)]
    together = flown(places, speeds)
    alone = [flown([place], [speed])[0] for place, speed in zip(places, speeds, strict=True)]
    np.testing.assert_array_equal(together, alone)
    assert together[0, 0] > together[1, 0], "they met on their way"
