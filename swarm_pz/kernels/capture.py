"""The capture field, and who is captured; `change_team` in `game` lets those change sides.

The capture field at a cell is S / n: the team's occupancy summed over those of the 16 outer cells
of the 5x5 sub-grid around it that lie inside the square, over their number. It is kept in units of
1 / 55440, which makes every value a whole number, since 55440 is a multiple of every n: so values
are exact, can be updated as trails move on, and are compared without division.

Boards have a border of two cells on each side, in which fields are always 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarm_pz.config import GRID_CELLS
from swarm_pz.kernels import kernel
from swarm_pz.kernels.arrays import Bools, Int8s, Int16s, Int64s, Integers

BORDER = 2
FRAMED_CELLS = GRID_CELLS + 2 * BORDER
MANY_DRONES = 256
"""From so many drones on it is cheaper to add up fields anew than to change them for every drone."""
_CELLS, _BORDER = np.uint64(GRID_CELLS), np.uint64(BORDER)
_ONE, _FOUR = np.uint64(1), np.uint64(4)


def _ring_counts() -> Int64s:
    near, far = (_neighbours_inside(reach) for reach in (BORDER - 1, BORDER))
    return np.outer(far, far) - np.outer(near, near)


def _neighbours_inside(reach: int) -> Int64s:
    """Count, along one axis, the cells up to `reach` away from each that lie inside the square."""
    cells = np.arange(GRID_CELLS)
    return np.minimum(cells + reach, GRID_CELLS - 1) - np.maximum(cells - reach, 0) + 1


RING_COUNTS = _ring_counts()
"""(G, G) number n of cells of each cell's ring that lie inside the square."""
FIELD_UNIT = math.lcm(*RING_COUNTS.ravel().tolist())
"""Stored value of a capture field of 1."""


def ring_weights(largest_occupancy: int) -> Integers:
    """Return the amount (G + 4, G + 4) that one tick in a cell's ring adds to the field there, 0 on the border.

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


class Boards(NamedTuple):
    """The capture fields of one game, and what they are made from."""

    fields: Integers
    """(2, G + 4, G + 4) in units of `FIELD_UNIT`."""
    occupancy: Integers
    """(2, G + 4, G + 4) ticks that trails count in each cell; (2, 0, 0) with few drones."""
    ring_weights: Integers
    """(G + 4, G + 4) see `ring_weights`."""


@kernel
def add_to_occupancy(occupancy: Integers, cell: int, ticks: int) -> None:
    """Add ticks spent in one cell (row * G + column) to a team's occupancy; `add_up` has to follow."""
    occupancy[np.uint64(cell) // _CELLS + _BORDER, np.uint64(cell) % _CELLS + _BORDER] += ticks


@kernel
def add_to_field(field: Integers, ring_weights: Integers, cell: int, ticks: int) -> None:
    """Add ticks spent in one cell (row * G + column) to a team's capture field.

    "A is on the ring around B" is symmetric, so the cells that see this one form its own ring.
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
def add_up(boards: Boards) -> None:
    """With many drones: add up both fields from the occupancy, as 5x5 less 3x3 sub-grids."""
    if not boards.occupancy.size:
        return
    wide = np.empty((FRAMED_CELLS, GRID_CELLS), boards.fields.dtype)
    narrow = np.empty((FRAMED_CELLS, GRID_CELLS), boards.fields.dtype)
    for team in range(2):
        for row in range(FRAMED_CELLS):
            cells = boards.occupancy[team, row]
            for column in range(GRID_CELLS):
                inner = cells[column + 1] + cells[column + 2] + cells[column + 3]
                narrow[row, column] = inner
                wide[row, column] = cells[column] + inner + cells[column + 4]
        for row in range(GRID_CELLS):
            field = boards.fields[team, row + BORDER, BORDER:-BORDER]
            weights = boards.ring_weights[row + BORDER, BORDER:-BORDER]
            for column in range(GRID_CELLS):
                outer = wide[row, column] + wide[row + 1, column] + wide[row + 2, column]
                outer += wide[row + 3, column] + wide[row + 4, column]
                inner = narrow[row + 1, column] + narrow[row + 2, column] + narrow[row + 3, column]
                field[column] = weights[column] * (outer - inner)


@kernel
def field_maximum(field: Integers) -> int:
    """Return the largest value of one team's capture field."""
    flat = field.ravel()
    highest: int = flat[0]  # on the border, hence 0
    for place in range(flat.shape[0]):
        highest = flat[place] if flat[place] > highest else highest
    return highest


@kernel
def capture_limit(maximum: int, threshold: float) -> int:
    """Return the value above which a field with this maximum captures; an empty one never does.

    Whole numbers are exact in float64, and so is their product with a threshold of few bits.
    """
    return int(threshold * float(maximum))


@kernel
def find_peak(field: Integers) -> int:
    """Return the place, in the flattened field, of a largest value."""
    highest, flat = field_maximum(field), field.ravel()
    place = 0
    while flat[place] != highest:
        place += 1
    return place


@kernel
def find_captured(
    cells: Int16s, teams: Int8s, fields: Integers, threshold: float, peaks: Int64s, captured: Bools
) -> bool:
    """Mark the drones (N,) of one game that the opposing field captures, and return whether there are any.

    `peaks` (2,) are any places in the flattened fields; they are updated to those of the maxima once that matters.
    Since a field is nowhere higher than at its maximum, most tests fail already against where it was lately, and the
    field need not be searched.
    """
    if not any_captured(cells, teams, fields, threshold, peaks, captured):
        return False
    peaks[0], peaks[1] = find_peak(fields[0]), find_peak(fields[1])
    return any_captured(cells, teams, fields, threshold, peaks, captured)


@kernel
def any_captured(
    cells: Int16s, teams: Int8s, fields: Integers, threshold: float, peaks: Int64s, captured: Bools
) -> bool:
    """Test every drone as if the fields were highest at `peaks`."""
    red, blue = fields[0], fields[1]
    red_limit = capture_limit(red.ravel()[peaks[0]], threshold)
    blue_limit = capture_limit(blue.ravel()[peaks[1]], threshold)
    found = False
    for i in range(cells.shape[0]):
        cell = np.uint64(cells[i])
        row, column = cell // _CELLS + _BORDER, cell % _CELLS + _BORDER
        hit = red[row, column] > red_limit if teams[i] else blue[row, column] > blue_limit
        captured[i] = hit
        found |= hit
    return found
