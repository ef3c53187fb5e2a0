"""What control systems see, drawn at random, for those that are compared with slow mirrors."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config.system import Flight

MOST_DRONES = 40


def random_flight(generator: np.random.Generator, command: NDArray[np.float64], own: int, others: int) -> Flight:
    """Draw one game of a team of `own` drones; `others` belong to the other team or have failed.

    In a third of them all hear all, in a third only those within a talk radius, and in a third a part of that is lost.
    """
    drones = own + others
    mine = np.zeros(drones, np.bool_)
    mine[generator.permutation(drones)[:own]] = True
    spread = generator.choice([0.1, 1.0, 1.0])
    corner = (1.0 - spread) * generator.random(2)
    positions = (corner + spread * generator.random((drones, 2))).astype(np.float32)
    velocities = (0.3 * generator.normal(size=(drones, 2))).astype(np.float32)
    heard = mine[:, None] & mine
    kind = generator.integers(3)
    if kind > 0:
        distance = np.linalg.norm(positions[:, None] - positions, axis=-1)
        heard &= distance <= generator.uniform(0.1, 0.8)
    if kind > 1:
        heard &= (generator.random((drones, drones)) < 0.8) | np.eye(drones, dtype=np.bool_)
    nobody = np.where(mine, np.float32(0), np.float32(np.nan))[:, None]
    return Flight(
        positions=(positions + nobody)[None],
        velocities=(velocities + nobody)[None],
        own=mine[None],
        heard=heard[None],
        commands=command[None],
        former=command[None],
        age=np.zeros(1),
    )


def flight_of(positions: Any, velocities: Any, command: NDArray[np.float64]) -> Flight:
    """Return one game of a team (N, 2) that hears all of itself."""
    places = np.array(positions, np.float32)[None]
    drones = places.shape[1]
    speeds = np.broadcast_to(np.array(velocities, np.float32), places.shape).copy()
    own = np.ones((1, drones), np.bool_)
    return Flight(places, speeds, own, own[:, :, None] & own[:, None], command[None], command[None], np.zeros(1))


def turned_flight(flight: Flight, symmetry: tuple[bool, bool, bool], command: NDArray[np.float64]) -> Flight:
    """Return a flight as one of the square's symmetries shows it, with its command so turned."""
    positions = turn(flight.positions, symmetry, 0.5).astype(np.float32)
    velocities = turn(flight.velocities, symmetry, 0.0).astype(np.float32)
    return flight._replace(positions=positions, velocities=velocities, commands=command[None], former=command[None])


def turn(vectors: NDArray[Any], symmetry: tuple[bool, bool, bool], middle: float) -> NDArray[np.float64]:
    """Flip x, then y, then exchange them, about a middle."""
    turned = np.array(vectors, np.float64) - middle
    for axis in range(2):
        if symmetry[axis]:
            turned[..., axis] = -turned[..., axis]
    return (turned[..., ::-1] if symmetry[2] else turned) + middle
