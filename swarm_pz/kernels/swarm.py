"""The drones of one game, as controllers see them."""

from __future__ import annotations

from typing import NamedTuple

from swarm_pz.kernels import kernel
from swarm_pz.kernels.arrays import Float32s, Int8s


class Swarm(NamedTuple):
    """All N drones of a game: views of its arrays, so that writing here changes the game."""

    positions: Float32s
    """(N, 2) map widths."""
    velocities: Float32s
    """(N, 2) map widths per second, over the speed factor."""
    teams: Int8s
    """(N,) 0 red, 1 blue; -1 for a drone that takes no part."""
    memory: Float32s
    """(K, K, N') each drone's decayed sums of F_k over the past; the ergodic controller keeps them."""
    memory_weight: Float32s
    """(N,) their weight."""
    accelerations: Float32s
    """(N, 2) map widths per second squared; controllers write these."""
    plans: Float32s | None
    """(N, H, 2) accelerations that each drone's last solve planned, from that solve on; None if none are kept."""


@kernel
def with_teams(swarm: Swarm, teams: Int8s) -> Swarm:
    """Return the same drones with other teams (N,)."""
    return Swarm(
        swarm.positions, swarm.velocities, teams, swarm.memory, swarm.memory_weight, swarm.accelerations, swarm.plans
    )
