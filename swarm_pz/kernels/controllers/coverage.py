"""The coverage controller: drones fly to the centroids of their Voronoi cells, while the density changes.

After Diaz-Mercado, Lee and Egerstedt, "Distributed dynamic density coverage for human-swarm interactions" (ACC 2015),
and Lee, Diaz-Mercado and Egerstedt, "Multirobot control using time-varying density functions" (IEEE Transactions on
Robotics, 2015); `docs/control_systems.md` has the equations.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarm_pz.config.system import Flight
from swarm_pz.kernels import entry_point, kernel
from swarm_pz.kernels.arrays import Float32s, Float64s, Int64s

_TIE = 1e-12
"""Squared distances that differ by less are equal: a grid point belongs to all drones at that distance."""
_NEAR = 1e-9
"""A grid point that is nearer to the end of a span, in cells, lies on it."""
_NOTHING = 1e-9
"""A cell with a smaller sum has no grid point: such sums are rounding."""
_PARALLEL = 1e-12
"""Two bisectors with a smaller slope to each other are parallel."""


class CoverageParameters(NamedTuple):
    """Numbers of the controller, ready for the kernel."""

    gain: float
    blend: float
    floor: float
    neighbours: bool
    speed: float
    response: float
    speed_factor: float


class Grid(NamedTuple):
    """Where densities are summed and integrated."""

    centres: Float64s
    """(G,) of the grid's cells, along an axis."""
    left: Int64s
    """(G,) the last column of the command whose centre is at or before each of them; at most A - 2."""
    share: Float64s
    """(G,) the fraction of the way from that column's centre to the next at which each lies."""
    nodes: Float64s
    """(Q,) of a quadrature along an edge, in [-1, 1]."""
    weights: Float64s
    """(Q,) their weights, which sum to 2."""


class Cells(NamedTuple):
    """The Voronoi cells among n drones that know of each other."""

    places: Float64s
    """(n, 2) where the drones are."""
    edges: Float64s
    """(n, n, 2) `[i, j]` for i < j: the ends of the edge between two drones on their bisector, from its middle."""
    neighbours: Int64s
    """(n, n) the drones with which each shares an edge, or its place."""
    degrees: Int64s
    """(n,) the number of these neighbours."""
    owners: Float64s
    """(n,) how many drones are where each is, itself included."""
    masses: Float64s
    """(n,)"""
    centroids: Float64s
    """(n, 2)"""
    first: Float64s
    """(n, 2) velocities of the law's first term."""


@kernel
def blend_densities(
    command: Float64s, former: Float64s, age: float, parameters: CoverageParameters, density: Float64s, rate: Float64s
) -> bool:
    """Write the density (A, A) in force, of mean 1, and its change per second; return whether it changes."""
    share = min(age / parameters.blend, 1.0)
    is_changing = share < 1.0
    mean, former_mean = command.mean(), former.mean()
    above = 1.0 - parameters.floor
    for row in range(command.shape[0]):
        for column in range(command.shape[1]):
            new = command[row, column] / mean if mean > 0.0 else 1.0
            old = former[row, column] / former_mean if former_mean > 0.0 else 1.0
            density[row, column] = above * (old + share * (new - old)) + parameters.floor
            rate[row, column] = above * (new - old) / parameters.blend if is_changing else 0.0
    return is_changing


@kernel
def interpolate(values: Float64s, x: float, y: float) -> float:
    """Return the bilinear interpolation of an image (A, A) at a place, constant beyond the outer cells' centres."""
    cells = values.shape[0]
    across = min(max(x * cells - 0.5, 0.0), cells - 1.0)
    up = min(max(y * cells - 0.5, 0.0), cells - 1.0)
    column, row = min(int(across), cells - 2), min(int(up), cells - 2)
    right, above = across - column, up - row
    low = values[row, column] + right * (values[row, column + 1] - values[row, column])
    high = values[row + 1, column] + right * (values[row + 1, column + 1] - values[row + 1, column])
    return float(low + above * (high - low))


@kernel
def add_up(values: Float64s, grid: Grid, sums: Float64s) -> None:
    """Write cumulative sums (2, G, G + 1) of an image (A, A) along the grid's rows: its mass, and its moment in x."""
    side, cells = grid.centres.shape[0], values.shape[0]
    line = np.empty(cells)
    for row in range(side):
        up = min(max(grid.centres[row] * cells - 0.5, 0.0), cells - 1.0)
        below = min(int(up), cells - 2)
        for column in range(cells):
            line[column] = values[below, column] + (up - below) * (values[below + 1, column] - values[below, column])
        mass, moment = 0.0, 0.0
        sums[:, row, 0] = 0.0
        for column in range(side):
            left = grid.left[column]
            here = line[left] + grid.share[column] * (line[left + 1] - line[left])
            mass += here
            moment += here * grid.centres[column]
            sums[0, row, column + 1] = mass
            sums[1, row, column + 1] = moment


@kernel
def find_span(a: int, heights: Float64s, slopes: Float64s, neighbours: Int64s) -> tuple[float, float, float]:
    """Return the ends, along x, of drone a's part of a row, and its share of that part.

    `heights` (n,) are the squared distances to the row's beginning; `slopes` (n, n) are 1 / (2 (x_b - x_a)), or 0 if
    x_a = x_b. x is nearer to a than to b where 2 x (x_b - x_a) < height_b - height_a.
    """
    low, high, owners = -1.0, 2.0, 1.0
    for b in neighbours:
        slope, more = slopes[a, b], heights[b] - heights[a]
        if slope > 0.0:
            high = min(high, more * slope)
        elif slope < 0.0:
            low = max(low, more * slope)
        elif more < -_TIE:
            return low, low - 1.0, 1.0
        elif more <= _TIE:
            owners += 1.0
    return low, high, 1.0 / owners


@kernel
def sum_span(low: float, high: float, sums: Float64s) -> float:
    """Return the sum of a row, with cumulative sums `sums` (G + 1,), over the points in [low, high].

    A point on an end counts half, since it belongs to both sides.
    """
    side = sums.shape[0] - 1
    from_left, to_right = low * side - 0.5, high * side - 0.5
    first, last = max(math.ceil(from_left - _NEAR), 0), min(math.floor(to_right + _NEAR), side - 1)
    if first > last:
        return 0.0
    total = sums[last + 1] - sums[first]
    if abs(from_left - first) <= _NEAR:
        total -= (sums[first + 1] - sums[first]) / 2.0
    if abs(to_right - last) <= _NEAR:
        total -= (sums[last + 1] - sums[last]) / 2.0
    return float(total)


@kernel
def cut(offset: float, slope: float, low: float, high: float) -> tuple[float, float]:
    """Cut the range [low, high] of s to where offset + s * slope <= 0."""
    if slope > _PARALLEL:
        return low, min(high, -offset / slope)
    if slope < -_PARALLEL:
        return max(low, -offset / slope), high
    if offset > _PARALLEL:
        return low, low
    return low, high


@kernel
def find_edge(i: int, j: int, places: Float64s) -> tuple[float, float]:
    """Return the part [low, high] of the bisector of drones i and j, from its middle, that their cells share."""
    apart_x, apart_y = places[j, 0] - places[i, 0], places[j, 1] - places[i, 1]
    distance = math.sqrt(apart_x * apart_x + apart_y * apart_y)
    along_x, along_y = -apart_y / distance, apart_x / distance
    middle_x, middle_y = (places[i, 0] + places[j, 0]) / 2.0, (places[i, 1] + places[j, 1]) / 2.0
    low, high = cut(-middle_x, -along_x, -2.0, 2.0)
    low, high = cut(middle_x - 1.0, along_x, low, high)
    low, high = cut(-middle_y, -along_y, low, high)
    low, high = cut(middle_y - 1.0, along_y, low, high)
    for k in range(places.shape[0]):
        if high <= low:
            break
        if k in (i, j):
            continue
        to_x, to_y = places[k, 0] - places[i, 0], places[k, 1] - places[i, 1]
        from_x, from_y = (places[i, 0] + places[k, 0]) / 2.0, (places[i, 1] + places[k, 1]) / 2.0
        offset = (middle_x - from_x) * to_x + (middle_y - from_y) * to_y
        low, high = cut(offset, along_x * to_x + along_y * to_y, low, high)
    return low, high


@kernel
def find_neighbours(places: Float64s, cells: Cells, slopes: Float64s) -> None:
    """Write the edges and neighbours of drones (n, 2), and their `slopes` (n, n) of `find_span`."""
    edges, neighbours, degrees = cells.edges, cells.neighbours, cells.degrees
    for i in range(places.shape[0]):
        for j in range(i + 1, places.shape[0]):
            apart_x, apart_y = places[j, 0] - places[i, 0], places[j, 1] - places[i, 1]
            low, high = 0.0, 0.0
            is_one_place = apart_x * apart_x + apart_y * apart_y <= _TIE
            if not is_one_place:
                low, high = find_edge(i, j, places)
            else:
                cells.owners[i] += 1.0
                cells.owners[j] += 1.0
            edges[i, j, 0], edges[i, j, 1] = low, high
            if is_one_place or high > low:
                neighbours[i, degrees[i]], neighbours[j, degrees[j]] = j, i
                degrees[i] += 1
                degrees[j] += 1
            if abs(apart_x) > _TIE:
                slopes[i, j], slopes[j, i] = 0.5 / apart_x, -0.5 / apart_x


@kernel
def find_cells(places: Float64s, sums: Float64s, rates: Float64s, is_changing: bool, grid: Grid, gain: float) -> Cells:
    """Return the cells of drones (n, 2) for a density and its change per second, given as the sums of `add_up`."""
    count, side = places.shape[0], grid.centres.shape[0]
    cells = Cells(
        places,
        np.zeros((count, count, 2)),
        np.zeros((count, count), np.int64),
        np.zeros(count, np.int64),
        np.ones(count),
        np.zeros(count),
        places.copy(),
        np.zeros((count, 2)),
    )
    heights, slopes = np.empty(count), np.zeros((count, count))
    totals = np.zeros((count, 6))
    find_neighbours(places, cells, slopes)
    for row in range(side):
        y = grid.centres[row]
        for a in range(count):
            heights[a] = places[a, 0] ** 2 + (y - places[a, 1]) ** 2
        for a in range(count):
            low, high, share = find_span(a, heights, slopes, cells.neighbours[a, : cells.degrees[a]])
            if high < low:
                continue
            mass = share * sum_span(low, high, sums[0, row])
            totals[a, 0] += mass
            totals[a, 1] += share * sum_span(low, high, sums[1, row])
            totals[a, 2] += mass * y
            if is_changing:
                change = share * sum_span(low, high, rates[0, row])
                totals[a, 3] += change
                totals[a, 4] += share * sum_span(low, high, rates[1, row])
                totals[a, 5] += change * y
    for a in range(count):
        mass = totals[a, 0]
        if mass <= _NOTHING:
            continue
        cells.masses[a] = mass / (side * side)
        for axis in range(2):
            centroid = totals[a, 1 + axis] / mass
            cells.centroids[a, axis] = centroid
            drift = (totals[a, 4 + axis] - centroid * totals[a, 3]) / mass
            cells.first[a, axis] = gain * (centroid - places[a, axis]) + drift
    return cells


@kernel
def follow_neighbours(i: int, cells: Cells, density: Float64s, grid: Grid) -> tuple[float, float]:
    """Return the velocity (x, y) of drone i's centroid when it and its neighbours fly at their first velocities."""
    places, first, closest = cells.places, cells.first, 1.0 / grid.centres.shape[0]
    velocity_x, velocity_y = 0.0, 0.0
    if cells.masses[i] == 0.0:
        return velocity_x, velocity_y
    for j in cells.neighbours[i, : cells.degrees[i]]:
        lower, upper = min(i, j), max(i, j)
        low, high = cells.edges[lower, upper]
        if high <= low:
            continue
        apart_x, apart_y = places[upper, 0] - places[lower, 0], places[upper, 1] - places[lower, 1]
        distance = math.sqrt(apart_x * apart_x + apart_y * apart_y)
        middle_x, middle_y = (places[i, 0] + places[j, 0]) / 2.0, (places[i, 1] + places[j, 1]) / 2.0
        owners = cells.owners[i] * cells.owners[j]
        scale = (high - low) / 2.0 / (cells.masses[i] * owners * max(distance, closest))
        for node in range(grid.nodes.shape[0]):
            along = ((low + high) / 2.0 + grid.nodes[node] * (high - low) / 2.0) / distance
            x, y = middle_x - along * apart_y, middle_y + along * apart_x
            outward = (places[j, 0] - x) * first[j, 0] + (places[j, 1] - y) * first[j, 1]
            outward += (x - places[i, 0]) * first[i, 0] + (y - places[i, 1]) * first[i, 1]
            share = grid.weights[node] * scale * interpolate(density, x, y) * outward
            velocity_x += share * (x - cells.centroids[i, 0])
            velocity_y += share * (y - cells.centroids[i, 1])
    return velocity_x, velocity_y


@kernel
def steer(
    i: int, cells: Cells, velocity: Float32s, density: Float64s, grid: Grid, parameters: CoverageParameters, u: Float64s
) -> None:
    """Write into `u` the acceleration that brings the i-th of some drones to the velocity that the law asks for."""
    wanted_x, wanted_y = cells.first[i, 0], cells.first[i, 1]
    if parameters.neighbours:
        more_x, more_y = follow_neighbours(i, cells, density, grid)
        wanted_x += more_x
        wanted_y += more_y
    fast = math.sqrt(wanted_x * wanted_x + wanted_y * wanted_y)
    scale = min(1.0, parameters.speed / max(fast, parameters.speed)) / parameters.speed_factor
    u[0] = (wanted_x * scale - velocity[0]) / parameters.response
    u[1] = (wanted_y * scale - velocity[1]) / parameters.response


@entry_point
def cover(flight: Flight, grid: Grid, parameters: CoverageParameters, accelerations: Float64s) -> None:
    """Steer every own drone of n games towards the centroid of its cell among the drones that it hears.

    Accelerations (n, N, 2) are written for own drones.
    """
    positions, velocities, own, heard, commands, former, age = flight
    side, image = grid.centres.shape[0], commands.shape[1]
    density, rate = np.empty((image, image)), np.empty((image, image))
    sums, rates = np.empty((2, side, side + 1)), np.empty((2, side, side + 1))
    for e in range(positions.shape[0]):
        is_changing = blend_densities(commands[e], former[e], age[e], parameters, density, rate)
        add_up(density, grid, sums)
        if is_changing:
            add_up(rate, grid, rates)
        places = positions[e].astype(np.float64)
        team = np.flatnonzero(own[e])
        is_whole = True
        for i in team:
            for j in team:
                is_whole &= heard[e, i, j]
        if is_whole:
            cells = find_cells(places[team], sums, rates, is_changing, grid, parameters.gain)
            for place in range(len(team)):
                i = team[place]
                steer(place, cells, velocities[e, i], density, grid, parameters, accelerations[e, i])
            continue
        for i in team:
            crew = np.flatnonzero(heard[e, i])
            cells = find_cells(places[crew], sums, rates, is_changing, grid, parameters.gain)
            place = int(np.searchsorted(crew, i))
            steer(place, cells, velocities[e, i], density, grid, parameters, accelerations[e, i])
