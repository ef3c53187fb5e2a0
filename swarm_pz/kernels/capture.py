"""The capture field, and who is captured.

The capture field at a cell is S / n: the team's occupancy summed over those of the 16 outer cells
of the 5x5 sub-grid around it that lie inside the square, over their number. It is kept in units of
1 / 55440, which makes every value a whole number, since 55440 is a multiple of every n: so values
are exact, can be updated as trails move on, and are compared without division.

Fields have a border of two cells on each side, in which they are always 0.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GRID_CELLS
from swarm_pz.kernels import kernel

BORDER = 2
FRAMED_CELLS = GRID_CELLS + 2 * BORDER
_CELLS, _ONE, _FOUR = np.uint64(GRID_CELLS), np.uint64(1), np.uint64(4)


def _ring_counts() -> NDArray[np.int64]:
    near, far = (_neighbours_inside(reach) for reach in (BORDER - 1, BORDER))
    return np.outer(far, far) - np.outer(near, near)


def _neighbours_inside(reach: int) -> NDArray[np.int64]:
    """Count, along one axis, the cells up to `reach` away from each that lie inside the square."""
    cells = np.arange(GRID_CELLS)
    return np.minimum(cells + reach, GRID_CELLS - 1) - np.maximum(cells - reach, 0) + 1


RING_COUNTS = _ring_counts()
"""(G, G) number n of cells of each cell's ring that lie inside the square."""
FIELD_UNIT = math.lcm(*RING_COUNTS.ravel().tolist())
"""What a capture field of 1 is stored as."""


def ring_weights(largest_occupancy: int) -> NDArray[np.integer]:
    """Return what one tick in a cell's ring adds to the field there, 0 on the border.

    Parameters
    ----------
    largest_occupancy : int
        Ticks that all trails hold together; decides the type, int32 if it has room for the field.

    Returns
    -------
    int32 or int64 array (G + 4, G + 4)
    """
    weights = np.zeros((FRAMED_CELLS, FRAMED_CELLS), np.int64)
    weights[BORDER:-BORDER, BORDER:-BORDER] = FIELD_UNIT // RING_COUNTS
    has_room = largest_occupancy * int(weights.max()) <= np.iinfo(np.int32).max
    return weights.astype(np.int32 if has_room else np.int64)


@kernel
def add_to_field(field: NDArray[np.integer], ring_weights: NDArray[np.integer], cell: int, ticks: int) -> None:
    """Add ticks spent in one cell to a team's capture field.

    "A is on the ring around B" is symmetric, so the cells that see this one form its own ring.

    Parameters
    ----------
    field, ring_weights : int array (G + 4, G + 4)
        The field is updated.
    cell : int
        Index row * G + column.
    ticks : int
    """
    # Unsigned, because a signed index costs a test for a count from the end.
    bottom, left = np.uint64(cell) // _CELLS, np.uint64(cell) % _CELLS
    top, right = bottom + _FOUR, left + _FOUR
    for column in range(left, right + _ONE):
        field[bottom, column] += ticks * ring_weights[bottom, column]
        field[top, column] += ticks * ring_weights[top, column]
    for row in range(bottom + _ONE, top):
        field[row, left] += ticks * ring_weights[row, left]
        field[row, right] += ticks * ring_weights[row, right]


@kernel
def field_value(field: NDArray[np.integer], cell: int) -> int:
    """Return a team's capture field at a cell."""
    value: int = field[cell // GRID_CELLS + BORDER, cell % GRID_CELLS + BORDER]
    return value


@kernel
def field_maximum(field: NDArray[np.integer]) -> int:
    """Return the largest value of one team's capture field."""
    flat = field.ravel()
    highest: int = flat[0]  # on the border, hence 0
    for place in range(flat.shape[0]):
        highest = flat[place] if flat[place] > highest else highest
    return highest


@kernel
def captures(value: int, maximum: int, threshold: float) -> bool:
    """Whether a field captures where it has this value; never an empty one.

    Whole numbers are exact in float64, and so is their product with a threshold of few bits.
    """
    return float(value) > threshold * float(maximum)


@kernel
def find_captured(
    cells: NDArray[np.int16],
    teams: NDArray[np.int8],
    fields: NDArray[np.integer],
    threshold: float,
    captured: NDArray[np.bool_],
) -> None:
    """Test every drone of one game against the opposing capture field.

    Parameters
    ----------
    cells : int16 array (drones,)
        Where they are.
    teams : int8 array (drones,)
    fields : int array (2, G + 4, G + 4)
    threshold : float
    captured : bool array (drones,)
        Overwritten.
    """
    maxima = (field_maximum(fields[0]), field_maximum(fields[1]))
    for i in range(cells.shape[0]):
        opponent = 1 - teams[i]
        captured[i] = captures(field_value(fields[opponent], cells[i]), maxima[opponent], threshold)
