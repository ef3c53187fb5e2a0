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

    A wall stops a drone and takes its normal velocity; where there is a least airspeed, it turns that velocity round.

    Accelerations (N, 2) are saturated already. `tick` is in seconds, `drift` map widths a tick per unit of velocity,
    `min_speed` in units of velocity.
    """
    for i in range(positions.shape[0]):
        for axis in range(2):
            velocities[i, axis] += accelerations[i, axis] * tick
        if min_speed > 0.0:
            keep_flying(positions[i], velocities[i], min_speed)
        for axis in range(2):
            positions[i, axis] += velocities[i, axis] * drift
            if positions[i, axis] < 0.0:
                positions[i, axis] = 0.0
                velocities[i, axis] = 0.0 if min_speed == 0.0 else -velocities[i, axis]
            elif positions[i, axis] > 1.0:
                positions[i, axis] = 1.0
                velocities[i, axis] = 0.0 if min_speed == 0.0 else -velocities[i, axis]


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
