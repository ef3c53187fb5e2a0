"""Kernels agree with slow float64 references, phase by phase, from the kernels' own state."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.mirror import mismatches
from swarm_pz.config import DynamicsConfig
from tests.kernels.states import assert_mirrored, random_state, solved
from tests.reference import ControllerReference, move


@pytest.mark.parametrize(("seed", "seconds", "largest_team"), [(0, 12, 40), (1, 20, 12), (3, 4, 400)], ids=str)
def test_no_drone_changes_sides_other_than_in_the_reference(seed, seconds, largest_team):
    assert mismatches(seed, seconds, largest_team) == 0


@pytest.mark.parametrize("drones", [12, 800])  # large swarms are solved in parts
def test_accelerations_and_memories_match_the_reference(drones):
    state = random_state(np.random.default_rng(1), drones)
    assert_mirrored(solved(state), state, ControllerReference())


@pytest.mark.parametrize(("factor", "least"), [(0.8, 0.0), (1.0, 0.0), (1.0, 0.3)])
def test_motion_matches_the_reference(factor, least):
    state = random_state(np.random.default_rng(7), 200)
    state.positions[:100] = state.positions[:100].round()  # at walls
    simulator = solved(state, dynamics=DynamicsConfig(speed_factor=factor, min_speed=least))
    accelerations = simulator.games.accelerations[0].astype(float)
    positions, velocities = move(state.positions, state.velocities, accelerations, speed_factor=factor, min_speed=least)
    np.testing.assert_allclose(simulator.positions[0], positions, atol=1e-6)
    np.testing.assert_allclose(simulator.velocities[0], velocities, atol=1e-5)
    assert (positions[:, 0] == 0.0).any() and (positions[:, 0] == 1.0).any()
