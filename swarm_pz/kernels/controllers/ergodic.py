"""The decentralized ergodic controller: receding-horizon control towards a team's target.

Equations of the paper (Meyer et al., CASE 2022, after Mathew & Mezic 2011 and Abraham & Murphey
2018) with a decaying memory; the closed form of the costate is derived here.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarm_pz.config import CONTROL_PERIOD, GameConfig
from swarm_pz.kernels import kernel, loop
from swarm_pz.kernels.arrays import Float32s, Float64s, Int8s, Int64s
from swarm_pz.kernels.controllers.plans import follow_plans, make_plans
from swarm_pz.kernels.fourier import PI, fill_harmonics
from swarm_pz.kernels.lanes import WIDTH, Lanes, larger, load, spread, store, sum_rows
from swarm_pz.kernels.swarm import Swarm

_PLACES = 352
"""Places tabulated together: as many as the processor's inner caches hold."""
TOGETHER = 2 * WIDTH
"""Drones whose memories are extended at once."""
_LINE = 64
"""Bytes of a cache line: vectors that lie in two lines take twice as long to load."""


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
    """R^-1 over the speed factor, which products of two `times` contain twice."""
    wall_weight: np.float32
    wall_margin: np.float32
    max_acceleration: np.float32
    warm_start: bool | None
    """True: drones keep plans. None: they do not, and code for plans is not compiled."""


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
    # Drones move at the speed factor times their velocity, so the times ahead contain the factor. The costate
    # multiplies two of these times, but needs the factor only once.
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


def room_for(num_drones: int) -> int:
    """Return the number of drones that the memories of a game have room for: a multiple of `TOGETHER`."""
    return -(-num_drones // TOGETHER) * TOGETHER


class Tables(NamedTuple):
    """Scratch for some places of drones: coordinates, the basis there, and some numbers for each place."""

    x: Float32s
    """(places,) coordinates."""
    y: Float32s
    weights: Float32s
    """(places,) share of each place in the team's coefficients."""
    one: Float32s
    """(places,) temporary numbers."""
    other: Float32s
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
    slope_x: Float32s
    """(K, K) the weighted error of the present team's coefficients, times pi k1."""
    slope_y: Float32s
    """(K, K) the same times pi k2."""
    sums: Float32s
    """(2, 16 K' K' or more) coefficients of each team, summed over drones but not yet over lanes; K' is even."""
    totals: Float32s
    """(K' K' or more,) coefficients of one team, with lanes added up."""
    tables: Tables


@loop
def fill_up(places: int) -> int:
    """Round a number of places up to whole vectors."""
    return (places + WIDTH - 1) // WIDTH * WIDTH


@loop
def even(modes: tuple[int, ...]) -> int:
    """Return the number of modes along an axis, rounded up to an even one: harmonics come in pairs."""
    return len(modes) + len(modes) % 2


@kernel
def make_scratch(num_drones: int, parameters: ErgodicParameters) -> Scratch:
    """Allocate scratch for games of so many drones."""
    modes, rows = len(parameters.modes), even(parameters.modes)
    places = fill_up(max(_PLACES, len(parameters.times))) + WIDTH  # one more, since vectors are written at any place
    sums, totals = fill_up(rows * rows) * WIDTH, fill_up(rows * rows)
    size = 2 * sums + totals + 5 * places + 4 * rows * places
    block = np.zeros(size + _LINE, np.float32)
    first = (-block.ctypes.data % _LINE) // 4
    block = block[first : first + size]
    lines = block[2 * sums + totals :][: 5 * places].reshape(5, places)
    table = block[2 * sums + totals + 5 * places :].reshape(4, rows, places)
    table[::2, 0] = np.float32(1.0)  # cosines of k = 0
    return Scratch(
        np.empty((2, num_drones + 1), np.int64),
        np.empty((2, modes, modes), np.float32),
        np.empty((modes, modes), np.float32),
        np.empty((modes, modes), np.float32),
        block[: 2 * sums].reshape(2, sums),
        block[2 * sums :][:totals],
        Tables(lines[0], lines[1], lines[2], lines[3], lines[4], table[0], table[1], table[2], table[3]),
    )


@loop
def tabulate(tables: Tables, modes: tuple[int, ...], used: int) -> None:
    """Tabulate the basis at the first `used` places; the padding after these has no effect."""
    store(spread(np.float32(0.5)), tables.x, used)
    store(spread(np.float32(0.5)), tables.y, used)
    fill_harmonics(tables.x, fill_up(used), modes, tables.cos_x, tables.sin_x)
    fill_harmonics(tables.y, fill_up(used), modes, tables.cos_y, tables.sin_y)


@loop
def wall_gradient(coordinate: Lanes, margin: np.float32, weight: np.float32) -> Lanes:
    """Return the derivative of weight * (distance beyond [margin, 1 - margin])^2 along one axis."""
    none = np.float32(0.0)
    beyond = larger(coordinate - (np.float32(1.0) - margin), none) - larger(margin - coordinate, none)
    return np.float32(2.0) * weight * beyond


@loop
def saturate(accelerations: Float32s, limit: np.float32) -> None:
    """Scale vectors (N, 2) down to the given magnitude, keeping their directions; in place."""
    for i in range(accelerations.shape[0]):
        magnitude = math.sqrt(accelerations[i, 0] * accelerations[i, 0] + accelerations[i, 1] * accelerations[i, 1])
        if magnitude > limit:
            accelerations[i, 0] *= limit / magnitude
            accelerations[i, 1] *= limit / magnitude


@loop
def remember(swarm: Swarm, sizes: tuple[int, int], parameters: ErgodicParameters, scratch: Scratch) -> None:
    """Extend all memories by the present, and sum them up for each team: steps 1, 3 and 4."""
    positions, teams = swarm.positions, swarm.teams
    memory, memory_weight = swarm.memory, swarm.memory_weight
    num_drones, horizon, rows = positions.shape[0], np.float32(len(parameters.times) - 1), even(parameters.modes)
    tables, sums = scratch.tables, scratch.sums
    for first in range(0, num_drones, TOGETHER):
        for j in range(0, TOGETHER, WIDTH):  # padding, whose weights are 0
            store(spread(np.float32(0.5)), tables.x, j)
            store(spread(np.float32(0.5)), tables.y, j)
            store(spread(np.float32(0.0)), tables.one, j)
            store(spread(np.float32(0.0)), tables.other, j)
        for j in range(min(TOGETHER, num_drones - first)):
            i = first + j
            tables.x[j], tables.y[j] = positions[i, 0], positions[i, 1]
            memory_weight[i] = parameters.decay * memory_weight[i] + np.float32(1.0)
            share = np.float32(1.0) / (np.float32(sizes[teams[i]]) * (memory_weight[i] + horizon))
            tables.one[j] = np.float32(0.0) if teams[i] else share
            tables.other[j] = share if teams[i] else np.float32(0.0)
        tabulate(tables, parameters.modes, TOGETHER)
        red, more_red = load(tables.one, 0), load(tables.one, WIDTH)
        blue, more_blue = load(tables.other, 0), load(tables.other, WIDTH)
        for k2 in range(len(parameters.modes)):  # the outer loop, so that what was just stored is not loaded at once
            along, more_along = load(tables.cos_y, k2, 0), load(tables.cos_y, k2, WIDTH)
            for k1 in range(len(parameters.modes)):
                place = (k1 * rows + k2) * WIDTH
                present, more_present = load(tables.cos_x, k1, 0) * along, load(tables.cos_x, k1, WIDTH) * more_along
                whole = parameters.decay * load(memory, k1, k2, first) + present
                more = parameters.decay * load(memory, k1, k2, first + WIDTH) + more_present
                store(whole, memory, k1, k2, first)
                store(more, memory, k1, k2, first + WIDTH)
                of_red, of_blue = spread(np.float32(0.0)), spread(np.float32(0.0))
                if first:
                    of_red, of_blue = load(sums, 0, place), load(sums, 1, place)
                of_red += red * whole
                of_blue += blue * whole
                store(of_red + more_red * more, sums, 0, place)
                store(of_blue + more_blue * more, sums, 1, place)


@loop
def look_ahead(drones: Int64s, swarm: Swarm, parameters: ErgodicParameters, tables: Tables) -> None:
    """Let drones coast, or follow their plans, and tabulate the basis at the points h = H, ..., 1 that they come to.

    Point h of drone j is place (H - h) * drones + j: the points that steer a drone come first.
    """
    positions, velocities, times = swarm.positions, swarm.velocities, parameters.times
    count, horizon = drones.shape[0], len(times) - 1
    for axis in range(2):
        points = tables.y if axis else tables.x
        for j in range(count):
            tables.one[j], tables.other[j] = positions[drones[j], axis], velocities[drones[j], axis]
        for h in range(horizon, 0, -1):  # each vector's end is overwritten by the next
            for j in range(0, count, WIDTH):
                ahead = load(tables.one, j) + times[h] * load(tables.other, j)
                store(ahead, points, (horizon - h) * count + j)
    follow_plans(drones, swarm.plans, times, tables.x, tables.y)
    tabulate(tables, parameters.modes, horizon * count)


@loop
def add_expected(
    drones: Int64s, size: int, memory_weight: Float32s, parameters: ErgodicParameters, tables: Tables, sums: Float32s
) -> None:
    """Add the basis at drones' points ahead to the sums of their team of `size` drones: steps 3 and 4."""
    count, horizon, rows = drones.shape[0], len(parameters.times) - 1, even(parameters.modes)
    places = fill_up(horizon * count)
    for j in range(count):
        tables.one[j] = np.float32(1.0) / (np.float32(size) * (memory_weight[drones[j]] + np.float32(horizon)))
    for h in range(horizon):
        for j in range(0, count, WIDTH):
            store(load(tables.one, j), tables.weights, h * count + j)
    store(spread(np.float32(0.0)), tables.weights, horizon * count)
    for k1 in range(0, rows, 2):
        for r in range(0, places, WIDTH):
            weight = load(tables.weights, r)
            store(weight * load(tables.cos_x, k1, r), tables.one, r)
            store(weight * load(tables.cos_x, k1 + 1, r), tables.other, r)
        for k2 in range(0, rows, 2):  # four modes at once, so that each number that is loaded serves twice
            first, second = (k1 * rows + k2) * WIDTH, ((k1 + 1) * rows + k2) * WIDTH
            sum_00, sum_01 = load(sums, first), load(sums, first + WIDTH)
            sum_10, sum_11 = load(sums, second), load(sums, second + WIDTH)
            for r in range(0, places, WIDTH):
                one, other = load(tables.one, r), load(tables.other, r)
                even_y, odd_y = load(tables.cos_y, k2, r), load(tables.cos_y, k2 + 1, r)
                sum_00 += one * even_y
                sum_01 += one * odd_y
                sum_10 += other * even_y
                sum_11 += other * odd_y
            store(sum_00, sums, first)
            store(sum_01, sums, first + WIDTH)
            store(sum_10, sums, second)
            store(sum_11, sums, second + WIDTH)


@loop
def add_up(sums: Float32s, modes: tuple[int, ...], totals: Float32s, mean: Float32s) -> None:
    """Add up the lanes of sums, and write the coefficients (K, K) into `mean`."""
    rows = even(modes)
    for r in range(0, totals.shape[0], WIDTH):
        store(sum_rows(sums, r * WIDTH), totals, r)
    for k1 in range(len(modes)):
        for k2 in range(len(modes)):
            mean[k1, k2] = totals[k1 * rows + k2]


@loop
def integrate_costate(drones: Int64s, swarm: Swarm, parameters: ErgodicParameters, scratch: Scratch) -> None:
    """Integrate the costate back along drones' paths, down the weighted error in `scratch`: steps 5 and 6."""
    tables, accelerations, times = scratch.tables, swarm.accelerations, parameters.times
    count, horizon = drones.shape[0], len(times) - 1
    places = (horizon - 1) * count  # point 1 has weight 0
    for r in range(0, places, WIDTH):
        gradient_x = wall_gradient(load(tables.x, r), parameters.wall_margin, parameters.wall_weight)
        gradient_y = wall_gradient(load(tables.y, r), parameters.wall_margin, parameters.wall_weight)
        for k1 in range(1, len(parameters.modes)):  # one axis after the other, so that its tables stay in registers
            along = spread(scratch.slope_x[k1, 0])  # cos 0 = 1
            for k2 in range(1, len(parameters.modes)):
                along += scratch.slope_x[k1, k2] * load(tables.cos_y, k2, r)
            gradient_x -= load(tables.sin_x, k1, r) * along
        for k1 in range(len(parameters.modes)):
            along = spread(np.float32(0.0))  # sin 0 = 0
            for k2 in range(1, len(parameters.modes)):
                along += scratch.slope_y[k1, k2] * load(tables.sin_y, k2, r)
            gradient_y -= load(tables.cos_x, k1, r) * along
        store(gradient_x, tables.one, r)
        store(gradient_y, tables.other, r)
    scale = -parameters.inverse_control_weight * times[1]
    for j in range(0, count, WIDTH):
        total_x, total_y = spread(np.float32(0.0)), spread(np.float32(0.0))
        for h in range(2, len(times)):
            total_x += times[h - 1] * load(tables.one, (horizon - h) * count + j)
            total_y += times[h - 1] * load(tables.other, (horizon - h) * count + j)
        store(scale * total_x, tables.x, j)
        store(scale * total_y, tables.y, j)
    for j in range(count):
        accelerations[drones[j], 0], accelerations[drones[j], 1] = tables.x[j], tables.y[j]
    make_plans(drones, swarm.plans, scale * times[1], parameters.max_acceleration, tables.one, tables.other)


@loop
def list_members(teams: Int8s, members: Int64s) -> tuple[int, int]:
    """Write the numbers of each team's drones into `members` (2, drones + 1) and return how many there are."""
    red, blue = 0, 0
    for i in range(teams.shape[0]):  # without branches, which a processor could not predict
        members[0, red] = i
        members[1, blue] = i
        red += 1 - teams[i]
        blue += teams[i]
    return red, blue


@loop
def weigh(mean: Float32s, target: Float32s, parameters: ErgodicParameters, scratch: Scratch) -> None:
    """Write q Lambda_k (c_k - phi_k) pi k1 and pi k2 into the scratch's slopes (K, K)."""
    for k1 in range(len(parameters.modes)):
        for k2 in range(len(parameters.modes)):
            error = parameters.spectrum[k1, k2] * (mean[k1, k2] - target[k1, k2])
            scratch.slope_x[k1, k2] = PI * np.float32(k1) * error
            scratch.slope_y[k1, k2] = PI * np.float32(k2) * error


@loop
def most_at_once(parameters: ErgodicParameters) -> int:
    """Return the number of drones whose paths fit into the tables."""
    return max(_PLACES // (len(parameters.times) - 1), 1)


@loop
def expect(drones: Int64s, swarm: Swarm, parameters: ErgodicParameters, tables: Tables, sums: Float32s) -> None:
    """Add the basis at a team's points ahead to its sums: steps 2 to 4."""
    size, most = drones.shape[0], most_at_once(parameters)
    for first in range(0, size, most):
        some = drones[first : min(first + most, size)]
        look_ahead(some, swarm, parameters, tables)
        add_expected(some, size, swarm.memory_weight, parameters, tables, sums)


@loop
def steer(drones: Int64s, swarm: Swarm, parameters: ErgodicParameters, scratch: Scratch) -> None:
    """Accelerate a team's drones against its weighted error: steps 5 and 6."""
    size, most = drones.shape[0], most_at_once(parameters)
    for first in range(0, size, most):
        some = drones[first : min(first + most, size)]
        if size > most:  # otherwise the tables are still those of `expect`
            look_ahead(some, swarm, parameters, scratch.tables)
        integrate_costate(some, swarm, parameters, scratch)


@loop
def ergodic(swarm: Swarm, target: Float32s, parameters: ErgodicParameters, scratch: Scratch) -> None:
    """Solve the optimal control problem of every drone of one game.

    1. Memory: (m, w) <- decay (m, w) + (F(p), 1).
    2. Each drone looks ahead, coasting or following its plan, to points h = 1..H one period apart.
    3. c_k = (m_k + sum_h F_k(x_h)) / (w + H).
    4. The team's coefficients are the mean over its drones.
    5. Costate, backwards from rho = 0: rho <- rho + dt (g_h + A' rho), with
       g_h = sum_k q Lambda_k (c_k - phi_k) grad F_k(x_h) + grad Phi(x_h). A point mass has a nilpotent A,
       so the velocity part of rho is dt^2 sum_h (h - 1) g_h times the speed factor. Only that is computed.
    6. u = -R^-1 B' rho, which is that sum over -R; for a plan also at the later points.

    Memories are updated, accelerations and plans overwritten; accelerations are not yet saturated. `target` (2, K, K)
    holds the Fourier coefficients phi_k of each team's target, indexed `[k1 (x), k2 (y)]`.
    """
    sizes = list_members(swarm.teams, scratch.members)
    remember(swarm, sizes, parameters, scratch)
    for team in range(2):
        drones = scratch.members[team, : sizes[team]]
        expect(drones, swarm, parameters, scratch.tables, scratch.sums[team])
        add_up(scratch.sums[team], parameters.modes, scratch.totals, scratch.means[team])
        weigh(scratch.means[team], target[team], parameters, scratch)
        steer(drones, swarm, parameters, scratch)
