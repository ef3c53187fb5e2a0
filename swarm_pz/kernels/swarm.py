"""The drones of one game, as controllers see them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.kernels import kernel


class Swarm(NamedTuple):
    """All N drones of a game: views of its arrays, so that what is written here is written there."""

    positions: NDArray[np.float32]
    """(N, 2) map widths."""
    velocities: NDArray[np.float32]
    """(N, 2) map widths per second, over the speed factor."""
    teams: NDArray[np.int8]
    """(N,) 0 red, 1 blue; -1 for a drone that takes no part."""
    memory: NDArray[np.float32]
    """(K, K, N) each drone's decayed sums of F_k over the past; the ergodic controller keeps them."""
    memory_weight: NDArray[np.float32]
    """(N,) their weight."""
    accelerations: NDArray[np.float32]
    """(N, 2) map widths per second squared: what controllers write."""


@kernel
def with_teams(swarm: Swarm, teams: NDArray[np.int8]) -> Swarm:
    """Return the same drones with other teams (N,)."""
    return Swarm(swarm.positions, swarm.velocities, teams, swarm.memory, swarm.memory_weight, swarm.accelerations)
