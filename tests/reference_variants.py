"""The slow mirror, continued: what the rules' options change, and the other controller.

Float64 NumPy and plain Python like `tests.reference`, and in its words and orders of axes.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tests.reference import GRID, RING, Booleans, Floats, RuleReference, captures_where, cell_of

# ---------------------------------------------------------------------------------------------------------------------
# The reconstruction field
# ---------------------------------------------------------------------------------------------------------------------


def reconstruct(coefficients: NDArray[np.floating]) -> Floats:
    """Return sum_k c_k cos(pi k1 x) cos(pi k2 y) at the centres of the grid's cells, (50, 50)."""
    given = np.asarray(coefficients, dtype=np.float64)
    centres = (np.arange(GRID) + 0.5) / GRID
    waves = [np.cos(np.pi * k * centres) for k in range(max(given.shape))]
    total = np.zeros((GRID, GRID))
    for k1 in range(given.shape[0]):
        for k2 in range(given.shape[1]):
            total += given[k1, k2] * np.outer(waves[k2], waves[k1])
    return total


def ring_means(values: Floats) -> Floats:
    """Mean of (50, 50) values over the ring cells around every cell that lie inside the square."""
    framed = np.full((GRID + 4, GRID + 4), np.nan)
    framed[2 : 2 + GRID, 2 : 2 + GRID] = values
    neighbours = [framed[2 + dy : 2 + dy + GRID, 2 + dx : 2 + dx + GRID] for dy, dx in RING]
    return np.asarray(np.nanmean(neighbours, axis=0))


def reconstruction_field(coefficients: NDArray[np.floating]) -> Floats:
    """Return the capture field (50, 50) of a team with these mean coefficients (K, K).

    Ring means of the reconstruction, rescaled to [0, 1]; all 0 where they are constant but for rounding.
    """
    means = ring_means(reconstruct(coefficients))
    low, high = means.min(), means.max()
    if high - low <= 1e-12 * max(abs(low), abs(high)):
        return np.zeros_like(means)
    return np.asarray((means - low) / (high - low))


def reconstruction_captures(field: Floats, threshold: float = 0.75) -> Booleans:
    """Cells of a (50, 50) reconstruction field where it captures: at the threshold or above."""
    return np.asarray(field >= threshold)


# ---------------------------------------------------------------------------------------------------------------------
# The rules
# ---------------------------------------------------------------------------------------------------------------------


NO_PAST = GRID * GRID
"""What stands on a trail in place of a cell's number, counted row by row, while its drone had failed."""


class VariantRules(RuleReference):
    """Rules whose trails may last for ever (None) or be forgotten on a capture, for drones that may fail."""

    def __init__(
        self,
        teams: NDArray[np.integer],
        trail_ticks: int | None = 150,
        threshold: float = 0.75,
        forgotten_on_capture: bool = False,
    ) -> None:
        super().__init__(teams, 0, threshold)
        self.pasts: list[deque[int]] = [deque(maxlen=trail_ticks) for _ in range(len(self.teams))]
        self.forgotten_on_capture = forgotten_on_capture

    @property
    def occupancy(self) -> NDArray[np.int64]:
        """The teams' trails summed on the grid, (2, 50, 50) int64; counted afresh."""
        counts = np.zeros((2, NO_PAST + 1), dtype=np.int64)
        for team, past in zip(self.teams, self.pasts, strict=True):
            counts[team] += np.bincount(np.array(past, dtype=np.int64), minlength=NO_PAST + 1)
        return counts[:, :NO_PAST].reshape(2, GRID, GRID)

    def command(self, team: int) -> None:
        """Forget the trails of a team that got another target; call it before the tick of the solve."""
        for drone in np.flatnonzero(self.teams == team):
            self.pasts[drone].clear()

    def tick(
        self,
        positions: NDArray[np.float32],
        failed: Booleans | None = None,
        captures: Booleans | None = None,
    ) -> list[int]:
        """Extend the trails by positions (N, 2) after a move, apply all captures at once, and return who was captured.

        `failed` drones (N,) write no trail; `captures` (2, 50, 50) says where each team captures; its occupancy does so
        if not given.
        """
        self.ticks += 1
        cells = [cell_of(position) for position in positions]
        for drone, cell in enumerate(cells):
            self.pasts[drone].append(NO_PAST if failed is not None and failed[drone] else GRID * cell[0] + cell[1])
        if captures is None:
            captures = np.stack([captures_where(occupancy, self.threshold) for occupancy in self.occupancy])
        captured = [drone for drone, cell in enumerate(cells) if captures[1 - self.teams[drone]][cell]]
        for drone in captured:
            self._change_team(drone)
        return captured

    def _change_team(self, drone: int) -> None:
        super()._change_team(drone)  # the trail needs no handing over: occupancy is counted afresh
        if self.forgotten_on_capture:
            self.pasts[drone].clear()


# ---------------------------------------------------------------------------------------------------------------------
# Flocking
# ---------------------------------------------------------------------------------------------------------------------


def strongest_mode(target: NDArray[np.floating], low: float = 50.0, high: float = 100.0) -> tuple[float, float, float]:
    """Return x, y and weight of the attractor that serves a density (A, A).

    The centre of mass of the 3x3 block, of the cells inside the square, with the largest sum (the first in row-major
    order among equals), and the weight that its share of the mass earns. A uniform one attracts to the centre, with the
    least weight.
    """
    mass = np.array(target, dtype=np.float64)
    mass /= mass.sum()
    cells = len(mass)
    if (mass == mass[0, 0]).all():
        return 0.5, 0.5, low
    best, block = -1.0, (0, 0)
    for row in range(cells):
        for column in range(cells):
            total = mass[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2].sum()
            if total > best:
                best, block = total, (row, column)
    x, y = 0.0, 0.0
    for row in range(max(block[0] - 1, 0), min(block[0] + 2, cells)):
        for column in range(max(block[1] - 1, 0), min(block[1] + 2, cells)):
            x += mass[row, column] / best * (column + 0.5) / cells
            y += mass[row, column] / best * (row + 0.5) / cells
    return x, y, low + (high - low) * best


@dataclass
class FlockingReference:
    """The flocking controller of one game, in float64; numbers as of `swarm_pz.config.FlockingConfig`."""

    alignment: float = 0.1
    cohesion: float = 0.1
    separation: float = 0.15
    communication_radius: float = 0.15
    separation_radius: float = 0.05
    max_turn: float = math.pi / 10
    speed: float = 0.25
    period: float = 0.1

    def solve(
        self,
        positions: NDArray[np.floating],
        velocities: NDArray[np.floating],
        teams: NDArray[np.integer],
        attractors: NDArray[np.floating],
        heard: Booleans,
    ) -> Floats:
        """Return the accelerations (N, 2) of all drones, not saturated.

        `attractors` (2, 3) are x, y and weight of each team's; `heard` (N, N) is `[i, j]` whether i hears j.
        """
        accelerations = np.zeros((len(positions), 2))
        now = np.asarray(velocities, dtype=np.float64)
        for i, urge in enumerate(self.urges(positions, velocities, teams, attractors, heard)):
            strength = math.hypot(urge[0], urge[1])
            if strength < 1e-6:
                continue
            accelerations[i] = (self.speed * self._heading(now[i], urge / strength) - now[i]) / self.period
        return accelerations

    def urges(
        self,
        positions: NDArray[np.floating],
        velocities: NDArray[np.floating],
        teams: NDArray[np.integer],
        attractors: NDArray[np.floating],
        heard: Booleans,
    ) -> Floats:
        """Where drones want to go, the (N, 2) float64 vectors F; parameters as of `solve`."""
        p, v = np.asarray(positions, dtype=np.float64), np.asarray(velocities, dtype=np.float64)
        drones = len(p)
        urges = np.zeros((drones, 2))
        for i in range(drones):
            mates = [j for j in range(drones) if j != i and teams[j] == teams[i] and heard[i, j]]
            distance = {j: math.hypot(*(p[i] - p[j])) for j in mates}
            near = [j for j in mates if distance[j] <= self.communication_radius]
            align = sum(v[j] for j in near) / len(near) - v[i] if near else np.zeros(2)
            cohere = sum(p[j] for j in near) / len(near) - p[i] if near else np.zeros(2)
            separate = np.zeros(2)
            for j in mates:
                if distance[j] < self.separation_radius:
                    separate += (p[i] - p[j]) / max(distance[j], 0.001) ** 2
            x, y, weight = (float(value) for value in attractors[teams[i]])
            migrate = np.array([x, y]) - p[i]
            urges[i] = self.alignment * align + self.cohesion * cohere + self.separation * separate + weight * migrate
        return urges

    def _heading(self, velocity: Floats, wanted: Floats) -> Floats:
        """The (2,) unit vector towards `wanted` that the turn limit allows."""
        if math.hypot(velocity[0], velocity[1]) < 0.001:
            return wanted
        present = math.atan2(velocity[1], velocity[0])
        cross = velocity[0] * wanted[1] - velocity[1] * wanted[0]
        turn = math.atan2(cross, float(velocity @ wanted))
        heading = present + min(max(turn, -self.max_turn), self.max_turn)
        return np.array([math.cos(heading), math.sin(heading)])
