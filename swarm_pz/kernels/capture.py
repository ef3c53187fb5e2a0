"""The capture field, and which drones it captures; `change_team` in `game` moves them to the other team.

The capture field at a cell is S / n. Of the 16 outer cells of the 5x5 sub-grid around it, n lie inside the square,
and S is the team's occupancy summed over these. The field is computed in units of 1 / 55440. Since 55440 is a multiple
of every n, all values are whole numbers: exact, and compared without division.

Each tick changes only the occupancy, on boards with a border of two empty cells on each side. A whole field is
computed only if it may capture a drone.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GRID_CELLS
from swarm_pz.kernels import kernel, loop
from swarm_pz.kernels.arrays import Bools, Floats, Int8s, Int16s, Int64s, Integers

RING_RADIUS = 2
"""Radius of the ring in cells, and so the empty cells around a framed board."""
FRAMED_CELLS = GRID_CELLS + 2 * RING_RADIUS
_CELLS, _FRAMED = np.uint64(GRID_CELLS), np.uint64(FRAMED_CELLS)
_MIDDLE = np.uint64(RING_RADIUS * FRAMED_CELLS + RING_RADIUS)
"""Offset from the first corner of a ring to the cell in its middle."""
# Indices of cells are unsigned, because signed ones cost a test for negative values.
_ONE, _LAST, _SIDE = np.uint64(1), np.uint64(2 * RING_RADIUS), np.uint64(2 * RING_RADIUS + 1)


@loop
def ring_sum(board: Integers | Floats, corner: np.uint64) -> Any:
    """Return the sum over the ring with that first corner, of a framed board (FRAMED_CELLS^2,)."""
    total, top = 0, corner + _LAST * _FRAMED
    for step in range(_SIDE):
        total += board[corner + np.uint64(step)] + board[top + np.uint64(step)]
    for step in range(_ONE, _LAST):
        side = corner + np.uint64(step) * _FRAMED
        total += board[side] + board[side + _LAST]
    return total


def ring_sums(boards: NDArray[np.integer]) -> NDArray[np.integer]:
    """Return the sums over the rings around all cells (..., G, G), of framed boards (..., G + 4, G + 4)."""
    cells = np.arange(GRID_CELLS, dtype=np.uint64)
    plain: Any = getattr(ring_sum, "py_func", ring_sum)
    flat = np.moveaxis(boards.reshape(*boards.shape[:-2], -1), -1, 0)
    sums: NDArray[np.integer] = plain(flat, cells[:, None] * _FRAMED + cells)
    return np.moveaxis(sums, (0, 1), (-2, -1))


def capture_fields(occupancy: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return the capture fields (..., G, G) of framed occupancies (..., G + 4, G + 4), in units of `FIELD_UNIT`."""
    return np.asarray(FIELD_UNIT // RING_COUNTS * ring_sums(occupancy))


RING_COUNTS = ring_sums(np.pad(np.ones((GRID_CELLS, GRID_CELLS), np.int64), RING_RADIUS))
"""(G, G) number n of cells of each cell's ring that lie inside the square."""
FIELD_UNIT = math.lcm(*RING_COUNTS.ravel().tolist())
"""The whole number that stands for a capture field of 1."""


class Boards(NamedTuple):
    """The occupancy of one game, and the weights that turn it into capture fields."""

    occupancy: Integers
    """(2, (G + 4)^2) ticks that each team's trails count in each cell; int16, or int32 for larger numbers."""
    ring_weights: Integers
    """(G^2,) amount that one tick in a cell's ring adds to the field there; int32, or int64 for larger numbers."""


def empty_boards(largest_occupancy: int) -> Boards:
    """Return empty boards and weights, of types that hold `largest_occupancy` ticks on a ring, and its field."""
    weights = FIELD_UNIT // RING_COUNTS
    small, whole = (np.iinfo(one).max for one in (np.int16, np.int32))
    is_small = largest_occupancy <= min(small, whole // int(weights.max()))
    return Boards(
        np.zeros((2, FRAMED_CELLS**2), np.int16 if is_small else np.int32),
        weights.ravel().astype(np.int32 if is_small else np.int64),
    )


@loop
def corner_of(cell: np.uint64) -> np.uint64:
    """Return the number of the first corner of the ring around a cell (row * G + column) on a framed board."""
    return cell + cell // _CELLS * (_FRAMED - _CELLS)


@loop
def count(boards: Boards, team: int, cell: int, ticks: int) -> None:
    """Add ticks spent in one cell (row * G + column) to a team's occupancy."""
    boards.occupancy[np.uint64(team), corner_of(np.uint64(cell)) + _MIDDLE] += ticks


@loop
def value_at(board: Integers, ring_weights: Integers, cell: int) -> int:
    """Return a team's capture field at one cell (row * G + column)."""
    return int(ring_weights[np.uint64(cell)]) * int(ring_sum(board, corner_of(np.uint64(cell))))


class FieldScratch(NamedTuple):
    """A capture field and scratch to compute it, for one game after the other."""

    field: Integers
    """(G^2,) of the type of the ring's weights."""
    largest: Integers
    """(G,) its largest value in each column."""
    sums: Integers
    """(G,) of the type of a board, so that vectors hold as many as they can."""


@kernel
def make_field_scratch(occupancy: Integers, ring_weights: Integers) -> FieldScratch:
    """Allocate scratch for fields of such boards."""
    return FieldScratch(
        np.empty(GRID_CELLS * GRID_CELLS, ring_weights.dtype),
        np.empty(GRID_CELLS, ring_weights.dtype),
        np.empty(GRID_CELLS, occupancy.dtype),
    )


@loop
def fill_field(board: Integers, ring_weights: Integers, scratch: FieldScratch) -> int:
    """Compute one team's capture field, and return a cell of its largest value."""
    field, largest, sums = scratch.field, scratch.largest, scratch.sums
    largest[:] = 0
    for row in range(GRID_CELLS):
        line, weights = field[row * GRID_CELLS :], ring_weights[row * GRID_CELLS :]
        for column in range(GRID_CELLS):
            sums[column] = ring_sum(board, np.uint64(row) * _FRAMED + np.uint64(column))
        for column in range(GRID_CELLS):
            line[column] = weights[column] * sums[column]
            largest[column] = max(largest[column], line[column])
    cell = 0
    for column in range(GRID_CELLS):
        cell = column if largest[column] > largest[cell] else cell
    most = largest[cell]
    while field[cell] != most:
        cell += GRID_CELLS
    return cell


@loop
def capture_limit(maximum: int, threshold: float) -> int:
    """Return the value above which a field with this maximum captures; an empty one never does.

    Whole numbers are exact in float64, and so is their product with a threshold of few bits.
    """
    return int(threshold * float(maximum))


@loop
def find_captured(
    cells: Int16s, teams: Int8s, boards: Boards, threshold: float, peaks: Int64s, scratch: FieldScratch, captured: Bools
) -> bool:
    """Mark the drones (N,) of one game that the opposing field captures, and return whether there are any.

    `peaks` (2,) are any cells. The field there gives a limit that its maximum can only raise: if no drone exceeds it,
    no field is computed. Otherwise the field is computed, and its peak becomes the cell of its maximum.
    """
    occupancy, weights = boards.occupancy, boards.ring_weights
    red_limit = capture_limit(value_at(occupancy[0], weights, peaks[0]), threshold)
    blue_limit = capture_limit(value_at(occupancy[1], weights, peaks[1]), threshold)
    candidates = 0  # a bit for each losing team: 1 for red, 2 for blue
    for i in range(cells.shape[0]):  # without branches, which a processor could not predict
        value = value_at(occupancy[np.uint64(1 - teams[i])], weights, cells[i])
        captured[i] = value > (red_limit if teams[i] else blue_limit)
        candidates |= captured[i] << teams[i]
    found = False
    for team in range(2):
        if candidates >> (1 - team) & 1:
            peaks[team] = fill_field(occupancy[np.uint64(team)], weights, scratch)
            limit = capture_limit(scratch.field[peaks[team]], threshold)
            for i in range(cells.shape[0]):
                if captured[i] and teams[i] != team:
                    captured[i] = scratch.field[np.uint64(cells[i])] > limit
                    found |= captured[i]
    return found
