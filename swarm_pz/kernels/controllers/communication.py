"""The ergodic controller with a limited radius of messages: each drone averages over the team-mates that it hears.

The equations are those of `swarm_pz.kernels.controllers.ergodic`, whose steps are done here drone by drone; only
step 4 differs.
"""

from __future__ import annotations

import numpy as np

from swarm_pz.kernels import kernel
from swarm_pz.kernels.arrays import Float32s, Int64s
from swarm_pz.kernels.controllers.ergodic import (
    ErgodicParameters,
    Scratch,
    add_expected,
    add_up,
    integrate_costate,
    look_ahead,
    tabulate,
    weigh,
)
from swarm_pz.kernels.swarm import Swarm


@kernel
def hears(i: int, j: int, swarm: Swarm, radius: float) -> bool:
    """Test that the message of drone j reaches drone i, a team-mate or itself."""
    if swarm.teams[i] != swarm.teams[j]:
        return False
    away_x = np.float64(swarm.positions[i, 0]) - np.float64(swarm.positions[j, 0])
    away_y = np.float64(swarm.positions[i, 1]) - np.float64(swarm.positions[j, 1])
    return bool(away_x * away_x + away_y * away_y <= radius * radius)


@kernel
def find_own_coefficients(
    drone: Int64s, swarm: Swarm, parameters: ErgodicParameters, scratch: Scratch, own: Float32s
) -> None:
    """Extend the memory of one drone, the number in `drone` (1,), and write its c_k: steps 1 to 3."""
    positions, memory, memory_weight = swarm.positions, swarm.memory, swarm.memory_weight
    i, modes, tables = drone[0], len(parameters.modes), scratch.tables
    tables.x[0], tables.y[0] = positions[i, 0], positions[i, 1]
    tabulate(tables, parameters.modes, 1)
    memory_weight[i] = parameters.decay * memory_weight[i] + np.float32(1.0)
    share = np.float32(1.0) / (memory_weight[i] + np.float32(len(parameters.times) - 1))
    for k1 in range(modes):
        for k2 in range(modes):
            memory[k1, k2, i] = parameters.decay * memory[k1, k2, i] + tables.cos_x[k1, 0] * tables.cos_y[k2, 0]
    look_ahead(drone, swarm, parameters, tables)
    sums = scratch.sums[0]
    sums[:] = np.float32(0.0)
    add_expected(drone, 1, memory_weight, parameters, tables, sums)
    add_up(sums, parameters.modes, scratch.totals, own)
    for k1 in range(modes):
        for k2 in range(modes):
            own[k1, k2] += share * memory[k1, k2, i]


@kernel
def ergodic_among_heard(
    swarm: Swarm, target: Float32s, parameters: ErgodicParameters, scratch: Scratch, radius: float
) -> None:
    """Solve for every drone of one game that takes part, with c averaged over the team-mates within a radius.

    Arguments are those of `ergodic`. The teams' mean coefficients are written into the scratch's `means`.
    """
    teams = swarm.teams
    num_drones, modes = teams.shape[0], len(parameters.modes)
    own = np.zeros((num_drones, modes, modes), np.float32)
    mean = np.empty((modes, modes), np.float32)
    sizes = np.zeros(2, np.int64)
    numbers = np.arange(num_drones)
    scratch.means[:] = np.float32(0.0)
    for i in range(num_drones):
        if teams[i] < 0:
            continue
        some = numbers[i : i + 1]
        find_own_coefficients(some, swarm, parameters, scratch, own[i])
        scratch.means[teams[i]] += own[i]
        sizes[teams[i]] += 1
    for team in range(2):
        scratch.means[team] /= np.float32(max(sizes[team], 1))
    for i in range(num_drones):
        if teams[i] < 0:
            continue
        mean[:] = np.float32(0.0)
        count = 0
        for j in range(num_drones):
            if hears(i, j, swarm, radius):
                mean += own[j]
                count += 1
        mean /= np.float32(count)
        weigh(mean, target[teams[i]], parameters, scratch)
        some = numbers[i : i + 1]
        look_ahead(some, swarm, parameters, scratch.tables)
        integrate_costate(some, swarm, parameters, scratch)
