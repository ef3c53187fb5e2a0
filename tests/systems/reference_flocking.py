"""Flocking beside its slow float64 reference, in random states."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from swarm_pz.config import FlockingConfig, GameConfig
from swarm_pz.systems import Flight
from swarm_pz.systems.flocking import Flocking
from tests.kernels.controllers.mirrors import decided_by_rounding
from tests.reference_variants import FlockingReference


def compare(states: int, seed: int) -> float:
    """Solve in random states, of 1 to 40 drones that hear all or some of their team.

    Returns
    -------
    float
        The largest difference of an acceleration, as a share of the largest acceleration of its state. Left out are
        drones that stand within rounding of where the control jumps.
    """
    generator, worst = np.random.default_rng(seed), 0.0
    for _ in range(states):
        drones, spread = int(generator.integers(1, 41)), float(generator.choice([0.05, 0.3, 1.0]))
        numbers = dict(zip(("alignment", "cohesion", "separation"), generator.uniform(0, [5, 5, 0.05]), strict=True))
        numbers |= {"communication_radius": generator.uniform(0.05, 0.3), "max_turn": generator.uniform(0.1, 3.0)}
        config = GameConfig(flocking=FlockingConfig(migration=(0.5, 60.0), **numbers))
        positions = (spread * generator.random((drones, 2))).astype(np.float32)
        velocities = (0.3 * generator.normal(size=(drones, 2))).astype(np.float32)
        own = generator.random(drones) < 0.7
        heard = (generator.random((drones, drones)) < generator.choice([0.3, 1.0])) | np.eye(drones, dtype=bool)
        heard &= own[:, None] & own
        command = np.column_stack([generator.random((4, 2)), generator.uniform(0.5, 60.0, 4)])
        age = float(generator.uniform(0.0, 30.0))
        flight = Flight(
            np.where(own[:, None], positions, np.float32(np.nan))[None],
            np.where(own[:, None], velocities, np.float32(np.nan))[None],
            own[None],
            heard[None],
            command[None],
            command[None],
            np.array([age]),
        )
        found = Flocking().solve(flight, config)[0]
        current = command[min(int(age / config.flocking.dwell), 3)].astype(np.float32)
        reference, teams = FlockingReference(**numbers), np.where(own, 0, 1)
        attractors = np.array([current, current], np.float64)
        expected = reference.solve(positions, velocities, teams, attractors, heard=heard)
        state = SimpleNamespace(positions=positions, velocities=velocities, teams=teams)
        clear = own & ~decided_by_rounding(state, reference, attractors, heard=heard)
        if clear.any():
            worst = max(worst, float(np.abs(found - expected)[clear].max() / np.abs(expected[clear]).max()))
    return worst
