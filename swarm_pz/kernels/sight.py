"""Observations of drones that are agents; `swarm_pz.spaces.drones` describes their parts."""

from __future__ import annotations

import numpy as np

from swarm_pz.config import GRID_CELLS
from swarm_pz.kernels import exact, exact_part
from swarm_pz.kernels.arrays import Bools, Float32s, Int8s, Int64s, Uint8s
from swarm_pz.kernels.trails import cell_of

SITS_OUT = -1.0
"""First number of an inactive drone's observation; 1 for an active drone."""
SELF, OTHER = 10, 5
"""Length of the part about the drone itself, and of each row about another drone."""
BOTH = -1
"""In place of a team: every drone is active."""


@exact_part
def nearest(positions: Float32s, teams: Int8s, drone: int, team: int, distances: Float32s, found: Int64s) -> int:
    """Write the nearest others of a team into `found` (k,), nearest first, ties by number; return how many."""
    count = 0
    for other in range(len(teams)):
        if teams[other] != team or other == drone:
            continue
        x, y = positions[other, 0] - positions[drone, 0], positions[other, 1] - positions[drone, 1]
        distance = x * x + y * y
        place = count
        while place > 0 and distance < distances[place - 1]:
            place -= 1
        if place == len(found):
            continue
        count = min(count + 1, len(found))
        for later in range(count - 1, place, -1):
            found[later], distances[later] = found[later - 1], distances[later - 1]
        found[place], distances[place] = other, distance
    return count


@exact_part
def share(value: np.float32, most: np.float32) -> np.float32:
    """Return value / most, cut to [-1, 1]."""
    return min(max(value / most, np.float32(-1.0)), np.float32(1.0))


@exact
def see(
    positions: Float32s,
    velocities: Float32s,
    teams: Int8s,
    failed: Bools,
    rows: Int64s,
    sides: Int64s,
    images: Uint8s,
    speed: np.float32,
    neighbours: int,
    patch: int,
    seen: Float32s,
) -> None:
    """Write the observations of the drones of the games `rows` (n,) into `seen` (n, N, D), which must be zeros.

    `sides` (n,) are the teams whose drones are active, or `BOTH`. Images (n, C, G', G') show the ground as red sees it,
    in pairs of channels: own and opposing. `speed` is the unit of velocities; `neighbours` and `patch` are those of
    `swarm_pz.spaces.drones.DroneView`.
    """
    one, drones, grid = np.float32(1.0), teams.shape[1], images.shape[2]
    found, distances = np.empty(neighbours, np.int64), np.empty(neighbours, np.float32)
    for place in range(len(rows)):
        e, sizes = rows[place], np.zeros(2, np.int64)
        here, moving, team_of = positions[e], velocities[e], teams[e]
        for i in range(drones):
            sizes[team_of[i]] += 1
        for i in range(drones):
            own, line = team_of[i], seen[place, i]
            if failed[e, i] or (sides[place] != BOTH and sides[place] != own):
                line[0] = SITS_OUT
                continue
            line[0] = one
            for axis in range(2):
                line[1 + axis] = np.float32(2.0) * here[i, axis] - one
                line[3 + axis] = share(moving[i, axis], speed)
                line[5 + 2 * axis], line[6 + 2 * axis] = here[i, axis], one - here[i, axis]
            line[9] = np.float32(sizes[own]) / np.float32(drones)
            at = SELF
            for side in range(2):
                count = nearest(here, team_of, i, own if side == 0 else 1 - own, distances, found)
                for k in range(count):
                    j = found[k]
                    line[at + OTHER * k] = one
                    for axis in range(2):
                        line[at + OTHER * k + 1 + axis] = here[j, axis] - here[i, axis]
                        line[at + OTHER * k + 3 + axis] = share(
                            moving[j, axis] - moving[i, axis], np.float32(2.0) * speed
                        )
                at += OTHER * neighbours
            cell, block = cell_of(here[i, 0], here[i, 1]), GRID_CELLS // grid
            low_y, low_x = cell // GRID_CELLS // block - patch // 2, cell % GRID_CELLS // block - patch // 2
            for channel in range(images.shape[1]):
                image = images[place, channel if own == 0 else channel ^ 1]
                for y in range(max(0, -low_y), min(patch, grid - low_y)):
                    for x in range(max(0, -low_x), min(patch, grid - low_x)):
                        brightness = np.float32(image[low_y + y, low_x + x])
                        line[at + (channel * patch + y) * patch + x] = brightness / np.float32(255.0)
