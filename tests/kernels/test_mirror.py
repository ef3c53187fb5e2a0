"""Kernels beside slow float64 references, phase by phase, from the kernels' own state."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.mirror import controller_errors, mismatches
from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.simulator import Simulator
from tests.reference import move


@pytest.mark.parametrize("seed", range(5))
def test_no_drone_changes_sides_other_than_in_the_reference(seed):
    assert mismatches(seed, seconds=60) == 0


def test_accelerations_match_the_reference():
    before, after = controller_errors(states=40, seed=0)
    assert before.max() < 1e-3
    assert after.max() < 1e-3


def test_motion_matches_the_reference():
    simulator = Simulator(GameConfig(drones_per_team=40, capture=CaptureConfig(enabled=False)))
    generator = np.random.default_rng(0)
    for seed in range(20):
        velocities = generator.normal(size=(80, 2))
        simulator.reset([seed], scenario={"positions": generator.random((80, 2)), "velocities": velocities})
        positions, velocities = simulator.positions[0].astype(float), simulator.velocities[0].astype(float)
        simulator.advance(1)
        accelerations = simulator.games.accelerations[0].astype(float)
        expected_positions, expected_velocities = move(positions, velocities, accelerations)
        np.testing.assert_allclose(simulator.positions[0], expected_positions, atol=1e-6)
        np.testing.assert_allclose(simulator.velocities[0], expected_velocities, atol=1e-5)
