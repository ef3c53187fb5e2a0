"""Kernels beside slow float64 references, phase by phase, from the kernels' own state."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.mirror import controller_errors, mismatches
from swarm_pz.config import DynamicsConfig, GameConfig
from swarm_pz.kernels.capture import FIELD_UNIT, MANY_DRONES
from swarm_pz.simulator import Simulator
from tests.kernels.states import random_state, solved
from tests.reference import move, ring_sums


@pytest.mark.parametrize("seed", range(5))
def test_no_drone_changes_sides_other_than_in_the_reference(seed):
    assert mismatches(seed, seconds=60) == 0


def test_accelerations_match_the_reference():
    before, after = controller_errors(states=40, seed=0)
    assert before.max() < 1e-3
    assert after.max() < 1e-3


def test_large_swarms_match_the_references_too():
    # Fields of many drones are added up in another way, and drones are solved some at a time.
    assert sum(mismatches(seed, seconds=4, largest_team=400) for seed in range(4)) == 0
    before, after = controller_errors(states=6, seed=1, largest_swarm=800)
    assert before.max() < 1e-3
    assert after.max() < 1e-3


@pytest.mark.parametrize("drones", [MANY_DRONES - 1, MANY_DRONES])
def test_fields_are_the_same_on_both_sides_of_the_switch(drones):
    simulator = Simulator(GameConfig(drones_per_team=(drones // 3, drones - drones // 3)))
    simulator.reset([0])
    generator = np.random.default_rng(0)
    for _ in range(8):
        simulator.command(0, generator.random((1, 10, 10)) ** 4)
        simulator.advance(30)
        for team in range(2):
            sums, counts = ring_sums(simulator.occupancy[0, team])
            np.testing.assert_array_equal(simulator.games.fields[0, team, 2:-2, 2:-2], sums * (FIELD_UNIT // counts))
    assert simulator.games.captures.sum() > 0


@pytest.mark.parametrize("factor", [0.8, 1.0, 1.3])
def test_motion_matches_the_reference(factor):
    generator = np.random.default_rng(7)
    for _ in range(10):
        state = random_state(generator, 40)
        simulator = solved(state, dynamics=DynamicsConfig(speed_factor=factor))
        accelerations = simulator.games.accelerations[0].astype(float)
        positions, velocities = move(state.positions, state.velocities, accelerations, speed_factor=factor)
        np.testing.assert_allclose(simulator.positions[0], positions, atol=1e-6)
        np.testing.assert_allclose(simulator.velocities[0], velocities, atol=1e-5)
