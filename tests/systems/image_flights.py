"""Random states of teams that take images, and what must not matter in them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.systems import ControlSystem, Flight

Floats = NDArray[np.float64]
CONFIG = GameConfig()


def random_image_flight(generator: np.random.Generator, system: ControlSystem, size: int) -> Flight:
    """Draw a team of some drones among others, at places whose mirror images are exact; some do not hear all."""
    total = size + int(generator.integers(0, 5))
    own = np.zeros(total, bool)
    own[generator.permutation(total)[:size]] = True
    spread = generator.choice([0.1, 0.5, 1.0])
    steps = generator.integers(0, int(4096 * spread) + 1, (total, 2)) + generator.integers(0, 4097 - int(4096 * spread))
    positions = steps / 4096.0
    heard = own[:, None] & own[None, :]
    if generator.random() < 0.5:
        radius, loss = generator.choice([0.1, 0.3, 0.6]), generator.choice([0.0, 0.3])
        near = np.linalg.norm(positions[:, None] - positions[None], axis=-1) <= radius
        heard &= near & (generator.random((total, total)) >= loss) | np.eye(total, dtype=bool)
    shape = system.space(CONFIG).shape
    images = generator.random((2, *shape)) ** generator.choice([1, 4, 16])
    images[generator.random(2) < 0.1] = 0.0
    velocities = generator.normal(size=(total, 2)) * 0.2
    return Flight(
        positions=np.where(own[:, None], positions, np.nan).astype(np.float32)[None],
        velocities=np.where(own[:, None], velocities, np.nan).astype(np.float32)[None],
        own=own[None],
        heard=heard[None],
        commands=images[:1],
        former=images[1:],
        age=generator.choice([0.0, 0.35, 100.0], 1),
    )


def worst_error(
    system: ControlSystem, reference: Callable[[ControlSystem, Flight], Floats], states: int, seed: int
) -> float:
    """Return the largest difference (over the largest acceleration of its state) of a system from its reference."""
    generator, worst = np.random.default_rng(seed), 0.0
    for number in range(states):
        flight = random_image_flight(generator, system, 1 + number % 40)
        own = flight.own[0]
        found, expected = system.solve(flight, CONFIG)[0][own], reference(system, flight)[own]
        assert np.isfinite(found).all() and np.isfinite(expected).all()
        worst = max(worst, float(np.abs(found - expected).max() / np.abs(expected).max()))
    return worst
