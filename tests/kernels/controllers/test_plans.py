"""Warm starts: which drones have plans, and how long they keep them. `tests/test_golden.py` compares the plans."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.simulator import Simulator

RELEASED = GameConfig.preset("released")
PEACE = CaptureConfig(enabled=False, field="reconstruction")


def noise(generator: np.random.Generator) -> np.ndarray:
    return generator.random((1, 10, 10)) ** 6


def begun(seed: int = 0, ticks: int = 30, **rules) -> Simulator:
    """Return a game some ticks after red was sent a command."""
    simulator = Simulator(RELEASED.replace(**rules))
    simulator.reset([seed])
    simulator.command(0, noise(np.random.default_rng(seed)))
    simulator.advance(ticks)
    return simulator


def test_plans_survive_captures_and_new_targets_until_the_next_solve():
    simulator, generator, captured = begun(seed=1), np.random.default_rng(1), 0
    games = simulator.games
    for tick in range(30, 900):
        if tick % 30 == 1:
            for team in range(2):
                simulator.command(team, noise(generator))
        plans, teams = games.plans.copy(), simulator.teams.copy()
        assert plans[0].any(axis=(1, 2)).all()
        simulator.advance(1)
        went = simulator.teams != teams
        if tick % 3:
            np.testing.assert_array_equal(games.plans, plans)
            captured += went.sum()
        else:
            assert (games.plans != plans).any(axis=(2, 3)).all()
        if simulator.decided[0]:
            break
    assert captured > 0


@pytest.mark.parametrize("drones", [3, 40])  # 40 drones do not fit into the kernels' tables at once
def test_drones_that_hear_everybody_plan_what_a_team_plans(drones):
    team = begun(drones_per_team=drones, capture=PEACE)
    local = Simulator(team.config.replace(controller=RELEASED.controller.replace(communication_radius=2.0)))
    local.restore(team.snapshot())
    for one in (team, local):
        one.advance(1)
    np.testing.assert_allclose(local.games.plans, team.games.plans, atol=1e-4 * np.abs(team.games.plans).max())


def test_an_acceleration_of_a_plan_gets_the_largest_magnitude_if_an_axis_exceeds_it():
    free, limited = (
        begun(ticks=1, controller=RELEASED.controller.replace(max_acceleration=limit)).games.plans[0].astype(float)
        for limit in (100.0, 0.1)
    )
    length, axis = np.linalg.norm(free, axis=-1), np.abs(free).max(axis=-1)
    assert (axis > 0.1).any() and ((axis < 0.1) & (length > 0.1)).any()
    expected = np.where((axis > 0.1)[..., None], 0.1 * free / np.maximum(length, 1e-9)[..., None], free)
    np.testing.assert_allclose(limited, expected, atol=1e-5)


def test_drones_that_failed_or_that_another_system_flies_have_no_plan():
    mixed = begun(controllers=("ergodic", "flocking"), capture=PEACE)
    np.testing.assert_array_equal(mixed.games.plans[0].any(axis=(1, 2)), mixed.teams[0] == 0)
    failing = begun(dynamics=RELEASED.dynamics.replace(failure_rate=1.0, repair_rate=1.0), capture=PEACE)
    assert 0 < failing.failed.sum() < 20
    np.testing.assert_array_equal(failing.games.plans[0].any(axis=(1, 2)), ~failing.failed[0])
