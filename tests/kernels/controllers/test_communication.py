"""Communication within a radius, and drones that fail."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, DynamicsConfig, GameConfig
from swarm_pz.simulator import Simulator
from tests.kernels.states import SOFT, assert_mirrored, random_state, solved
from tests.reference import ControllerReference, RuleReference, basis

REFERENCE = ControllerReference(r=20.0)
"""The slow controller with the gains of SOFT."""


@pytest.mark.parametrize("fails", [False, True])
@pytest.mark.parametrize("is_near", [False, True])
def test_drones_average_over_the_working_team_mates_within_the_radius(is_near, fails):
    generator = np.random.default_rng(0)
    for _ in range(6):
        state = random_state(generator, int(generator.integers(1, 31)))
        failed = generator.random(len(state.teams)) < 0.3 * fails
        radius = float(generator.uniform(0.02, 0.8)) if is_near else None
        dynamics = DynamicsConfig(failure_rate=1e-9 if fails else 0.0)
        simulator = solved(state, failed, controller=SOFT.replace(communication_radius=radius), dynamics=dynamics)
        apart = np.linalg.norm(state.positions[:, None].astype(float) - state.positions[None], axis=-1)
        assert_mirrored(simulator, state, REFERENCE, heard=apart <= (radius or math.inf), failed=failed)


def test_a_failed_drone_stands_still_writes_no_trail_and_returns_with_an_empty_memory():
    dynamics = DynamicsConfig(failure_rate=0.5, repair_rate=2.0)
    config = GameConfig(capture=CaptureConfig(threshold=0.5), dynamics=dynamics)
    returned, captured, captured_failed = 0, 0, 0
    for seed in range(2):
        simulator, generator = Simulator(config), np.random.default_rng(seed)
        simulator.reset([seed])
        games, rules = simulator.games, RuleReference(simulator.teams[0], threshold=0.5)
        for tick in range(200):
            if tick % 30 == 0:
                for team in range(2):
                    simulator.command(team, generator.random((1, 10, 10)) ** 4)
            before = simulator.snapshot()
            simulator.advance(1)
            failed = games.failed[0].copy()
            np.testing.assert_array_equal(simulator.positions[0, failed], before.positions[0, failed])
            assert not simulator.velocities[0, failed].any() and not games.accelerations[0, failed].any()

            back = before.failed[0] & ~failed
            assert tick % 3 == 0 or not back.any()
            for drone in np.flatnonzero(back & (simulator.teams[0] == before.teams[0])):
                assert games.memory_weight[0, drone] == 1.0
                place = before.positions[0, drone].astype(float)
                np.testing.assert_allclose(games.memory[0, :, :, drone], basis(place), atol=1e-5)
                returned += 1

            lost = rules.tick(simulator.positions[0], failed=failed)
            np.testing.assert_array_equal(simulator.teams[0], rules.teams)
            np.testing.assert_array_equal(simulator.occupancy[0], rules.occupancy)
            captured, captured_failed = captured + len(lost), captured_failed + int(failed[lost].sum())
            if simulator.decided[0]:
                break
    assert returned > 10
    assert captured > captured_failed > 0


@pytest.mark.parametrize("preset", ["paper", "released"])
def test_a_team_of_which_every_drone_has_failed_stands(preset):
    config = GameConfig.preset(preset)
    capture, dynamics = config.capture.replace(enabled=False), config.dynamics.replace(failure_rate=1e-9)
    simulator = Simulator(config.replace(dynamics=dynamics, capture=capture))
    simulator.reset([0])
    simulator.advance(30)
    games = simulator.games
    games.failed[0, 10:], games.velocities[0, 10:], games.accelerations[0, 10:] = True, 0.0, 0.0
    places = simulator.positions[0, 10:].copy()
    simulator.advance(30)
    np.testing.assert_array_equal(games.failed[0], simulator.teams[0] == 1)
    np.testing.assert_array_equal(simulator.positions[0, 10:], places)
    for array in (simulator.positions, simulator.capture_field, games.memory):
        assert np.isfinite(array).all()
