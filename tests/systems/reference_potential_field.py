"""The potential field once more, slow: float64 and plain loops, from `docs/control_systems.md`."""

from __future__ import annotations

import numpy as np

from swarm_pz.systems import Flight
from swarm_pz.systems.potential_field import PotentialField
from tests.systems.image_flights import Floats, worst_error


def charge(command: Floats, row: int, column: int, system: PotentialField) -> float:
    """Return the charge of a cell."""
    attracts, repels = command
    cells = len(attracts)
    held = attracts[row, column] / attracts.sum() if attracts.any() else 1 / cells**2
    held *= system.attraction
    if repels.any():
        held -= system.repulsion * (repels[row, column] / repels.sum() - 1 / cells**2)
    return float(held)


def force(away: Floats, softening: float) -> Floats:
    """Return the force along a vector."""
    return away / (away @ away + softening**2) ** 1.5


def accelerations(system: PotentialField, flight: Flight) -> Floats:
    """Return the accelerations (N, 2) of a flight of one game."""
    positions, velocities = flight.positions[0].astype(float), flight.velocities[0].astype(float)
    command, cells = flight.commands[0], flight.commands.shape[-1]
    found = np.zeros(positions.shape)
    for i in np.flatnonzero(flight.own[0]):
        place, total = positions[i], np.zeros(2)
        for row in range(cells):
            for column in range(cells):
                middle = np.array([column + 0.5, row + 0.5]) / cells
                total += charge(command, row, column, system) * force(middle - place, 1 / cells)
        crew = np.flatnonzero(flight.heard[0, i])
        for j in crew:
            if j != i:
                total += force(place - positions[j], system.softening) / len(crew)
        for axis in range(2):
            low, high = place[axis], 1 - place[axis]
            total[axis] += system.wall * (1 / (low**2 + system.softening**2) - 1 / (high**2 + system.softening**2))
        found[i] = system.strength * total - system.friction * velocities[i]
    return found


def compare(states: int, seed: int) -> float:
    """Return the worst error on random states, as a share of the largest acceleration of its state."""
    return worst_error(PotentialField(), accelerations, states, seed)
