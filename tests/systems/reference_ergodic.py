"""Ergodic control beside its slow float64 reference, in random states."""

from __future__ import annotations

import numpy as np

from tests.kernels.states import SOFT, random_state, solved
from tests.reference import ControllerReference


def compare(states: int, seed: int) -> float:
    """Solve in random states of 1 to 40 drones.

    Returns
    -------
    float
        The largest difference of an acceleration, as a share of the largest acceleration of its state.
    """
    generator, worst = np.random.default_rng(seed), 0.0
    reference = ControllerReference(r=SOFT.control_weight)
    for _ in range(states):
        state = random_state(generator, int(generator.integers(1, 41)), float(generator.choice([0.05, 0.3, 1.0])))
        simulator = solved(state, controller=SOFT)
        expected, *_ = reference.solve(
            state.positions,
            state.velocities,
            state.teams,
            state.memory,
            state.memory_weight,
            simulator.games.coefficients[0],
        )
        error = np.abs(simulator.games.accelerations[0] - expected).max() / np.abs(expected).max()
        worst = max(worst, float(error))
    return worst
