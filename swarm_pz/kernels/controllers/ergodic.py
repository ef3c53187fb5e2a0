"""The decentralized ergodic controller: receding-horizon control towards a team's target.

Equations of the paper (Meyer et al., CASE 2022, after Mathew & Mezic 2011 and Abraham & Murphey
2018) with a decaying memory; the closed form of the costate is derived here.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarm_pz.config import CONTROL_PERIOD, GameConfig
from swarm_pz.kernels import kernel, reduction
from swarm_pz.kernels.arrays import Float32s, Float64s, Int8s, Int64s
from swarm_pz.kernels.controllers.plans import follow_plans, make_plans
from swarm_pz.kernels.fourier import PI, fill_harmonics
from swarm_pz.kernels.swarm import Swarm

_VECTOR = 16
"""Places that the widest vector instructions do at once; tables are filled up to a multiple."""
_PLACES = 352
"""Places tabulated together: as many as the processor's inner caches hold."""
_MARGIN = 64
"""Floats left free on either side of the scratch, more than a vector instruction reads."""


class ErgodicParameters(NamedTuple):
    """Numbers of the controller, ready for the kernel."""

    modes: tuple[int, ...]
    """0, 1, ..., K - 1. A tuple, since the compiler knows its length and unrolls loops over it."""
    times: tuple[np.float32, ...]
    """Seconds from now to the points 0, 1, ..., H of the look-ahead, times the speed factor: map widths that a
    unit of velocity carries by then. A tuple for the same reason."""
    decay: np.float32
    """Factor of the memory from one solve to the next: exp(-period / tau)."""
    spectrum: Float32s
    """(K, K): q Lambda_k, with (1 + |k|^2)^(-3/2) or exp(-0.8 |k|) for Lambda_k."""
    inverse_control_weight: np.float32
    """R^-1, over the speed factor: products of two times hold it twice."""
    wall_weight: np.float32
    wall_margin: np.float32
    max_acceleration: np.float32
    warm_start: bool | None
    """True: drones keep plans. None: they do not, and nothing that plans take is compiled."""


def sobolev_weights(modes: int) -> Float64s:
    """Return (1 + |k|^2)^(-3/2), (K, K): coarse differences count most, in control and in the ergodic metric."""
    k = np.arange(modes)
    return np.asarray((1.0 + k[:, None] ** 2 + k**2) ** -1.5)


def ergodic_parameters(config: GameConfig) -> ErgodicParameters:
    """Return the controller's numbers of a configuration."""
    controller, factor = config.controller, config.dynamics.speed_factor
    k = np.arange(controller.modes)
    exponential = np.exp(-0.8 * np.sqrt(k[:, None] ** 2 + k**2))
    spectrum = sobolev_weights(controller.modes) if controller.spectrum == "sobolev" else exponential
    decay = 1.0 if config.memory.controller is None else np.exp(-CONTROL_PERIOD / config.memory.controller)
    # A velocity moves a drone by the speed factor: points ahead lie that much further, while the costate,
    # which multiplies two of these times, wants the factor only once.
    return ErgodicParameters(
        modes=tuple(range(controller.modes)),
        times=tuple(np.float32(CONTROL_PERIOD * h * factor) for h in range(controller.horizon + 1)),
        decay=np.float32(decay),
        spectrum=(controller.ergodic_weight * spectrum).astype(np.float32),
        inverse_control_weight=np.float32(1.0 / (controller.control_weight * factor)),
        wall_weight=np.float32(controller.wall_weight),
        wall_margin=np.float32(controller.wall_margin),
        max_acceleration=np.float32(controller.max_acceleration),
        warm_start=True if controller.warm_start else None,
    )


class Tables(NamedTuple):
    """Scratch for some places of drones: coordinates, the basis there, and two sums."""

    x: Float32s
    """(places,) coordinates."""
    y: Float32s
    weights: Float32s
    """(places,) share of each place in the team's coefficients."""
    sum_x: Float32s
    sum_y: Float32s
    cos_x: Float32s
    """(K, places) cos(pi k x)."""
    sin_x: Float32s
    cos_y: Float32s
    sin_y: Float32s


class Scratch(NamedTuple):
    """Arrays that solves reuse, for one game after the other."""

    members: Int64s
    """(2, drones + 1) the numbers of each team's drones."""
    means: Float32s
    """(2, K, K) coefficients of each team."""
    error: Float32s
    """(K, K) their weighted error, of the team in hand."""
    slope: Float32s
    """(K, K) that error times pi k2."""
    tables: Tables


@kernel
def fill_up(places: int) -> int:
    """Round a number of places up, so that vector loops over them leave no rest."""
    return (places + _VECTOR - 1) // _VECTOR * _VECTOR


@kernel
def make_scratch(num_drones: int, parameters: ErgodicParameters) -> Scratch:
    """Allocate scratch for games of so many drones.

    All in one block, so that its parts always lie at the same distance from each other, with a margin
    to whatever lies beside it: where arrays lie must never decide which loop runs.
    """
    modes = len(parameters.modes)
    places, rows = fill_up(max(_PLACES, len(parameters.times))), modes + modes % 2
    image = fill_up(modes * modes)
    lines, basis = 4 * image, 4 * image + 5 * places
    # An even number of rows: harmonics come in pairs.
    block = np.empty(2 * _MARGIN + basis + 4 * rows * places, np.float32)[_MARGIN:-_MARGIN]
    images = block[:lines].reshape(4, image)
    line = block[lines:basis].reshape(5, places)
    table = block[basis:].reshape(4, rows, places)
    table[:, 0] = np.float32(0.0)  # sines of k = 0
    table[::2, 0] = np.float32(1.0)
    cells = modes * modes
    return Scratch(
        np.empty((2, num_drones + 1), np.int64),
        block[: 2 * cells].reshape(2, modes, modes),
        images[2, :cells].reshape(modes, modes),
        images[3, :cells].reshape(modes, modes),
        Tables(line[0], line[1], line[2], line[3], line[4], table[0], table[1], table[2], table[3]),
    )


@kernel
def tabulate(tables: Tables, modes: tuple[int, ...], used: int) -> None:
    """Tabulate the basis at the first `used` places; what fills the tables up counts for nothing."""
    places = fill_up(used)
    for r in range(places - used):
        rest = used + r
        tables.x[rest], tables.y[rest], tables.weights[rest] = np.float32(0.5), np.float32(0.5), np.float32(0.0)
    fill_harmonics(tables.x, places, modes, tables.cos_x, tables.sin_x)
    fill_harmonics(tables.y, places, modes, tables.cos_y, tables.sin_y)


@kernel
def wall_gradient(coordinate: np.float32, margin: np.float32, weight: np.float32) -> np.float32:
    """Return the derivative of weight * (distance beyond [margin, 1 - margin])^2 along one axis."""
    beyond = max(coordinate - (np.float32(1.0) - margin), np.float32(0.0)) + min(coordinate - margin, np.float32(0.0))
    return np.float32(2.0) * weight * beyond


@kernel
def saturate(acceleration: Float32s, limit: np.float32) -> None:
    """Scale a vector down to the given magnitude, keeping its direction; in place."""
    magnitude = math.sqrt(acceleration[0] * acceleration[0] + acceleration[1] * acceleration[1])
    if magnitude > limit:
        acceleration[0] *= limit / magnitude
        acceleration[1] *= limit / magnitude


@reduction
def dot_pair(one: Float32s, first: Float32s, second: Float32s) -> tuple[np.float32, np.float32]:
    """Return the sums of products of an array with each of two others."""
    with_first, with_second = np.float32(0.0), np.float32(0.0)
    for r in range(one.shape[0]):
        with_first += one[r] * first[r]
        with_second += one[r] * second[r]
    return with_first, with_second


@kernel
def remember(swarm: Swarm, sizes: tuple[int, int], parameters: ErgodicParameters, scratch: Scratch) -> None:
    """Extend all memories by the present, and average them over each team: steps 1, 3 and 4."""
    positions, teams = swarm.positions, swarm.teams
    memory, memory_weight = swarm.memory, swarm.memory_weight
    num_drones, horizon = positions.shape[0], np.float32(len(parameters.times) - 1)
    tables = scratch.tables
    scratch.means[:] = np.float32(0.0)
    for first in range(0, num_drones, _PLACES):
        last = min(first + _PLACES, num_drones)
        red, blue = tables.sum_x[: last - first], tables.sum_y[: last - first]
        for j in range(last - first):
            i = first + j
            tables.x[j], tables.y[j] = positions[i, 0], positions[i, 1]
            memory_weight[i] = parameters.decay * memory_weight[i] + np.float32(1.0)
            share = np.float32(1.0) / (np.float32(sizes[teams[i]]) * (memory_weight[i] + horizon))
            red[j] = np.float32(0.0) if teams[i] else share
            blue[j] = share if teams[i] else np.float32(0.0)
        tabulate(tables, parameters.modes, last - first)
        for k1 in range(len(parameters.modes)):
            for k2 in range(len(parameters.modes)):
                past = memory[k1, k2, first:last]
                for j in range(last - first):
                    past[j] = parameters.decay * past[j] + tables.cos_x[k1, j] * tables.cos_y[k2, j]
        for k1 in range(len(parameters.modes)):
            for k2 in range(len(parameters.modes)):
                of_red, of_blue = dot_pair(memory[k1, k2, first:last], red, blue)
                scratch.means[0, k1, k2] += of_red
                scratch.means[1, k1, k2] += of_blue


@kernel
def look_ahead(drones: Int64s, swarm: Swarm, parameters: ErgodicParameters, tables: Tables) -> None:
    """Let drones coast, or follow their plans, and tabulate the basis at the points h = H, ..., 1 that they come to.

    Point h of drone j is place (H - h) * drones + j: the points that steer a drone come first.
    """
    positions, velocities, times = swarm.positions, swarm.velocities, parameters.times
    count, horizon = drones.shape[0], len(times) - 1
    for j in range(count):
        i = drones[j]
        x, y, velocity_x, velocity_y = positions[i, 0], positions[i, 1], velocities[i, 0], velocities[i, 1]
        for h in range(1, len(times)):
            tables.x[(horizon - h) * count + j] = x + times[h] * velocity_x
            tables.y[(horizon - h) * count + j] = y + times[h] * velocity_y
    follow_plans(drones, swarm.plans, times, tables.x, tables.y)
    tabulate(tables, parameters.modes, horizon * count)


@kernel
def add_expected(
    drones: Int64s, size: int, memory_weight: Float32s, horizon: int, tables: Tables, mean: Float32s
) -> None:
    """Add what drones will see to the coefficients (K, K) of their team, which has that size: steps 3 and 4."""
    for j in range(drones.shape[0]):
        share = np.float32(1.0) / (np.float32(size) * (memory_weight[drones[j]] + np.float32(horizon)))
        for h in range(horizon):
            tables.weights[h * drones.shape[0] + j] = share
    places = fill_up(horizon * drones.shape[0])
    weighted = tables.sum_x[:places]
    for k1 in range(mean.shape[0]):
        for r in range(places):
            weighted[r] = tables.weights[r] * tables.cos_x[k1, r]
        for k2 in range(0, mean.shape[1] - 1, 2):
            first, second = dot_pair(weighted, tables.cos_y[k2], tables.cos_y[k2 + 1])
            mean[k1, k2] += first
            mean[k1, k2 + 1] += second
        if mean.shape[1] % 2:
            mean[k1, -1] += dot_pair(weighted, tables.cos_y[mean.shape[1] - 1], tables.cos_y[mean.shape[1] - 1])[0]


@kernel
def add_potential_gradient(
    error: Float32s, slope: Float32s, modes: tuple[int, ...], places: int, tables: Tables
) -> None:
    """Add the gradient of sum_k error_k F_k at the first places to sum_x and sum_y.

    `slope` (K, K) holds error_k pi k2.
    """
    for k1 in range(len(modes)):
        frequency = PI * np.float32(k1)
        for r in range(places):
            along_x = np.float32(0.0)
            along_y = np.float32(0.0)
            for k2 in range(len(modes)):
                along_x += error[k1, k2] * tables.cos_y[k2, r]
                along_y += slope[k1, k2] * tables.sin_y[k2, r]
            tables.sum_x[r] -= frequency * tables.sin_x[k1, r] * along_x
            tables.sum_y[r] -= tables.cos_x[k1, r] * along_y


@kernel
def integrate_costate(drones: Int64s, swarm: Swarm, parameters: ErgodicParameters, scratch: Scratch) -> None:
    """Follow the costate back along the paths of drones, down the weighted error in `scratch`: steps 5 and 6."""
    tables, accelerations = scratch.tables, swarm.accelerations
    count, horizon = drones.shape[0], len(parameters.times) - 1
    places = fill_up((horizon - 1) * count)  # the first point comes too soon to count
    for r in range(places):
        tables.sum_x[r] = wall_gradient(tables.x[r], parameters.wall_margin, parameters.wall_weight)
        tables.sum_y[r] = wall_gradient(tables.y[r], parameters.wall_margin, parameters.wall_weight)
    add_potential_gradient(scratch.error, scratch.slope, parameters.modes, places, tables)
    scale = -parameters.inverse_control_weight * parameters.times[1]
    for j in range(count):
        total_x, total_y = np.float32(0.0), np.float32(0.0)
        for h in range(2, len(parameters.times)):
            total_x += parameters.times[h - 1] * tables.sum_x[(horizon - h) * count + j]
            total_y += parameters.times[h - 1] * tables.sum_y[(horizon - h) * count + j]
        accelerations[drones[j], 0] = scale * total_x
        accelerations[drones[j], 1] = scale * total_y
    scale, limit = scale * parameters.times[1], parameters.max_acceleration
    make_plans(drones, swarm.plans, scale, limit, tables.sum_x, tables.sum_y)


@kernel
def list_members(teams: Int8s, members: Int64s) -> tuple[int, int]:
    """Write the numbers of each team's drones into `members` (2, drones + 1) and return how many there are."""
    red, blue = 0, 0
    for i in range(teams.shape[0]):  # without branches, which nobody could predict
        members[0, red] = i
        members[1, blue] = i
        red += 1 - teams[i]
        blue += teams[i]
    return red, blue


@kernel
def weigh(mean: Float32s, target: Float32s, parameters: ErgodicParameters, scratch: Scratch) -> None:
    """Write q Lambda_k (c_k - phi_k) into the scratch's `error` (K, K), and that times pi k2 into its `slope`."""
    error, slope = scratch.error, scratch.slope
    for k1 in range(len(parameters.modes)):
        for k2 in range(len(parameters.modes)):
            weighted = parameters.spectrum[k1, k2] * (mean[k1, k2] - target[k1, k2])
            error[k1, k2] = weighted
            slope[k1, k2] = PI * np.float32(k2) * weighted


@kernel
def most_at_once(parameters: ErgodicParameters) -> int:
    """Return the number of drones whose paths fit into the tables."""
    return max(_PLACES // (len(parameters.times) - 1), 1)


@kernel
def expect(drones: Int64s, swarm: Swarm, parameters: ErgodicParameters, tables: Tables, mean: Float32s) -> None:
    """Add what a team's drones will see to its coefficients `mean` (K, K): steps 2 to 4."""
    size, most = drones.shape[0], most_at_once(parameters)
    for first in range(0, size, most):
        some = drones[first : min(first + most, size)]
        look_ahead(some, swarm, parameters, tables)
        add_expected(some, size, swarm.memory_weight, len(parameters.times) - 1, tables, mean)


@kernel
def steer(drones: Int64s, swarm: Swarm, parameters: ErgodicParameters, scratch: Scratch) -> None:
    """Accelerate a team's drones against its weighted error: steps 5 and 6."""
    size, most = drones.shape[0], most_at_once(parameters)
    for first in range(0, size, most):
        some = drones[first : min(first + most, size)]
        if size > most:  # otherwise the tables are still those of `expect`
            look_ahead(some, swarm, parameters, scratch.tables)
        integrate_costate(some, swarm, parameters, scratch)


@kernel
def ergodic(swarm: Swarm, target: Float32s, parameters: ErgodicParameters, scratch: Scratch) -> None:
    """Solve the optimal control problem of every drone of one game.

    1. Memory: (m, w) <- decay (m, w) + (F(p), 1).
    2. Each drone looks ahead, coasting or following its plan, to points h = 1..H one period apart.
    3. c_k = (m_k + sum_h F_k(x_h)) / (w + H).
    4. The team's coefficients are the mean over its drones.
    5. Costate, backwards from rho = 0: rho <- rho + dt (g_h + A' rho), with
       g_h = sum_k q Lambda_k (c_k - phi_k) grad F_k(x_h) + grad Phi(x_h). A point mass's A is
       nilpotent, so the velocity part comes out as dt^2 sum_h (h - 1) g_h, times the speed factor, which is
       what is summed.
    6. u = -R^-1 B' rho, which is that sum over -R; for a plan also at the later points.

    Accelerations are not yet saturated. A team without drones is skipped.

    Parameters
    ----------
    swarm : Swarm
        All drones, each of team 0 or 1; memories are updated, accelerations and plans overwritten.
    target : float32 array (2, K, K)
        Fourier coefficients phi_k of each team's target, indexed `[k1 (x), k2 (y)]`.
    parameters : ErgodicParameters
    scratch : Scratch
        From `make_scratch`.
    """
    sizes = list_members(swarm.teams, scratch.members)
    remember(swarm, sizes, parameters, scratch)
    for team in range(2):
        drones = scratch.members[team, : sizes[team]]
        expect(drones, swarm, parameters, scratch.tables, scratch.means[team])
        weigh(scratch.means[team], target[team], parameters, scratch)
        steer(drones, swarm, parameters, scratch)
