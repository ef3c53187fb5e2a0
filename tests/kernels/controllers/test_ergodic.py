"""The ergodic controller's kernel alone, and beside its slow reference."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import ControllerConfig
from swarm_pz.kernels.profiling import solve
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


@pytest.mark.parametrize("controller", [SOFT, ControllerConfig()], ids=["free", "saturated"])
def test_it_does_what_its_slow_mirror_does(controller):
    generator = np.random.default_rng(0)
    for _ in range(40):
        state = random_state(generator, int(generator.integers(1, 31)), spread=float(generator.choice([0.05, 0.3, 1])))
        state.velocities[: generator.integers(3)] = 0.0
        simulator = solved(state, controller=controller)
        assert_mirrored(simulator, state, ControllerReference(r=simulator.config.controller.control_weight))
