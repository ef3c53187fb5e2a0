"""Coverage once more, slow: float64, every grid point to its nearest drone, every cell a polygon.

From `docs/control_systems.md`; nothing is taken from the kernel.
"""

from __future__ import annotations

import numpy as np

from swarm_pz.systems import Flight
from swarm_pz.systems.coverage import Coverage
from tests.systems.image_flights import CONFIG, Floats, worst_error


def value(image: Floats, x: float, y: float) -> float:
    """Return an image's bilinear interpolation at a place."""
    cells = len(image)
    hats = []
    for place in (x, y):
        at = min(max(place * cells - 0.5, 0.0), cells - 1.0)
        hats.append(np.maximum(0.0, 1.0 - np.abs(np.arange(cells) - at)))
    return float(hats[1] @ image @ hats[0])


def densities(system: Coverage, flight: Flight) -> tuple[Floats, Floats]:
    """Return the density in force and its change per second, as images."""
    new, old = (
        image / image.mean() if image.any() else np.ones_like(image) for image in (flight.commands[0], flight.former[0])
    )
    share = min(flight.age[0] / system.blend, 1.0)
    density = (1 - system.floor) * ((1 - share) * old + share * new) + system.floor
    rate = (1 - system.floor) * (new - old) / system.blend if share < 1 else np.zeros_like(new)
    return density, rate


def spread(image: Floats, side: int) -> Floats:
    """Return an image at the centres (side, side) of the grid."""
    centres = (np.arange(side) + 0.5) / side
    return np.array([[value(image, x, y) for x in centres] for y in centres])


class Cells:
    """The cells among some drones."""

    def __init__(self, places: Floats, density: Floats, rate: Floats, gain: float) -> None:
        side = len(density)
        centres = (np.arange(side) + 0.5) / side
        x, y = (axis.ravel() for axis in np.meshgrid(centres, centres))
        squared = (x - places[:, :1]) ** 2 + (y - places[:, 1:]) ** 2
        nearest = squared <= squared.min(axis=0) + 1e-12
        shares = nearest / nearest.sum(axis=0)
        self.places = places
        self.masses = shares @ density.ravel() / side**2
        self.centroids, self.first = places.copy(), np.zeros_like(places)
        for j in np.flatnonzero(self.masses):
            here, mass = shares[j] / side**2, self.masses[j]
            for axis, points in enumerate((x, y)):
                centroid = self.centroids[j, axis] = here @ (points * density.ravel()) / mass
                drift = here @ ((points - centroid) * rate.ravel()) / mass
                self.first[j, axis] = gain * (centroid - places[j, axis]) + drift

    def edges(self, i: int) -> list[tuple[int, Floats, Floats]]:
        """Return the sides of the cell of i that lie between it and others: the other, and the two ends.

        The square, cut along each bisector in turn.
        """
        corners = [np.array(corner, float) for corner in ((0, 0), (1, 0), (1, 1), (0, 1))]
        polygon = [(-1, corners[k], corners[(k + 1) % 4]) for k in range(4)]
        for j, place in enumerate(self.places):
            normal = place - self.places[i]
            if normal @ normal <= 1e-12:
                continue
            normal = normal / np.sqrt(normal @ normal)
            middle = (place + self.places[i]) / 2
            kept, ends = [], []
            for other, start, end in polygon:
                before, after = (start - middle) @ normal, (end - middle) @ normal
                if before <= 0 and after <= 0:
                    kept.append((other, start, end))
                elif before <= 0 or after <= 0:
                    crossing = start + (end - start) * (before / (before - after))
                    kept.append((other, start, crossing) if before <= 0 else (other, crossing, end))
                    ends.append(crossing)
            if len(ends) == 2:
                kept.append((j, *ends))
            polygon = kept
        return [side for side in polygon if side[0] >= 0]

    def follow(self, i: int, density: Floats, closest: float) -> Floats:
        """Return what the motion of i and its neighbours does to the centroid of i."""
        moved = np.zeros(2)
        if self.masses[i] <= 0.0:
            return moved
        nodes, weights = np.polynomial.legendre.leggauss(4)
        here, own = self.places[i], self.first[i]
        owners = (((self.places - here) ** 2).sum(axis=1) <= 1e-12).sum()
        for j, start, end in self.edges(i):
            length = np.sqrt((end - start) @ (end - start))
            distance = max(np.sqrt((self.places[j] - here) @ (self.places[j] - here)), closest)
            for node, weight in zip(nodes, weights, strict=True):
                point = (start + end) / 2 + node * (end - start) / 2
                outward = ((self.places[j] - point) @ self.first[j] + (point - here) @ own) / distance
                part = weight * length / 2 * value(density, *point) * outward / self.masses[i] / owners
                moved += part * (point - self.centroids[i])
        return moved


def accelerations(system: Coverage, flight: Flight) -> Floats:
    """Return the accelerations (N, 2) of a flight of one game."""
    density, rate = densities(system, flight)
    fine, fine_rate = spread(density, system.grid), spread(rate, system.grid)
    positions, velocities = flight.positions[0].astype(float), flight.velocities[0].astype(float)
    found, known = np.zeros(positions.shape), {}
    for i in np.flatnonzero(flight.own[0]):
        crew = tuple(np.flatnonzero(flight.heard[0, i]))
        if crew not in known:
            known[crew] = Cells(positions[list(crew)], fine, fine_rate, system.gain)
        cells, place = known[crew], crew.index(i)
        wanted = cells.first[place].copy()
        if system.neighbours:
            wanted += cells.follow(place, density, 1 / system.grid)
        fast = np.sqrt(wanted @ wanted)
        wanted *= min(1.0, system.speed / fast) if fast > 0 else 1.0
        found[i] = (wanted / CONFIG.dynamics.speed_factor - velocities[i]) / system.response
    return found


def cost_of(places: Floats, density: Floats) -> float:
    """Return the locational cost: the mean squared distance from what is asked for to the drone nearest to it."""
    side = 50
    centres = (np.arange(side) + 0.5) / side
    x, y = np.meshgrid(centres, centres)
    squared = (x - places[:, 0, None, None]) ** 2 + (y - places[:, 1, None, None]) ** 2
    return float((spread(density / density.mean(), side) * squared.min(axis=0)).mean())


def compare(states: int, seed: int) -> float:
    """Return the worst error on random states, as a share of the largest acceleration of its state."""
    return worst_error(Coverage(), accelerations, states, seed)
