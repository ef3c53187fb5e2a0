"""The potential-field controller: drones repel each other, walls repel them, and images attract and repel them.

After Howard, Matarić and Sukhatme, "Mobile sensor network deployment using potential fields: a distributed, scalable
solution to the area coverage problem" (DARS 2002); `docs/control_systems.md` has the equations.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarm_pz.config.system import Flight
from swarm_pz.kernels import entry_point, kernel, reduction
from swarm_pz.kernels.arrays import Bools, Float32s, Float64s


class PotentialParameters(NamedTuple):
    """Numbers of the controller, ready for the kernel."""

    strength: float
    attraction: float
    repulsion: float
    wall: float
    friction: float
    softening: float


@kernel
def find_charges(images: Float64s, parameters: PotentialParameters, charges: Float64s) -> None:
    """Write the charges (A, A) of the cells for two images (2, A, A): the first attracts, the second repels."""
    attracts, repels = images[0].sum(), images[1].sum()
    cells = images.shape[1]
    even = 1.0 / (cells * cells)
    for row in range(cells):
        for column in range(cells):
            here = images[0, row, column] / attracts if attracts > 0.0 else even
            there = images[1, row, column] / repels - even if repels > 0.0 else 0.0
            charges[row, column] = parameters.attraction * here - parameters.repulsion * there


@reduction
def pull_row(x: float, away_y: float, charges: Float64s, softening: float) -> tuple[float, float]:
    """Return the force of a row of cells with charges (A,) on a drone."""
    pull_x, pull_y, cells = 0.0, 0.0, charges.shape[0]
    fixed = away_y * away_y + softening * softening
    for column in range(cells):
        away_x = (column + 0.5) / cells - x
        squared = away_x * away_x + fixed
        share = charges[column] / (squared * math.sqrt(squared))
        pull_x += share * away_x
        pull_y += share * away_y
    return pull_x, pull_y


@kernel
def pull_of_images(x: float, y: float, charges: Float64s) -> tuple[float, float]:
    """Return the force of all cells; a cell's charge is spread over it."""
    pull_x, pull_y, cells = 0.0, 0.0, charges.shape[0]
    for row in range(cells):
        row_x, row_y = pull_row(x, (row + 0.5) / cells - y, charges[row], 1.0 / cells)
        pull_x += row_x
        pull_y += row_y
    return pull_x, pull_y


@kernel
def push_of_mates(i: int, positions: Float32s, heard: Bools, softening: float) -> tuple[float, float, int]:
    """Return the force of the drones that drone i hears, and their number; both include itself."""
    push_x, push_y, count = 0.0, 0.0, 0
    x, y = np.float64(positions[i, 0]), np.float64(positions[i, 1])
    for j in range(positions.shape[0]):
        if not heard[i, j]:
            continue
        count += 1
        away_x, away_y = x - positions[j, 0], y - positions[j, 1]
        squared = away_x * away_x + away_y * away_y + softening * softening
        share = 1.0 / (squared * math.sqrt(squared))
        push_x += share * away_x
        push_y += share * away_y
    return push_x, push_y, count


@kernel
def push_of_walls(place: float, softening: float) -> float:
    """Return the force of the two walls across an axis."""
    low, high = place * place + softening * softening, (1.0 - place) ** 2 + softening * softening
    return 1.0 / low - 1.0 / high


@entry_point
def repel(flight: Flight, parameters: PotentialParameters, accelerations: Float64s) -> None:
    """Add up the forces on every own drone of n games; accelerations (n, N, 2) are written for own drones."""
    positions, velocities, own, heard, commands = flight[:5]
    charges = np.empty(commands.shape[2:])
    for e in range(positions.shape[0]):
        find_charges(commands[e], parameters, charges)
        for i in range(positions.shape[1]):
            if not own[e, i]:
                continue
            x, y = np.float64(positions[e, i, 0]), np.float64(positions[e, i, 1])
            pull_x, pull_y = pull_of_images(x, y, charges)
            push_x, push_y, count = push_of_mates(i, positions[e], heard[e], parameters.softening)
            force_x = pull_x + push_x / count + parameters.wall * push_of_walls(x, parameters.softening)
            force_y = pull_y + push_y / count + parameters.wall * push_of_walls(y, parameters.softening)
            accelerations[e, i, 0] = parameters.strength * force_x - parameters.friction * velocities[e, i, 0]
            accelerations[e, i, 1] = parameters.strength * force_y - parameters.friction * velocities[e, i, 1]
