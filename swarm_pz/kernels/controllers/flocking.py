"""The flocking controller: alignment, cohesion, separation, and migration to an attractor.

After Hauert et al., "Reynolds flocking in reality with fixed-wing robots" (IROS 2011): drones keep
their speed and turn no faster than a fixed wing may. With a whole team at one attractor, it is what
Meyer et al. (CASE 2022) compare with the ergodic controller.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarm_pz.config import CONTROL_PERIOD, GameConfig
from swarm_pz.config.system import Flight
from swarm_pz.kernels import entry_point, kernel
from swarm_pz.kernels.arrays import Bools, Float32s, Float64s
from swarm_pz.kernels.fourier import normalise

_CLOSE = 0.001
"""Least distance in map widths that counts, so that coinciding drones push finitely."""
_SLOW = 0.001
"""Map widths per second below which a drone has no heading."""
_WEAK = 1e-6
"""Pull below which a drone does not accelerate."""


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
    """Return the numbers of flocking of a configuration."""
    *names, _ = FlockingParameters._fields
    return FlockingParameters._make([*(float(getattr(config.flocking, name)) for name in names), CONTROL_PERIOD])


@kernel
def find_pull(
    i: int, positions: Float32s, velocities: Float32s, heard: Bools, attractor: Float32s, parameters: FlockingParameters
) -> tuple[float, float]:
    """Return the weighted sum of the terms that pull drone i; `heard` (N,) marks the drones that it hears."""
    x, y = np.float64(positions[i, 0]), np.float64(positions[i, 1])
    away_x, away_y, velocity_x, velocity_y, place_x, place_y = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    neighbours = 0
    for j in range(heard.shape[0]):
        if j == i or not heard[j]:
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
def turn_to(pull: tuple[float, float], velocity: Float32s, max_turn: float) -> tuple[float, float]:
    """Return the heading after a turn of at most `max_turn` towards a pull; from rest, that of the pull."""
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


@entry_point
def flocking(flight: Flight, attractors: Float32s, parameters: FlockingParameters, accelerations: Float32s) -> None:
    """Steer one team of each of n games.

    A drone's neighbours j are the team-mates that it hears within the communication radius. Then

    pull = w_a (mean v_j - v) + w_c (mean p_j - p) + w_s sum (p - p_j) / |p - p_j|^2 + w (a - p),

    where the sum runs over those that it hears within the separation radius, and a and w are the
    attractor's position and weight. The heading turns towards the pull by at most `max_turn` a control
    period, and u = (speed * heading - v) / period. Accelerations are not yet saturated. Weights and
    terms are as published, the constant speed follows Hauert et al., and the units are our choice.

    Attractors (n, 3) are x, y, weight. Accelerations (n, N, 2) are overwritten for own drones.
    """
    positions, velocities, own, heard = flight[:4]
    for e in range(own.shape[0]):
        for i in range(own.shape[1]):
            if not own[e, i]:
                continue
            pull = find_pull(i, positions[e], velocities[e], heard[e, i], attractors[e], parameters)
            if pull[0] ** 2 + pull[1] ** 2 < _WEAK**2:
                accelerations[e, i] = np.float32(0.0)
                continue
            heading = turn_to(pull, velocities[e, i], parameters.max_turn)
            for axis in range(2):
                wanted = parameters.speed * heading[axis]
                accelerations[e, i, axis] = (wanted - velocities[e, i, axis]) / parameters.period


@kernel
def strongest_mode(target: Float64s) -> tuple[float, float, float]:
    """Return where a target (A, A) is densest, and the share of its mass there.

    These are the centre of mass and the sum of the 3x3 block of cells with the largest sum; the middle and 0
    for a uniform target.
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
def serve_densities(densities: Float64s, migration: tuple[float, float], attractors: Float64s) -> None:
    """Write the attractors (n, 3), x, y and weight, for densities (n, A, A).

    `migration` are the weights of an attractor for none and for all of a density's mass.
    """
    least, largest = migration
    target = np.empty(densities.shape[1:], np.float64)
    for place in range(densities.shape[0]):
        normalise(densities[place], target)
        x, y, share = strongest_mode(target)
        attractors[place, 0], attractors[place, 1] = x, y
        attractors[place, 2] = least + (largest - least) * share
