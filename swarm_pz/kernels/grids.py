"""The grid observation of one seat of one game; see `swarm_pz.observation` for what it shows."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GRID_CELLS
from swarm_pz.kernels import entry_point, kernel
from swarm_pz.kernels.capture import BORDER, capture_limit, field_maximum
from swarm_pz.kernels.game import Games
from swarm_pz.kernels.trails import cell_of

POSITION_STEP = 64
"""Brightness that each drone adds to its cell."""
CAPTURES_FROM = 192
"""A cell of the capture field is at least this bright exactly where it captures."""


@kernel
def paint_positions(
    positions: NDArray[np.float32],
    teams: NDArray[np.int8],
    own: int,
    coarse_cells: NDArray[np.int64],
    planes: NDArray[np.uint8],
) -> None:
    """Add 64 for each drone to its cell of its side's plane, up to 255; planes (2, grid * grid)."""
    for i in range(teams.shape[0]):
        side = 0 if teams[i] == own else 1
        cell = coarse_cells[cell_of(positions[i, 0], positions[i, 1])]
        planes[side, cell] = min(int(planes[side, cell]) + POSITION_STEP, 255)


@kernel
def paint_trail_age(
    trails: NDArray[np.int16],
    teams: NDArray[np.int8],
    tick: int,
    own: int,
    coarse_cells: NDArray[np.int64],
    brightness: NDArray[np.uint8],
    planes: NDArray[np.uint8],
) -> None:
    """Paint when each side's trails were last in each cell; planes (2, grid * grid), black so far."""
    length = trails.shape[0]
    for age in range(min(length, tick) - 1, -1, -1):  # the newer over the older
        slot = (tick - 1 - age) % length
        for i in range(teams.shape[0]):
            side = 0 if teams[i] == own else 1
            planes[side, coarse_cells[trails[slot, i]]] = brightness[age]


@kernel
def paint_capture_field(field: NDArray[np.integer], threshold: float, plane: NDArray[np.uint8]) -> None:
    """Paint 255 * value / maximum, kept on the side of 192 that says whether the cell captures."""
    grid = plane.shape[0]
    block = GRID_CELLS // grid
    maximum = field_maximum(field)
    limit = capture_limit(maximum, threshold)
    if maximum == 0:
        return
    highest = np.empty(GRID_CELLS, field.dtype)  # of each column of the full grid, within a row of the plane
    for coarse_row in range(grid):
        first = BORDER + coarse_row * block
        for column in range(GRID_CELLS):
            highest[column] = field[first, BORDER + column]
        for row in range(first + 1, first + block):
            for column in range(GRID_CELLS):
                highest[column] = max(highest[column], field[row, BORDER + column])
        for coarse_column in range(grid):
            value = highest[coarse_column * block]
            for column in range(coarse_column * block + 1, (coarse_column + 1) * block):
                value = max(value, highest[column])
            brightness = int(255.0 * float(value) / float(maximum) + 0.5)
            captures = value > limit
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
    coarse_cells: NDArray[np.int64],
    brightness: NDArray[np.uint8],
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
    coarse_cells : int64 array (G * G,)
        Which cell of the observation's grid holds each cell of the full one.
    brightness : uint8 array (length,)
        Of a trail, by its age in ticks.
    interpolation : float64 array (grid, A)
        From a command's cells to the grid's.
    observations : uint8 array (n, channels, grid, grid)
        Overwritten; channels in the order of `swarm_pz.observation.CHANNELS`.
    """
    for place in places:
        e, own = rows[place], seats[place]
        positions, teams = games.positions[e], games.teams[e]
        planes = observations[place]
        planes[:] = np.uint8(0)
        size = 0
        for i in range(teams.shape[0]):
            size += teams[i] == own
        flat = planes.reshape(planes.shape[0], -1)
        paint_positions(positions, teams, own, coarse_cells, flat[0:2])
        paint_trail_age(games.trails[e], teams, games.ticks[e], own, coarse_cells, brightness, flat[2:4])
        paint_capture_field(games.fields[e, own], threshold, planes[4])
        paint_capture_field(games.fields[e, 1 - own], threshold, planes[5])
        paint_target(games.targets[e, own], interpolation, planes[6])
        planes[7] = np.uint8(255.0 * size / teams.shape[0] + 0.5)
        planes[8] = np.uint8(255.0 * time_left[place] + 0.5)
