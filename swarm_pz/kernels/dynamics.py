"""Second-order point masses in a square box: p' = g v, v' = u, semi-implicit Euler."""

from __future__ import annotations

import numpy as np

from swarm_pz.kernels import kernel
from swarm_pz.kernels.arrays import Float32s


@kernel
def move(
    positions: Float32s, velocities: Float32s, accelerations: Float32s, tick: np.float32, drift: np.float32
) -> None:
    """Move every drone of one game by one tick; a wall stops it and takes its normal velocity.

    Accelerations (N, 2) are saturated already. `tick` is in seconds, `drift` map widths a tick per unit of velocity.
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
