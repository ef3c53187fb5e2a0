"""Second-order point masses in a square box: p' = g v, v' = u, semi-implicit Euler."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_pz.kernels import kernel


@kernel
def move(
    positions: NDArray[np.float32],
    velocities: NDArray[np.float32],
    accelerations: NDArray[np.float32],
    tick: np.float32,
    drift: np.float32,
) -> None:
    """Move every drone of one game by one tick; a wall stops it and takes its normal velocity.

    Parameters
    ----------
    positions, velocities : float32 array (drones, 2)
        Map widths, map widths per second; updated.
    accelerations : float32 array (drones, 2)
        Map widths per second squared, already saturated.
    tick : float32
        Length of a tick in seconds.
    drift : float32
        Map widths travelled in a tick per unit of velocity: g times the tick.
    """
    for i in range(positions.shape[0]):
        for axis in range(2):
            velocities[i, axis] += accelerations[i, axis] * tick
            positions[i, axis] += velocities[i, axis] * drift
            if positions[i, axis] < 0.0:
                positions[i, axis] = 0.0
                velocities[i, axis] = 0.0
            elif positions[i, axis] > 1.0:
                positions[i, axis] = 1.0
                velocities[i, axis] = 0.0
