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
        for age in range(length - 1, -1, -1):
            cell = trails[i, (tick - 1 - age) % length]
            if tick - 1 - age >= 0 and cell >= 0:
                row, column = coarse_cell(cell, cells, plane.shape[0])
                brightness = (255 * (length - age) + length // 2) // length
                plane[row, column] = max(int(plane[row, column]), brightness)


@kernel
def paint_capture_field(ring_sums: NDArray[np.int32], threshold: float, plane: NDArray[np.uint8]) -> None:
    """Paint 255 * value / maximum, kept on the side of 192 that says whether the cell captures."""
    cells = ring_sums.shape[0]
    block = cells // plane.shape[0]
    maximum = field_maximum(ring_sums)
    if maximum[0] == 0:
        return
    scale = 255.0 * maximum[1] / maximum[0]
    for row in range(cells):
        for column in range(cells):
            ring_sum = np.int64(ring_sums[row, column])
            if ring_sum > 0:
                count = ring_count(row, column, cells)
                brightness = min(int(scale * ring_sum / count), 255)
                if exceeds(ring_sum, count, maximum, threshold):
                    brightness = max(brightness, CAPTURES_FROM)
                else:
                    brightness = min(brightness, CAPTURES_FROM - 1)
                coarse_row, coarse_column = row // block, column // block
                if brightness > plane[coarse_row, coarse_column]:
                    plane[coarse_row, coarse_column] = brightness


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
            paint_capture_field(games.ring_sums[e, team], threshold, planes[4 + side])
        paint_target(games.targets[e, own], interpolation, planes[6])
        planes[7] = np.uint8(255.0 * size / games.teams.shape[1] + 0.5)
        planes[8] = np.uint8(255.0 * time_left[place] + 0.5)
