"""The coverage controller: drones fly to the centroids of their Voronoi cells, while the density changes.

After Diaz-Mercado, Lee and Egerstedt, "Distributed dynamic density coverage for human-swarm interactions" (ACC 2015),
and Lee, Diaz-Mercado and Egerstedt, "Multirobot control using time-varying density functions" (IEEE Transactions on
Robotics, 2015); `docs/systems/coverage.md` has the equations.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.kernels import entry_point, kernel, reduction

_TIE = 1e-12
"""Squared distances that differ by less are equal: a grid point belongs to all that are so near."""
_PARALLEL = 1e-12
"""Two bisectors that turn by less do not cut each other."""


class CoverageParameters(NamedTuple):
    """Numbers of the controller, ready for the kernel."""

    gain: float
    blend: float
    floor: float
    terms: int
    speed: float
    response: float
    speed_factor: float


class Grid(NamedTuple):
    """Where densities are summed and integrated."""

    centres: NDArray[np.float64]
    """(G,) of the grid's cells, along an axis."""
    nodes: NDArray[np.float64]
    """(Q,) of a quadrature along an edge, in [-1, 1]."""
    weights: NDArray[np.float64]
    """(Q,) their weights, which sum to 2."""


class Cells(NamedTuple):
    """The Voronoi cells among n drones that know of each other."""

    places: NDArray[np.float64]
    """(n, 2) where the drones are."""
    masses: NDArray[np.float64]
    """(n,)"""
    centroids: NDArray[np.float64]
    """(n, 2)"""
    first: NDArray[np.float64]
    """(n, 2) velocities of the law's first term."""


@kernel
def blend_densities(
    command: NDArray[np.float64],
    former: NDArray[np.float64],
    age: float,
    parameters: CoverageParameters,
    density: NDArray[np.float64],
    rate: NDArray[np.float64],
) -> None:
    """Write the density (A, A) in force, of mean 1, and its change per second."""
    share = min(age / parameters.blend, 1.0)
    mean, former_mean = command.mean(), former.mean()
    above = 1.0 - parameters.floor
    for row in range(command.shape[0]):
        for column in range(command.shape[1]):
            new = command[row, column] / mean if mean > 0.0 else 1.0
            old = former[row, column] / former_mean if former_mean > 0.0 else 1.0
            density[row, column] = above * (old + share * (new - old)) + parameters.floor
            rate[row, column] = above * (new - old) / parameters.blend if share < 1.0 else 0.0


@kernel
def interpolate(values: NDArray[np.float64], x: float, y: float) -> float:
    """Return the bilinear interpolation of an image (A, A) at a place, constant beyond the outer cells' centres."""
    cells = values.shape[0]
    across = min(max(x * cells - 0.5, 0.0), cells - 1.0)
    up = min(max(y * cells - 0.5, 0.0), cells - 1.0)
    column, row = min(int(across), cells - 2), min(int(up), cells - 2)
    right, above = across - column, up - row
    low = values[row, column] + right * (values[row, column + 1] - values[row, column])
    high = values[row + 1, column] + right * (values[row + 1, column + 1] - values[row + 1, column])
    return low + above * (high - low)


@kernel
def spread(values: NDArray[np.float64], grid: Grid, fine: NDArray[np.float64]) -> None:
    """Write an image (A, A) at the centres of the grid (G, G)."""
    for row in range(fine.shape[0]):
        for column in range(fine.shape[1]):
            fine[row, column] = interpolate(values, grid.centres[column], grid.centres[row])


@kernel
def divide_row(
    places: NDArray[np.float64],
    y: float,
    centres: NDArray[np.float64],
    squared: NDArray[np.float64],
    nearest: NDArray[np.float64],
    parts: NDArray[np.float64],
) -> None:
    """Write the squared distances (n, G) of a row's points, the least (G,), and 1 over how many are so near (G,)."""
    nearest[:] = np.inf
    parts[:] = 0.0
    for a in range(places.shape[0]):
        x, up = places[a, 0], (y - places[a, 1]) ** 2
        for column in range(centres.shape[0]):
            away = (centres[column] - x) ** 2 + up
            squared[a, column] = away
            nearest[column] = min(nearest[column], away)
    for a in range(places.shape[0]):
        for column in range(centres.shape[0]):
            parts[column] += 1.0 if squared[a, column] <= nearest[column] + _TIE else 0.0
    for column in range(centres.shape[0]):
        parts[column] = 1.0 / parts[column]


@reduction
def sum_row(
    squared: NDArray[np.float64],
    nearest: NDArray[np.float64],
    parts: NDArray[np.float64],
    centres: NDArray[np.float64],
    density: NDArray[np.float64],
    rate: NDArray[np.float64],
) -> tuple[float, float, float, float]:
    """Return a row's mass and moment in x that are one drone's, and their change per second."""
    mass, moment, mass_rate, moment_rate = 0.0, 0.0, 0.0, 0.0
    for column in range(centres.shape[0]):
        part = parts[column] if squared[column] <= nearest[column] + _TIE else 0.0
        here, change = part * density[column], part * rate[column]
        mass += here
        moment += here * centres[column]
        mass_rate += change
        moment_rate += change * centres[column]
    return mass, moment, mass_rate, moment_rate


@kernel
def find_cells(
    places: NDArray[np.float64],
    density: NDArray[np.float64],
    rate: NDArray[np.float64],
    grid: Grid,
    parameters: CoverageParameters,
) -> Cells:
    """Return the cells of drones (n, 2) in a density (G, G) that changes at a rate (G, G) per second."""
    count, side = places.shape[0], grid.centres.shape[0]
    masses, centroids, first = np.zeros(count), places.copy(), np.zeros((count, 2))
    mass_rates, moments, moment_rates = np.zeros(count), np.zeros((count, 2)), np.zeros((count, 2))
    squared, nearest, parts = np.empty((count, side)), np.empty(side), np.empty(side)
    for row in range(side):
        y = grid.centres[row]
        divide_row(places, y, grid.centres, squared, nearest, parts)
        for a in range(count):
            mass, moment, mass_rate, moment_rate = sum_row(
                squared[a], nearest, parts, grid.centres, density[row], rate[row]
            )
            masses[a] += mass
            mass_rates[a] += mass_rate
            moments[a, 0] += moment
            moments[a, 1] += mass * y
            moment_rates[a, 0] += moment_rate
            moment_rates[a, 1] += mass_rate * y
    for a in range(count):
        if masses[a] <= 0.0:
            continue
        for axis in range(2):
            centroids[a, axis] = moments[a, axis] / masses[a]
            change = (moment_rates[a, axis] - centroids[a, axis] * mass_rates[a]) / masses[a]
            first[a, axis] = parameters.gain * (centroids[a, axis] - places[a, axis]) + change
        masses[a] /= side * side
    return Cells(places, masses, centroids, first)


@kernel
def cut(offset: float, slope: float, low: float, high: float) -> tuple[float, float]:
    """Return what is left of the range [low, high] of s where offset + s * slope <= 0."""
    if slope > _PARALLEL:
        return low, min(high, -offset / slope)
    if slope < -_PARALLEL:
        return max(low, -offset / slope), high
    if offset > _PARALLEL:
        return low, low
    return low, high


@kernel
def find_edge(i: int, j: int, places: NDArray[np.float64]) -> tuple[float, float]:
    """Return the part [low, high] of the bisector of drones i and j, from its middle, that is the edge of their cells."""
    apart_x, apart_y = places[j, 0] - places[i, 0], places[j, 1] - places[i, 1]
    distance = math.sqrt(apart_x * apart_x + apart_y * apart_y)
    along_x, along_y = -apart_y / distance, apart_x / distance
    middle_x, middle_y = (places[i, 0] + places[j, 0]) / 2.0, (places[i, 1] + places[j, 1]) / 2.0
    low, high = cut(-middle_x, -along_x, -2.0, 2.0)
    low, high = cut(middle_x - 1.0, along_x, low, high)
    low, high = cut(-middle_y, -along_y, low, high)
    low, high = cut(middle_y - 1.0, along_y, low, high)
    for k in range(places.shape[0]):
        if k in (i, j) or high <= low:
            continue
        to_x, to_y = places[k, 0] - places[i, 0], places[k, 1] - places[i, 1]
        from_x, from_y = (places[i, 0] + places[k, 0]) / 2.0, (places[i, 1] + places[k, 1]) / 2.0
        offset = (middle_x - from_x) * to_x + (middle_y - from_y) * to_y
        low, high = cut(offset, along_x * to_x + along_y * to_y, low, high)
    return low, high


@kernel
def follow_neighbours(i: int, cells: Cells, density: NDArray[np.float64], grid: Grid) -> tuple[float, float]:
    """Return how fast the centroid of drone i moves because it and its neighbours do, at their first velocities."""
    places, first, closest = cells.places, cells.first, 1.0 / grid.centres.shape[0]
    velocity_x, velocity_y = 0.0, 0.0
    if cells.masses[i] <= 0.0:
        return velocity_x, velocity_y
    for j in range(places.shape[0]):
        apart_x, apart_y = places[j, 0] - places[i, 0], places[j, 1] - places[i, 1]
        distance = math.sqrt(apart_x * apart_x + apart_y * apart_y)
        if distance * distance <= _TIE:
            continue
        low, high = find_edge(i, j, places)
        if high <= low:
            continue
        middle_x, middle_y = (places[i, 0] + places[j, 0]) / 2.0, (places[i, 1] + places[j, 1]) / 2.0
        scale = (high - low) / 2.0 / (cells.masses[i] * max(distance, closest))
        for node in range(grid.nodes.shape[0]):
            along = (low + high) / 2.0 + grid.nodes[node] * (high - low) / 2.0
            x, y = middle_x - along * apart_y / distance, middle_y + along * apart_x / distance
            outward = (places[j, 0] - x) * first[j, 0] + (places[j, 1] - y) * first[j, 1]
            outward += (x - places[i, 0]) * first[i, 0] + (y - places[i, 1]) * first[i, 1]
            share = grid.weights[node] * scale * interpolate(density, x, y) * outward
            velocity_x += share * (x - cells.centroids[i, 0])
            velocity_y += share * (y - cells.centroids[i, 1])
    return velocity_x, velocity_y


@kernel
def steer(
    i: int,
    cells: Cells,
    velocity: NDArray[np.float32],
    density: NDArray[np.float64],
    grid: Grid,
    parameters: CoverageParameters,
    acceleration: NDArray[np.float64],
) -> None:
    """Write the acceleration that brings the i-th of some drones to the velocity that the law asks for."""
    wanted_x, wanted_y = cells.first[i, 0], cells.first[i, 1]
    if parameters.terms:
        more_x, more_y = follow_neighbours(i, cells, density, grid)
        wanted_x += more_x
        wanted_y += more_y
    fast = math.sqrt(wanted_x * wanted_x + wanted_y * wanted_y)
    scale = min(1.0, parameters.speed / max(fast, parameters.speed)) / parameters.speed_factor
    acceleration[0] = (wanted_x * scale - velocity[0]) / parameters.response
    acceleration[1] = (wanted_y * scale - velocity[1]) / parameters.response


@entry_point
def cover(
    positions: NDArray[np.float32],
    velocities: NDArray[np.float32],
    own: NDArray[np.bool_],
    heard: NDArray[np.bool_],
    commands: NDArray[np.float64],
    former: NDArray[np.float64],
    age: NDArray[np.float64],
    grid: Grid,
    parameters: CoverageParameters,
    accelerations: NDArray[np.float64],
) -> None:
    """Steer every own drone of n games towards the centroid of its cell among the drones that it hears.

    Parameters
    ----------
    positions, velocities, own, heard, commands, former, age
        As of `swarm_pz.config.system.Flight`.
    grid : Grid
    parameters : CoverageParameters
    accelerations : float64 array (n, N, 2)
        Written for own drones.
    """
    side, image = grid.centres.shape[0], commands.shape[1]
    density, rate = np.empty((image, image)), np.empty((image, image))
    fine, fine_rate = np.empty((side, side)), np.empty((side, side))
    for e in range(positions.shape[0]):
        blend_densities(commands[e], former[e], age[e], parameters, density, rate)
        spread(density, grid, fine)
        spread(rate, grid, fine_rate)
        team = np.flatnonzero(own[e])
        is_whole = True
        for i in team:
            for j in team:
                is_whole &= heard[e, i, j]
        if is_whole:
            cells = find_cells(positions[e][team].astype(np.float64), fine, fine_rate, grid, parameters)
            for place in range(len(team)):
                i = team[place]
                steer(place, cells, velocities[e, i], density, grid, parameters, accelerations[e, i])
            continue
        for i in team:
            crew = np.flatnonzero(heard[e, i])
            cells = find_cells(positions[e][crew].astype(np.float64), fine, fine_rate, grid, parameters)
            place = np.searchsorted(crew, i)
            steer(place, cells, velocities[e, i], density, grid, parameters, accelerations[e, i])
