"""The ergodic controller when not everybody hears everybody: drones average over whom they hear.

The equations are those of `swarm_pz.kernels.controllers.ergodic`, whose steps this file puts together once for
each drone; only step 4 differs.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarm_pz.config import GameConfig
from swarm_pz.kernels import kernel
from swarm_pz.kernels.arrays import Bools, Float32s, Int8s, Int64s
from swarm_pz.kernels.controllers.ergodic import (
    ErgodicParameters,
    Scratch,
    add_expected,
    integrate_costate,
    look_ahead,
    tabulate,
    weigh,
)
from swarm_pz.kernels.rng import MESSAGE, draw
from swarm_pz.kernels.swarm import Swarm


class Communication(NamedTuple):
    """Who can hear whom."""

    is_local: bool
    """Whether this file is needed at all."""
    radius: float
    """Map widths that a message reaches."""
    loss: float
    """Share of the messages that are lost."""
    relays: bool
    """Whether drones pass on what they hear."""


class Crew(NamedTuple):
    """What decides who can hear whom: of a `Swarm`, all that matters here."""

    positions: Float32s
    """(N, 2) map widths."""
    teams: Int8s
    """(N,) -1 for a drone that takes no part."""


def communication_parameters(config: GameConfig) -> Communication:
    """Return who can hear whom in a game; drones that may fail are heard by nobody when they have."""
    radius, loss = config.controller.communication_radius, config.controller.message_loss
    return Communication(
        is_local=radius is not None or loss > 0.0 or config.dynamics.failure_rate > 0.0,
        radius=math.inf if radius is None else float(radius),
        loss=float(loss),
        relays=config.controller.relay,
    )


@kernel
def hears(i: int, j: int, swarm: Swarm | Crew, communication: Communication, seed: np.uint64, tick: int) -> bool:
    """Whether drone j's own message reaches drone i in the solve at this tick; everybody hears oneself."""
    positions, teams = swarm.positions, swarm.teams
    if i == j:
        return True
    if teams[i] != teams[j]:
        return False
    away_x = np.float64(positions[i, 0]) - np.float64(positions[j, 0])
    away_y = np.float64(positions[i, 1]) - np.float64(positions[j, 1])
    if away_x * away_x + away_y * away_y > communication.radius * communication.radius:
        return False
    return communication.loss == 0.0 or draw(seed, MESSAGE, tick, i, j) >= communication.loss


@kernel
def who_hears_whom(swarm: Swarm | Crew, communication: Communication, seed: np.uint64, tick: int) -> Bools:
    """Return whether drone i hears drone j in the solve at this tick, (N, N) `[i, j]`, also through others.

    With relays, i hears j where a chain of messages leads from j to i: the transitive closure (Warshall, A theorem
    on boolean matrices, J. ACM 9, 1962).
    """
    num_drones = swarm.teams.shape[0]
    heard = np.empty((num_drones, num_drones), np.bool_)
    for i in range(num_drones):
        for j in range(num_drones):
            heard[i, j] = hears(i, j, swarm, communication, seed, tick)
    if communication.relays:
        for between in range(num_drones):
            for i in range(num_drones):
                if heard[i, between]:
                    for j in range(num_drones):
                        heard[i, j] |= heard[between, j]
    return heard


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
    horizon = len(parameters.times) - 1
    share = np.float32(1.0) / (memory_weight[i] + np.float32(horizon))
    for k1 in range(modes):
        for k2 in range(modes):
            memory[k1, k2, i] = parameters.decay * memory[k1, k2, i] + tables.cos_x[k1, 0] * tables.cos_y[k2, 0]
            own[k1, k2] = share * memory[k1, k2, i]
    look_ahead(drone, swarm, parameters, tables)
    add_expected(drone, 1, memory_weight, horizon, tables, own)


@kernel
def ergodic_among_heard(
    swarm: Swarm,
    target: Float32s,
    parameters: ErgodicParameters,
    scratch: Scratch,
    communication: Communication,
    seed: np.uint64,
    tick: int,
) -> None:
    """Solve for every drone of one game that takes part, with c averaged over the drones that it hears.

    Arguments are as of `ergodic`; `seed` is that of the game's messages. The scratch's `means` become the teams' mean
    coefficients.
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
    heard = who_hears_whom(swarm, communication, seed, tick)
    for i in range(num_drones):
        if teams[i] < 0:
            continue
        mean[:] = np.float32(0.0)
        for j in range(num_drones):
            if heard[i, j]:
                mean += own[j]
        mean /= np.float32(heard[i].sum())
        weigh(mean, target[teams[i]], parameters, scratch)
        some = numbers[i : i + 1]
        look_ahead(some, swarm, parameters, scratch.tables)
        integrate_costate(some, swarm, parameters, scratch)
