"""Second-order point masses in a square box: p' = g v, v' = u, semi-implicit Euler."""

from __future__ import annotations

import numpy as np

from swarm_pz.kernels import loop
from swarm_pz.kernels.arrays import Float32s

STILL = np.float32(1e-6)
"""A velocity below this has no heading."""


@loop
def move(
    positions: Float32s,
    velocities: Float32s,
    accelerations: Float32s,
    tick: np.float32,
    drift: np.float32,
    min_speed: np.float32,
) -> None:
    """Move every drone of one game by one tick.

    A wall stops a drone and sets its normal velocity to 0, or reverses that velocity if there is a least airspeed.

    Arrays (2N,) hold x and y of one drone after the other; accelerations are saturated already. `tick` is in seconds,
    `drift` map widths a tick per unit of velocity, `min_speed` in units of velocity.
    """
    for n in range(positions.shape[0]):
        velocities[n] += accelerations[n] * tick
    if min_speed > 0.0:
        for n in range(0, positions.shape[0], 2):
            keep_flying(positions[n : n + 2], velocities[n : n + 2], min_speed)
    none, one = np.float32(0.0), np.float32(1.0)
    for n in range(positions.shape[0]):  # without branches, so that LLVM makes vectors of it
        velocity = velocities[n]
        place = positions[n] + velocity * drift
        turned = none if min_speed == 0.0 else -velocity
        velocities[n] = turned if (place < none) | (place > one) else velocity
        positions[n] = none if place < none else (one if place > one else place)


@loop
def keep_flying(position: Float32s, velocity: Float32s, min_speed: np.float32) -> None:
    """Bring a slower velocity (2,) to the least airspeed along its heading; from rest, towards the middle."""
    squared = velocity[0] * velocity[0] + velocity[1] * velocity[1]
    if squared >= min_speed * min_speed:
        return
    if squared < STILL * STILL:
        velocity[0], velocity[1] = np.float32(0.5) - position[0], np.float32(0.5) - position[1]
        squared = velocity[0] * velocity[0] + velocity[1] * velocity[1]
        if squared == 0.0:  # in the very middle
            velocity[0], squared = np.float32(1.0), np.float32(1.0)
    scale = min_speed / np.sqrt(squared)
    velocity[0] *= scale
    velocity[1] *= scale
