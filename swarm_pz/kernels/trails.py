"""Trails: the cells that a drone was in lately, and what they add to its team's occupancy.

A trail is a ring buffer: the cell of tick t stands at t modulo the trail's length, or -1 if there is
none.
"""

from __future__ import annotations

import numpy as np

from swarm_pz.config import GRID_CELLS
from swarm_pz.kernels import loop
from swarm_pz.kernels.arrays import Bools, Float32s, Int8s, Int16s
from swarm_pz.kernels.capture import Boards, count


@loop
def along(coordinate: float) -> int:
    """Return the row or column of a float32 coordinate; always one of the grid's, even for NaN and infinity.

    The product is exact in float64, so the cell is that of the coordinate as stored.
    """
    cells: float = np.float64(GRID_CELLS) * np.float64(coordinate)
    cells = cells if cells > 0.0 else 0.0  # in this form, since no comparison holds for NaN
    return int(min(cells, GRID_CELLS - 1.0))


@loop
def cell_of(x: float, y: float) -> int:
    """Index row * G + column of the grid cell that holds a float32 position."""
    return along(y) * GRID_CELLS + along(x)


@loop
def extend_trails(positions: Float32s, teams: Int8s, slot: int, trails: Int16s, boards: Boards) -> None:
    """Write every drone's present cell to its trail, in the tick's slot, in place of the oldest."""
    for i in range(positions.shape[0]):
        oldest, newest = trails[np.uint64(slot), i], cell_of(positions[i, 0], positions[i, 1])
        trails[np.uint64(slot), i] = newest
        count(boards, teams[i], newest, 1)
        if oldest >= 0:
            count(boards, teams[i], oldest, -1)


@loop
def take_back_newest(failed: Bools, teams: Int8s, slot: int, trails: Int16s, boards: Boards) -> None:
    """Undo this tick's entry of drones that have failed: they leave no trail."""
    for i in range(failed.shape[0]):
        if failed[i]:
            count(boards, teams[i], trails[slot, i], -1)
            trails[slot, i] = -1


@loop
def hand_over_trail(trails: Int16s, drone: int, loser: int, winner: int, boards: Boards) -> None:
    """Move the ticks of one drone's trail from the loser to the winner."""
    for place in range(trails.shape[0]):
        if trails[place, drone] >= 0:
            count(boards, loser, trails[place, drone], -1)
            count(boards, winner, trails[place, drone], 1)


@loop
def forget_trail(trails: Int16s, drone: int, team: int, boards: Boards) -> None:
    """Empty the trail of one drone of a team."""
    for place in range(trails.shape[0]):
        if trails[place, drone] >= 0:
            count(boards, team, trails[place, drone], -1)
            trails[place, drone] = -1
