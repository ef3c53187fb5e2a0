"""The capture field, and who is captured; `change_team` in `game` lets those change sides.

The capture field at a cell is S / n: the team's occupancy summed over those of the 16 outer cells
of the 5x5 sub-grid around it that lie inside the square, over their number. It is computed in units of
1 / 55440, which makes every value a whole number, since 55440 is a multiple of every n: so values
are exact, and are compared without division.

What changes with every tick is the occupancy alone, on boards with a border of two cells on each side, which stay
empty. A whole field is computed only where it may capture somebody.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GRID_CELLS
from swarm_pz.kernels import kernel, loop
from swarm_pz.kernels.arrays import Bools, Floats, Int8s, Int16s, Int64s, Integers

BORDER = 2
FRAMED_CELLS = GRID_CELLS + 2 * BORDER
MANY_DRONES = 256
"""From so many drones on it is cheaper to compute whole fields than to look at the ring of every drone."""
_CELLS, _BORDER = np.uint64(GRID_CELLS), np.uint64(BORDER)
_ONE, _FOUR, _FIVE = np.uint64(1), np.uint64(4), np.uint64(5)


@loop
def ring_sum(board: Integers | Floats, row: np.uint64, column: np.uint64) -> Any:
    """Return the sum over the ring around a cell, of a framed board (G + 4, G + 4)."""
    # Unsigned, because a signed index costs a test for a count from the end. The border moves the cell to the middle.
    total = 0
    top, right = row + _FOUR, column + _FOUR
    for step in range(_FIVE):
        total += board[row, column + np.uint64(step)] + board[top, column + np.uint64(step)]
    for step in range(_ONE, _FOUR):
        total += board[row + np.uint64(step), column] + board[row + np.uint64(step), right]
    return total


def ring_sums(boards: NDArray[np.integer]) -> NDArray[np.integer]:
    """Return the sums over the rings around all cells (..., G, G), of framed boards (..., G + 4, G + 4)."""
    cells = np.arange(GRID_CELLS, dtype=np.uint64)
    plain: Any = getattr(ring_sum, "py_func", ring_sum)
    sums: NDArray[np.integer] = plain(np.moveaxis(boards, (-2, -1), (0, 1)), cells[:, None], cells)
    return np.moveaxis(sums, (0, 1), (-2, -1))


def capture_fields(occupancy: NDArray[np.integer]) -> NDArray[np.int64]:
    """Return the capture fields (..., G, G) of framed occupancies (..., G + 4, G + 4), in units of `FIELD_UNIT`."""
    return np.asarray(FIELD_UNIT // RING_COUNTS * ring_sums(occupancy))


RING_COUNTS = ring_sums(np.pad(np.ones((GRID_CELLS, GRID_CELLS), np.int64), BORDER))
"""(G, G) number n of cells of each cell's ring that lie inside the square."""
FIELD_UNIT = math.lcm(*RING_COUNTS.ravel().tolist())
"""Value of a capture field of 1."""


class Boards(NamedTuple):
    """The occupancy of one game, and what makes capture fields of it."""

    occupancy: Integers
    """(2, G + 4, G + 4) ticks that each team's trails count in each cell; int16, or int32 for larger numbers."""
    ring_weights: Integers
    """(G, G) amount that one tick in a cell's ring adds to the field there; int32, or int64 for larger numbers."""


def empty_boards(largest_occupancy: int) -> Boards:
    """Return an empty board of each team, and weights, of types that hold so many ticks of all trails together."""
    is_small = largest_occupancy <= np.iinfo(np.int16).max
    return Boards(
        np.zeros((2, FRAMED_CELLS, FRAMED_CELLS), np.int16 if is_small else np.int32),
        (FIELD_UNIT // RING_COUNTS).astype(np.int32 if is_small else np.int64),
    )


@loop
def count(boards: Boards, team: int, cell: int, ticks: int) -> None:
    """Add ticks spent in one cell (row * G + column) to a team's occupancy."""
    boards.occupancy[team, np.uint64(cell) // _CELLS + _BORDER, np.uint64(cell) % _CELLS + _BORDER] += ticks


@loop
def value_at(boards: Boards, team: int, cell: int) -> int:
    """Return a team's capture field at one cell (row * G + column)."""
    row, column = np.uint64(cell) // _CELLS, np.uint64(cell) % _CELLS
    return int(boards.ring_weights[row, column] * ring_sum(boards.occupancy[team], row, column))


@kernel
def fill_field(board: Integers, ring_weights: Integers, field: Integers) -> int:
    """Compute one team's capture field (G, G), and return a cell of its largest value."""
    sums = np.empty(GRID_CELLS, board.dtype)  # of this type, so that vectors hold as many as they can
    largest = np.zeros(GRID_CELLS, field.dtype)  # of each column
    for row in range(GRID_CELLS):
        line, weights = field[row], ring_weights[row]
        for column in range(GRID_CELLS):
            sums[column] = ring_sum(board, np.uint64(row), np.uint64(column))
        for column in range(GRID_CELLS):
            line[column] = weights[column] * sums[column]
            largest[column] = max(largest[column], line[column])
    best = 0
    for column in range(GRID_CELLS):
        best = column if largest[column] > largest[best] else best
    row = 0
    while field[row, best] != largest[best]:
        row += 1
    return row * GRID_CELLS + best


@loop
def capture_limit(maximum: int, threshold: float) -> int:
    """Return the value above which a field with this maximum captures; an empty one never does.

    Whole numbers are exact in float64, and so is their product with a threshold of few bits.
    """
    return int(threshold * float(maximum))


@loop
def may_capture(cells: Int16s, teams: Int8s, boards: Boards, threshold: float, peaks: Int64s) -> bool:
    """Test whether any drone would be captured if the fields were highest at the cells `peaks` (2,)."""
    red_limit = capture_limit(value_at(boards, 0, peaks[0]), threshold)
    blue_limit = capture_limit(value_at(boards, 1, peaks[1]), threshold)
    for i in range(cells.shape[0]):
        if value_at(boards, 1 - teams[i], cells[i]) > (red_limit if teams[i] else blue_limit):
            return True
    return False


@kernel
def find_captured(
    cells: Int16s, teams: Int8s, boards: Boards, threshold: float, peaks: Int64s, captured: Bools
) -> bool:
    """Mark the drones (N,) of one game that the opposing field captures, and return whether there are any.

    `peaks` (2,) are any cells; they are updated to those of the maxima once that matters. Since a field is nowhere
    higher than at its maximum, most tests fail already against where it was lately, and no field need be computed.
    """
    if cells.shape[0] < MANY_DRONES and not may_capture(cells, teams, boards, threshold, peaks):
        return False
    fields = np.empty((2, GRID_CELLS * GRID_CELLS), boards.ring_weights.dtype)
    limits = np.empty(2, np.int64)
    for team in range(2):
        field = fields[team].reshape(GRID_CELLS, GRID_CELLS)
        peaks[team] = fill_field(boards.occupancy[team], boards.ring_weights, field)
        limits[team] = capture_limit(fields[team, peaks[team]], threshold)
    found = False
    for i in range(cells.shape[0]):
        opponent = 1 - teams[i]
        captured[i] = fields[opponent, np.uint64(cells[i])] > limits[opponent]
        found |= captured[i]
    return found
