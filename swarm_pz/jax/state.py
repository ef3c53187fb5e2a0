"""The state of a game in JAX."""

from __future__ import annotations

from typing import NamedTuple

from swarm_pz.jax.params import Array

ABSENT = -1
"""Team of places without a drone."""


class State(NamedTuple):
    """All that changes in a game of N places for drones."""

    tick: Array
    """int32: ticks since the start."""
    positions: Array
    """float32 (N, 2), map widths."""
    velocities: Array
    """float32 (N, 2), map widths a second."""
    accelerations: Array
    """float32 (N, 2), map widths per second squared, held between solves."""
    teams: Array
    """int8 (N,): 0 red, 1 blue, -1 nobody."""
    trails: Array
    """int16 (T, N): cells, row * 50 + column, by the tick modulo T; -1 where there is no past."""
    occupancy: Array
    """int16 (2, 50, 50): ticks that each team's trails count in each cell."""
    memory: Array
    """float32 (K, K, N): each drone's decayed sums of F_k."""
    memory_weight: Array
    """float32 (N,): the weight of these sums."""
    targets: Array
    """float32 (2, A, A): the commands in force; each sums to 1."""
    capture_ticks: Array
    """int32 (N,): tick of each drone's last capture."""
    captures: Array
    """int32 (2,): drones that each team has taken."""
    recaptures: Array
    """int32 (2,): of these, drones that it had lost within the last second."""
