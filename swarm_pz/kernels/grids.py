"""The grid observation of one seat of one game; see `swarm_pz.observation` for what it shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_pz.kernels import entry_point, kernel
from swarm_pz.kernels.capture import exceeds, field_maximum, ring_count
from swarm_pz.kernels.game import Games
from swarm_pz.kernels.trails import cell_of

POSITION_STEP = 64
"""Brightness that each drone adds to its cell."""
CAPTURES_FROM = 192
"""A cell of the capture field is at least this bright exactly where it captures."""


@kernel
def coarse_cell(cell: int, cells: int, grid: int) -> tuple[int, int]:
    """Row and column, on a grid of `grid` cells a side, of a cell of the full grid."""
    block = cells // grid
    return cell // cells // block, cell % cells // block


@kernel
def paint_positions(
    positions: NDArray[np.float32], teams: NDArray[np.int8], team: int, cells: int, plane: NDArray[np.uint8]
) -> None:
    """Add 64 for each drone of the team to its cell of a (grid, grid) plane, up to 255."""
    for i in range(teams.shape[0]):
        if teams[i] == team:
            row, column = coarse_cell(cell_of(positions[i, 0], positions[i, 1], cells), cells, plane.shape[0])
            plane[row, column] = min(int(plane[row, column]) + POSITION_STEP, 255)


@kernel
def paint_trail_age(
    trails: NDArray[np.int16], teams: NDArray[np.int8], tick: int, team: int, cells: int, plane: NDArray[np.uint8]
) -> None:
    """Paint when the team's trails were last in each cell: 255 for now, falling to 0 with age."""
    length = trails.shape[1]
    for i in range(teams.shape[0]):
        if teams[i] != team:
            continue
        newer = -1  # a drone stays in a cell for some ticks, of which the newest counts
        slot = (tick - 1) % length
        for age in range(min(length, tick)):
            cell = trails[i, slot]
            slot = slot - 1 if slot > 0 else length - 1
            if cell != newer:
                newer = cell
                row, column = coarse_cell(cell, cells, plane.shape[0])
                brightness = (255 * (length - age) + length // 2) // length
                plane[row, column] = max(int(plane[row, column]), brightness)


@kernel
def paint_capture_field(
    ring_sums: NDArray[np.int32], inverse_counts: NDArray[np.float64], threshold: float, plane: NDArray[np.uint8]
) -> None:
    """Paint 255 * value / maximum, kept on the side of 192 that says whether the cell captures."""
    cells, grid = ring_sums.shape[0], plane.shape[0]
    block = cells // grid
    maximum = field_maximum(ring_sums)
    if maximum[0] == 0:
        return
    scale = 255.0 * maximum[1] / maximum[0]
    for coarse_row in range(grid):
        for coarse_column in range(grid):
            highest, best_row, best_column = 0.0, 0, 0
            for row in range(coarse_row * block, (coarse_row + 1) * block):
                for column in range(coarse_column * block, (coarse_column + 1) * block):
                    value = ring_sums[row, column] * inverse_counts[row, column]
                    if value > highest:
                        highest, best_row, best_column = value, row, column
            if highest > 0.0:
                brightness = min(int(scale * highest + 0.5), 255)
                # The float tells which cell is highest; whether it captures is told exactly.
                ring_sum, count = int(ring_sums[best_row, best_column]), ring_count(best_row, best_column, cells)
                captures = exceeds(ring_sum, count, maximum, threshold)
                plane[coarse_row, coarse_column] = (
                    max(brightness, CAPTURES_FROM) if captures else min(brightness, CAPTURES_FROM - 1)
                )


@kernel
def paint_target(target: NDArray[np.float64], interpolation: NDArray[np.float64], plane: NDArray[np.uint8]) -> None:
    """Paint the target's density over its largest cell; `interpolation` (grid, A) serves both axes."""
    grid, cells = interpolation.shape
    largest = target.max()
    along_x = np.zeros((cells, grid), np.float64)
    for a in range(cells):
        for column in range(grid):
            for b in range(cells):
                along_x[a, column] += target[a, b] * interpolation[column, b]
    for row in range(grid):
        for column in range(grid):
            density = 0.0
            for a in range(cells):
                density += interpolation[row, a] * along_x[a, column]
            plane[row, column] = min(int(255.0 * density / largest + 0.5), 255)


@entry_point
def paint_grids(
    games: Games,
    rows: NDArray[np.int64],
    places: NDArray[np.int64],
    seats: NDArray[np.int64],
    time_left: NDArray[np.float64],
    threshold: float,
    inverse_counts: NDArray[np.float64],
    interpolation: NDArray[np.float64],
    observations: NDArray[np.uint8],
) -> None:
    """Paint the observations of the games `rows[place]` for every given place.

    Parameters
    ----------
    games : Games
    rows : int64 array (n,)
        Game of each place.
    places : int64 array (parts,)
        Places to paint.
    seats : int64 array (n,)
        Team from whose side each place is seen.
    time_left : float64 array (n,)
        Fraction of the time that is left.
    threshold : float
        Of the capture.
    inverse_counts : float64 array (cells, cells)
        One over the number of cells of each cell's ring that lie inside the square.
    interpolation : float64 array (grid, A)
        From a command's cells to the grid's.
    observations : uint8 array (n, channels, grid, grid)
        Overwritten; channels in the order of `swarm_pz.observation.CHANNELS`.
    """
    cells = games.occupancy.shape[2]
    for place in places:
        e, own = rows[place], seats[place]
        planes = observations[place]
        planes[:] = np.uint8(0)
        size = 0
        for i in range(games.teams.shape[1]):
            size += games.teams[e, i] == own
        for side in range(2):
            team = own if side == 0 else 1 - own
            paint_positions(games.positions[e], games.teams[e], team, cells, planes[0 + side])
            paint_trail_age(games.trails[e], games.teams[e], games.ticks[e], team, cells, planes[2 + side])
            paint_capture_field(games.ring_sums[e, team], inverse_counts, threshold, planes[4 + side])
        paint_target(games.targets[e, own], interpolation, planes[6])
        planes[7] = np.uint8(255.0 * size / games.teams.shape[1] + 0.5)
        planes[8] = np.uint8(255.0 * time_left[place] + 0.5)
