"""The kernel ergodic controller: drones go where the density asks, away from where the team goes.

After Sun, Gupta, Abraham, Murphey and others, "Fast ergodic search with kernel functions" (IEEE Transactions on
Robotics, 2025); `docs/control_systems.md` has the equations.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarm_pz.config.system import Flight
from swarm_pz.kernels import entry_point, kernel
from swarm_pz.kernels.arrays import Bools, Float64s


class KernelErgodicParameters(NamedTuple):
    """Numbers of the controller, ready for the kernel."""

    gain: float
    length: float
    softening: float
    damping: float
    speed_factor: float


@kernel
def slope(x: float, y: float, parameters: KernelErgodicParameters) -> float:
    """Return the kernel's gradient at (x, y) from its centre, as a multiple of (-x, -y)."""
    distance = math.sqrt(x * x + y * y + parameters.softening * parameters.softening)
    return math.exp(-distance / parameters.length) / distance


@kernel
def push_of_points(i: int, points: Float64s, heard: Bools, parameters: KernelErgodicParameters) -> tuple[float, float]:
    """Return the mean push on drone i's last point by all points (N, H + 1, 2) of the drones that it hears."""
    push_x, push_y, count, last = 0.0, 0.0, 0, points.shape[1] - 1
    for j in range(points.shape[0]):
        if not heard[j]:
            continue
        for h in range(last + 1):
            x, y = points[i, last, 0] - points[j, h, 0], points[i, last, 1] - points[j, h, 1]
            share = slope(x, y, parameters)
            push_x += share * x
            push_y += share * y
        count += last + 1
    return push_x / count, push_y / count


@kernel
def pull_of_density(x: float, y: float, density: Float64s, parameters: KernelErgodicParameters) -> tuple[float, float]:
    """Return the pull of a density (A, A), uniform if empty, on a place."""
    pull_x, pull_y, total, cells = 0.0, 0.0, density.sum(), density.shape[0]
    even = 1.0 / (cells * cells)
    for row in range(cells):
        for column in range(cells):
            away_x, away_y = (column + 0.5) / cells - x, (row + 0.5) / cells - y
            asked = density[row, column] / total if total > 0.0 else even
            share = asked * slope(away_x, away_y, parameters)
            pull_x += share * away_x
            pull_y += share * away_y
    return pull_x, pull_y


@entry_point
def descend(flight: Flight, ahead: Float64s, parameters: KernelErgodicParameters, accelerations: Float64s) -> None:
    """Steer every own drone of n games down the metric.

    `ahead` (H + 1,) are the times of the next points, times the speed factor; accelerations (n, N, 2) are written for
    own drones.
    """
    positions, velocities, own, heard, commands = flight[:5]
    last = ahead.shape[0] - 1
    points = np.empty((positions.shape[1], last + 1, 2))
    for e in range(positions.shape[0]):
        for i in range(positions.shape[1]):
            for h in range(last + 1):
                for axis in range(2):
                    place = positions[e, i, axis] + ahead[h] * velocities[e, i, axis]
                    points[i, h, axis] = min(max(place, 0.0), 1.0)
        for i in range(positions.shape[1]):
            if not own[e, i]:
                continue
            push_x, push_y = push_of_points(i, points, heard[e, i], parameters)
            pull_x, pull_y = pull_of_density(points[i, last, 0], points[i, last, 1], commands[e], parameters)
            gain = parameters.gain / parameters.speed_factor
            accelerations[e, i, 0] = gain * (push_x + pull_x) - parameters.damping * velocities[e, i, 0]
            accelerations[e, i, 1] = gain * (push_y + pull_y) - parameters.damping * velocities[e, i, 1]
