"""Images and lists of drones for one side of one game; `swarm_pz.spaces.observation` describes them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from swarm_pz.config import CHANNELS, GRID_CELLS, MOTION_CHANNELS, SOON, TICKS_PER_SECOND
from swarm_pz.kernels import entry_point, exact, exact_part, kernel
from swarm_pz.kernels.arrays import Float32s, Float64s, Int8s, Int16s, Int64s, Integers, Uint8s, Uint16s
from swarm_pz.kernels.capture import capture_limit, fill_field, make_field_scratch
from swarm_pz.kernels.controllers.ergodic import list_members
from swarm_pz.kernels.fourier import largest
from swarm_pz.kernels.trails import cell_of

OWN_TRAIL_AGE, OWN_CAPTURE_FIELD, OWN_TARGET, OWN_SHARE = (
    CHANNELS.index(channel) for channel in ("own_trail_age", "own_capture_field", "own_target", "own_share")
)
OWN_NOW, OWN_SOON = (len(CHANNELS) + MOTION_CHANNELS.index(channel) for channel in ("own_now", "own_soon"))
POSITION_STEP = 64
"""Brightness that each drone adds to its cell."""
CAPTURES_FROM = 192
"""A cell of the capture field is at least this bright exactly where it captures."""


class Shown(NamedTuple):
    """Arrays of `Games` that are painted; with fewer arrays a call is quicker, and compiles faster."""

    ticks: Int64s
    positions: Float32s
    velocities: Float32s
    teams: Int8s
    trails: Int16s
    occupancy: Integers
    reconstruction: Float32s
    targets: Float64s


class ViewParameters(NamedTuple):
    """Numbers of an observation's images, ready for the kernel."""

    threshold: float
    """Threshold of the capture."""
    coarse_cells: Uint16s
    """(G * G,) the cell of the observation's grid that holds each cell of the full one; unsigned, because signed
    indices cost a test for negative values."""
    brightness: Uint8s
    """(length,) of a trail, by its age in ticks."""
    interpolation: Float64s
    """(A, W) weights from a command's cells to the grid's, padded with zeros to whole vectors."""
    channels: Int64s
    """(channels,) numbers of `swarm_pz.config.CHANNELS`, then of `MOTION_CHANNELS`."""


@kernel
def paint_positions(positions: Float32s, members: Int64s, coarse_cells: Uint16s, plane: Uint8s) -> None:
    """Add 64 for each member to its cell of a black plane (grid * grid), up to 255."""
    for i in members:
        cell = coarse_cells[cell_of(positions[i, 0], positions[i, 1])]
        plane[cell] = min(int(plane[cell]) + POSITION_STEP, 255)


@kernel
def paint_shared(positions: Float32s, velocities: Float32s, members: Int64s, seconds: float, plane: Uint8s) -> None:
    """Share out 64 for each member among the four cells nearest to its predicted position, up to 255."""
    grid = plane.shape[0]
    nearest, shares = np.empty((2, 2), np.int64), np.empty((2, 2), np.float64)
    for i in members:
        for axis in range(2):
            there = np.float64(positions[i, axis]) + seconds * np.float64(velocities[i, axis])
            at = min(max(there, 0.0), 1.0) * grid - 0.5
            low = int(np.floor(at))
            nearest[axis, 0], nearest[axis, 1] = max(low, 0), min(low + 1, grid - 1)
            shares[axis, 1] = at - low
            shares[axis, 0] = 1.0 - shares[axis, 1]
        for row in range(2):
            for column in range(2):
                y, x = nearest[1, row], nearest[0, column]
                share = int(POSITION_STEP * shares[1, row] * shares[0, column] + 0.5)
                plane[y, x] = min(int(plane[y, x]) + share, 255)


@kernel
def paint_trail_age(
    trails: Int16s, members: Int64s, tick: int, coarse_cells: Uint16s, brightness: Uint8s, plane: Uint8s
) -> None:
    """Paint when members were last in each cell of a black plane (grid * grid)."""
    length = trails.shape[0]
    for age in range(min(length, tick) - 1, -1, -1):  # the newer over the older
        cells, shade = trails[(tick - 1 - age) % length], brightness[age]
        for i in members:
            if cells[np.uint64(i)] >= 0:
                plane[coarse_cells[np.uint16(cells[np.uint64(i)])]] = shade


@kernel
def paint_capture_field(board: Integers, ring_weights: Integers, threshold: float, grid: int, plane: Uint8s) -> None:
    """Paint 255 * value / maximum of a team's field, and at least 192 exactly where a cell captures.

    The plane (grid * grid) must be black before.
    """
    scratch = make_field_scratch(board, ring_weights)
    maximum = scratch.field[fill_field(board, ring_weights, scratch)]
    if maximum == 0:
        return
    field, highest = scratch.field, scratch.largest
    block = GRID_CELLS // grid
    for coarse_row in range(grid if block > 1 else 0):
        for column in range(GRID_CELLS):
            highest[column] = field[coarse_row * block * GRID_CELLS + column]
        for row in range(coarse_row * block + 1, (coarse_row + 1) * block):
            others = field[row * GRID_CELLS :]
            for column in range(GRID_CELLS):
                highest[column] = max(highest[column], others[column])
        for coarse_column in range(grid):
            value = highest[coarse_column * block]
            for column in range(coarse_column * block + 1, (coarse_column + 1) * block):
                value = max(value, highest[column])
            field[coarse_row * grid + coarse_column] = value  # over rows that were read
    limit = capture_limit(maximum, threshold)
    for cell in range(len(plane)):
        shade: Any = np.int32(255.0 * np.float64(field[cell]) / np.float64(maximum) + 0.5)
        plane[cell] = np.uint8(max(shade, CAPTURES_FROM) if field[cell] > limit else min(shade, CAPTURES_FROM - 1))


@kernel
def paint_density_field(field: Float32s, threshold: float, plane: Uint8s) -> None:
    """Paint 255 * value of a field (G, G) in [0, 1], and at least 192 exactly where a cell captures."""
    grid = plane.shape[0]
    block = GRID_CELLS // grid
    for row in range(grid):
        for column in range(grid):
            first_row, first_column = row * block, column * block
            value = largest(field[first_row : first_row + block, first_column : first_column + block])
            brightness = np.int32(255.0 * np.float64(value) + 0.5)
            captures = value >= np.float32(threshold)
            line = plane[row]
            line[column] = max(brightness, CAPTURES_FROM) if captures else min(brightness, CAPTURES_FROM - 1)


@kernel
def paint_target(target: Float64s, interpolation: Float64s, plane: Uint8s) -> None:
    """Paint the target's density divided by its largest cell; `interpolation` (A, W) serves both axes."""
    (cells, width), grid = interpolation.shape, plane.shape[0]
    most = largest(target)
    along_x, densities = np.zeros((cells, width), np.float64), np.empty(width, np.float64)
    for a in range(cells):
        for b in range(cells):
            for column in range(width):
                along_x[a, column] += target[a, b] * interpolation[b, column]
    for row in range(grid):
        densities[:] = 0.0
        for a in range(cells):
            if interpolation[a, row] == 0.0:  # most are: few cells are near
                continue
            for column in range(width):
                densities[column] += interpolation[a, row] * along_x[a, column]
        line = plane[row]
        for column in range(grid):
            line[column] = min(np.int32(255.0 * densities[column] / most + 0.5), np.int32(255))


@kernel
def place_of_twin(channels: Int64s, number: int) -> int:
    """Return the place of the channel that shows the same of the other team, -1 if there is none."""
    channel = channels[number]
    if OWN_TARGET <= channel < OWN_NOW:
        return -1
    twin = channel ^ 1 if channel < OWN_TARGET else OWN_NOW + ((channel - OWN_NOW) ^ 1)
    for place in range(len(channels)):
        if channels[place] == twin:
            return place
    return -1


@exact_part
def time_left(tick: int, limit: int) -> float:
    """Return the fraction of the time that is left."""
    return 1.0 - min(tick / limit, 1.0)


@entry_point
def paint_grids(
    games: Shown,
    rows: Int64s,
    places: Int64s,
    sides: Int64s,
    limit: int,
    view: ViewParameters,
    ring_weights: Integers,
    observations: Uint8s,
) -> None:
    """Paint some places of `observations` (n, channels, grid, grid): games `rows` (n,), seen from `sides` (n,).

    If both sides of a game follow one another, the second copies from the first what shows the same. `limit` is the
    time limit in ticks.
    """
    members = np.empty((2, games.teams.shape[1] + 1), np.int64)
    threshold, coarse_cells, channels = view.threshold, view.coarse_cells, view.channels
    before = -1
    for place in places:
        e, own = rows[place], sides[place]
        has_twins = before >= 0 and rows[before] == e and sides[before] != own
        tick, trails = games.ticks[e], games.trails[e]
        sizes = list_members(games.teams[e], members)
        observations[place] = np.uint8(0)
        for number in range(len(channels)):
            channel, plane = channels[number], observations[place, number]
            shades = plane.ravel()
            twin = place_of_twin(channels, number) if has_twins else -1
            if twin >= 0:
                painted = observations[before, twin].ravel()
                for cell in range(len(shades)):
                    shades[cell] = painted[cell]
                continue
            is_own = channel % 2 == 0 if channel < OWN_NOW else (channel - OWN_NOW) % 2 == 0  # they come in pairs
            team = own if is_own else 1 - own
            drones = members[team, : sizes[team]]
            if channel < OWN_TRAIL_AGE:
                paint_positions(games.positions[e], drones, coarse_cells, shades)
            elif channel < OWN_CAPTURE_FIELD:
                paint_trail_age(trails, drones, tick, coarse_cells, view.brightness, shades)
            elif channel < OWN_TARGET and games.reconstruction.shape[2]:
                paint_density_field(games.reconstruction[e, team], threshold, plane)
            elif channel < OWN_TARGET:
                paint_capture_field(games.occupancy[e, team].ravel(), ring_weights, threshold, len(plane), shades)
            elif channel == OWN_TARGET:
                paint_target(games.targets[e, own], view.interpolation, plane)
            elif channel == OWN_SHARE:
                plane[:] = np.uint8(255.0 * sizes[own] / (sizes[0] + sizes[1]) + 0.5)
            elif channel >= OWN_NOW:
                seconds = SOON if channel >= OWN_SOON else 0.0
                paint_shared(games.positions[e], games.velocities[e], drones, seconds, plane)
            else:
                plane[:] = np.uint8(255.0 * time_left(tick, limit) + 0.5)
        before = place


@exact
def list_entities(
    games: Shown,
    rows: Int64s,
    sides: Int64s,
    limit: int,
    fastest: np.float32,
    places: Float32s,
    speeds: Float32s,
    masks: Int8s,
    shares: Float32s,
    times: Float32s,
) -> None:
    """List the drones of the games `rows` (n,), each seen from one of `sides` (n,), in the order of their numbers.

    `places` and `speeds` (2, n, N, 2) and `masks` (2, n, N) must be zeros: written for own drones, then opposing ones;
    velocities are cut to `fastest` along each axis. `shares` and `times` (n, 1) are overwritten with the side's share
    of all drones and the fraction of the time `limit`, in ticks, that is left.
    """
    for place in range(len(rows)):
        e, count = rows[place], np.zeros(2, np.int64)
        for drone in range(games.teams.shape[1]):
            side = 0 if games.teams[e, drone] == sides[place] else 1
            number = count[side]
            for axis in range(2):
                places[side, place, number, axis] = games.positions[e, drone, axis]
                speeds[side, place, number, axis] = min(max(games.velocities[e, drone, axis], -fastest), fastest)
            masks[side, place, number] = 1
            count[side] += 1
        shares[place, 0], times[place, 0] = count[0] / games.teams.shape[1], time_left(games.ticks[e], limit)


@exact
def count_infos(
    ticks: Int64s,
    teams: Int8s,
    captured: Int64s,
    recaptured: Int64s,
    rows: Int64s,
    sides: Int64s,
    can_win: bool,
    counts: Int64s,
    times: Float64s,
) -> None:
    """Count the infos of the games `rows` (n,), each seen from one of `sides` (n,).

    `captured` and `recaptured` (E, 2) are of a step. `counts` (5, n) are overwritten with the size, drones captured,
    lost and recaptured, and the outcome, of `BatchEnv.infos`; `times` (n,) with the seconds since the start.
    """
    drones = teams.shape[1]
    for place in range(len(rows)):
        e, side, size = rows[place], sides[place], 0
        for drone in range(drones):
            size += teams[e, drone] == side
        counts[0, place], counts[1, place], counts[2, place] = size, captured[e, side], captured[e, 1 - side]
        counts[3, place] = recaptured[e, side]
        counts[4, place] = int(size == drones) - int(size == 0) if can_win else 0
        times[place] = ticks[e] / TICKS_PER_SECOND
