"""Trails (the cells a drone was in lately) and occupancy (a team's trails summed on the grid).

A trail is a ring buffer: the cell of tick t stands at t modulo the trail's length, -1 where the
drone has no past yet. The sums that the capture field needs follow every change of the occupancy.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_pz.kernels import kernel


@kernel
def cell_of(x: float, y: float, cells: int) -> int:
    """Index row * cells + column of the grid cell that holds a float32 position.

    The product is exact in float64, so the cell is that of the position as stored.
    """
    column = min(int(np.float64(cells) * np.float64(x)), cells - 1)
    row = min(int(np.float64(cells) * np.float64(y)), cells - 1)
    return row * cells + column


@kernel
def change_occupancy(occupancy: NDArray[np.int32], ring_sums: NDArray[np.int32], cell: int, change: int) -> None:
    """Add to one cell of a team's occupancy, and to the ring sums of the cells that see it.

    Parameters
    ----------
    occupancy, ring_sums : int32 array (cells, cells)
        One team's; updated.
    cell : int
        Index row * cells + column.
    change : int
    """
    cells = occupancy.shape[0]
    row, column = cell // cells, cell % cells
    occupancy[row, column] += change
    # "A is on the ring around B" is symmetric, so the cells that see this one form its own ring.
    for other_row in range(max(row - 2, 0), min(row + 3, cells)):
        for other_column in range(max(column - 2, 0), min(column + 3, cells)):
            if abs(other_row - row) == 2 or abs(other_column - column) == 2:
                ring_sums[other_row, other_column] += change


@kernel
def extend_trails(
    positions: NDArray[np.float32],
    teams: NDArray[np.int8],
    slot: int,
    trails: NDArray[np.int16],
    occupancy: NDArray[np.int32],
    ring_sums: NDArray[np.int32],
) -> None:
    """Write every drone's present cell to its trail, in place of the oldest.

    Parameters
    ----------
    positions : float32 array (drones, 2)
    teams : int8 array (drones,)
    slot : int
        Place in the ring buffers: the tick modulo their length.
    trails : int16 array (drones, length)
    occupancy, ring_sums : int32 array (2, cells, cells)
        All updated.
    """
    cells = occupancy.shape[1]
    for i in range(positions.shape[0]):
        team = teams[i]
        oldest = trails[i, slot]
        newest = cell_of(positions[i, 0], positions[i, 1], cells)
        trails[i, slot] = newest
        if newest != oldest:
            change_occupancy(occupancy[team], ring_sums[team], newest, 1)
            if oldest >= 0:
                change_occupancy(occupancy[team], ring_sums[team], oldest, -1)


@kernel
def hand_over_trail(
    trail: NDArray[np.int16],
    loser: int,
    winner: int,
    occupancy: NDArray[np.int32],
    ring_sums: NDArray[np.int32],
) -> None:
    """Move one drone's trail from the occupancy of the loser to that of the winner."""
    for slot in range(trail.shape[0]):
        if trail[slot] >= 0:
            change_occupancy(occupancy[loser], ring_sums[loser], trail[slot], -1)
            change_occupancy(occupancy[winner], ring_sums[winner], trail[slot], 1)
