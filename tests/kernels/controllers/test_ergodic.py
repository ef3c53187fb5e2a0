"""The ergodic controller's kernel alone, and compared with its slow reference."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import DynamicsConfig, GameConfig, MemoryConfig
from swarm_pz.kernels.step import solve
from swarm_pz.simulator import Simulator
from tests.kernels.states import SOFT, assert_mirrored, put, random_state, solved
from tests.reference import ControllerReference


def test_its_kernel_alone_does_what_the_game_does_and_writes_but_memories_and_accelerations():
    state = random_state(np.random.default_rng(5), 12)
    flown = solved(state, controller=SOFT)
    start = Simulator(flown.config)
    put(start, state)
    games = start.snapshot()
    games.accelerations[:] = np.nan
    solve(games, start.controller)
    np.testing.assert_allclose(games.accelerations, flown.games.accelerations, rtol=1e-4, atol=1e-4)
    written = {"memory", "memory_weight", "accelerations"}
    for field, array, before in zip(games._fields, games, start.games, strict=True):
        assert field in written or (array == before).all(), field


MIRRORS = {
    "free": ({"controller": SOFT}, {}),
    "saturated": ({}, {"r": 0.1}),
    "exponential": ({"controller": SOFT.replace(spectrum="exponential")}, {"spectrum": "exponential"}),
    "fast": ({"controller": SOFT, "dynamics": DynamicsConfig(speed_factor=1.7)}, {"speed_factor": 1.7}),
    "for ever": ({"controller": SOFT, "memory": MemoryConfig(controller=None)}, {"tau": None}),
    "heavy targets": ({"controller": SOFT.replace(target_mass=10.0, wall_margin=0.2)}, {"wall_margin": 0.2}),
    "other weights": (
        {"controller": SOFT.replace(ergodic_weight=50.0, wall_weight=30.0)},
        {"q": 50.0, "wall_weight": 30.0},
    ),
    "published gains": (
        {"controller": GameConfig.preset("released").controller.replace(warm_start=False)},
        {"q": 1.0, "r": 1.0, "spectrum": "exponential", "wall_margin": 0.01},
    ),
}


@pytest.mark.parametrize("name", MIRRORS)
def test_it_does_what_its_slow_mirror_does(name):
    options, numbers = MIRRORS[name]
    generator = np.random.default_rng(0)
    for _ in range(8):
        state = random_state(generator, int(generator.integers(1, 31)), spread=float(generator.choice([0.05, 0.3, 1])))
        state.velocities[: generator.integers(3)] = 0.0
        assert_mirrored(solved(state, **options), state, ControllerReference(**{"r": 20.0, **numbers}))
