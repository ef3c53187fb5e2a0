"""The flocking controller: alignment, cohesion, separation, and migration to an attractor.

After Hauert et al., "Reynolds flocking in reality with fixed-wing robots" (IROS 2011): drones keep
their speed and turn no faster than a fixed wing may. With a whole team at one attractor, it is what
Meyer et al. (CASE 2022) compare the ergodic controller with.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CONTROL_PERIOD, GameConfig
from swarm_pz.kernels import entry_point, kernel
from swarm_pz.kernels.controllers.ergodic import Scratch
from swarm_pz.kernels.swarm import Swarm

_CLOSE = 0.001
"""Map widths below which a distance counts as this much: coinciding drones push finitely."""
_SLOW = 0.001
"""Map widths per second below which a drone has no heading."""
_WEAK = 1e-6
"""Pull below which a drone has nowhere to go."""


class FlockingParameters(NamedTuple):
    """Numbers of the controller, ready for the kernel."""

    alignment: float
    cohesion: float
    separation: float
    communication_radius: float
    separation_radius: float
    max_turn: float
    speed: float
    period: float


def flocking_parameters(config: GameConfig) -> FlockingParameters:
    """Return what a solve needs."""
    flocking = config.flocking
    return FlockingParameters(
        alignment=float(flocking.alignment),
        cohesion=float(flocking.cohesion),
        separation=float(flocking.separation),
        communication_radius=float(flocking.communication_radius),
        separation_radius=float(flocking.separation_radius),
        max_turn=float(flocking.max_turn),
        speed=float(flocking.speed),
        period=CONTROL_PERIOD,
    )


@kernel
def find_pull(
    i: int, swarm: Swarm, attractor: NDArray[np.float32], parameters: FlockingParameters
) -> tuple[float, float]:
    """Return the weighted sum of what draws drone i somewhere."""
    positions, velocities, teams = swarm.positions, swarm.velocities, swarm.teams
    x, y = np.float64(positions[i, 0]), np.float64(positions[i, 1])
    away_x, away_y, velocity_x, velocity_y, place_x, place_y = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    neighbours = 0
    for j in range(teams.shape[0]):
        if j == i or teams[j] != teams[i]:
            continue
        from_x, from_y = x - positions[j, 0], y - positions[j, 1]
        distance = math.sqrt(from_x * from_x + from_y * from_y)
        if distance < parameters.separation_radius:
            squared = max(distance, _CLOSE) ** 2
            away_x += from_x / squared
            away_y += from_y / squared
        if distance <= parameters.communication_radius:
            neighbours += 1
            velocity_x += velocities[j, 0]
            velocity_y += velocities[j, 1]
            place_x += positions[j, 0]
            place_y += positions[j, 1]
    pull_x = parameters.separation * away_x + attractor[2] * (attractor[0] - x)
    pull_y = parameters.separation * away_y + attractor[2] * (attractor[1] - y)
    if neighbours:
        pull_x += parameters.alignment * (velocity_x / neighbours - velocities[i, 0])
        pull_y += parameters.alignment * (velocity_y / neighbours - velocities[i, 1])
        pull_x += parameters.cohesion * (place_x / neighbours - x)
        pull_y += parameters.cohesion * (place_y / neighbours - y)
    return pull_x, pull_y


@kernel
def turn_to(pull: tuple[float, float], velocity: NDArray[np.float32], max_turn: float) -> tuple[float, float]:
    """Return the heading along a pull, as near to it as a turn of at most `max_turn` comes."""
    strength = math.sqrt(pull[0] ** 2 + pull[1] ** 2)
    speed = math.sqrt(np.float64(velocity[0]) ** 2 + np.float64(velocity[1]) ** 2)
    wanted_x, wanted_y = pull[0] / strength, pull[1] / strength
    if speed < _SLOW:
        return wanted_x, wanted_y
    heading_x, heading_y = velocity[0] / speed, velocity[1] / speed
    turn = math.atan2(heading_x * wanted_y - heading_y * wanted_x, heading_x * wanted_x + heading_y * wanted_y)
    turn = min(max(turn, -max_turn), max_turn)
    cosine, sine = math.cos(turn), math.sin(turn)
    return heading_x * cosine - heading_y * sine, heading_x * sine + heading_y * cosine


@kernel
def flocking(swarm: Swarm, target: NDArray[np.float32], parameters: FlockingParameters, scratch: Scratch) -> None:
    """Steer every drone that takes part.

    With neighbours j, the team-mates within the communication radius,

    pull = w_a (mean v_j - v) + w_c (mean p_j - p) + w_s sum (p - p_j) / |p - p_j|^2 + w (a - p),

    where the third sum runs over team-mates within the separation radius and a and w are the
    attractor's position and weight. The heading turns towards the pull by at most `max_turn` a control
    period, and u = (speed * heading - v) / period. Accelerations are not yet saturated. (Weights and
    terms as published; that speed is constant follows Hauert et al., the units are chosen here.)

    Parameters
    ----------
    swarm : Swarm
        Accelerations are overwritten for drones that take part; those that have failed, or whose team another
        controller flies, do not. Memories are not used: flocking has none.
    target : float32 array (2, 3)
        Each team's attractor: x, y, weight.
    parameters : FlockingParameters
    scratch : Scratch
        Not used: every controller takes the same.
    """
    velocities, teams, accelerations = swarm.velocities, swarm.teams, swarm.accelerations
    for i in range(teams.shape[0]):
        if teams[i] < 0:
            continue
        pull = find_pull(i, swarm, target[teams[i]], parameters)
        if pull[0] ** 2 + pull[1] ** 2 < _WEAK**2:
            accelerations[i] = np.float32(0.0)
            continue
        heading = turn_to(pull, velocities[i], parameters.max_turn)
        for axis in range(2):
            wanted = parameters.speed * heading[axis]
            accelerations[i, axis] = (wanted - velocities[i, axis]) / parameters.period


@kernel
def strongest_mode(target: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return where a target (A, A) is densest, and the share of its mass there.

    The 3x3 block of cells with the largest sum, its centre of mass and its sum; the middle and 0 for a
    uniform target, which is densest nowhere.
    """
    cells = target.shape[0]
    if target.max() - target.min() == 0.0:
        return 0.5, 0.5, 0.0
    best_x, best_y, best = 0.5, 0.5, 0.0
    for row in range(cells):
        for column in range(cells):
            mass, moment_x, moment_y = 0.0, 0.0, 0.0
            for r in range(max(row - 1, 0), min(row + 2, cells)):
                for c in range(max(column - 1, 0), min(column + 2, cells)):
                    mass += target[r, c]
                    moment_x += target[r, c] * (c + 0.5) / cells
                    moment_y += target[r, c] * (r + 0.5) / cells
            if mass > best:
                best_x, best_y, best = moment_x / mass, moment_y / mass, mass
    return best_x, best_y, best


@entry_point
def make_attractors(
    places: NDArray[np.int64],
    rows: NDArray[np.int64],
    teams: NDArray[np.int64],
    targets: NDArray[np.float64],
    migration: tuple[float, float],
    attractors: NDArray[np.float32],
) -> None:
    """Serve the targets of games `rows[place]` by attractors, so that density commands can drive flocks.

    Parameters
    ----------
    places, rows, teams
        As of `swarm_pz.kernels.fourier.make_targets`.
    targets : float64 array (E, 2, A, A)
    migration : (float, float)
        Weight of an attractor for none and for all of the target's mass.
    attractors : float32 array (E, 2, 3)
        Updated.
    """
    least, largest = migration
    for place in places:
        for team in teams:
            x, y, share = strongest_mode(targets[rows[place], team])
            attractor = attractors[rows[place], team]
            attractor[0], attractor[1], attractor[2] = x, y, least + (largest - least) * share
