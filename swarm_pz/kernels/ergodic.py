"""The decentralized ergodic controller: receding-horizon control towards a team's target.

Equations of the paper (Meyer et al., CASE 2022, after Mathew & Mezic 2011 and Abraham & Murphey
2018) with a decaying memory; the closed form of the costate is derived here.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.kernels import kernel, reduction
from swarm_pz.kernels.fourier import PI, fill_first_harmonic, fill_higher_harmonics

MARGIN = 64
"""Floats left free around the scratch, at least as many as the widest vector step reads ahead."""
_VECTOR = 16


class ErgodicParameters(NamedTuple):
    """Numbers of the controller, ready for the kernel."""

    modes: tuple[int, ...]
    """0, 1, ..., K - 1. A tuple, since the compiler knows its length and unrolls loops over it."""
    times: tuple[np.float32, ...]
    """Seconds from now to the points 0, 1, ..., H of the look-ahead; a tuple for the same reason."""
    decay: np.float32
    """Factor of the memory from one solve to the next: exp(-period / tau)."""
    spectrum: NDArray[np.float32]
    """(K, K): q (1 + |k|^2)^(-3/2)."""
    inverse_control_weight: np.float32
    wall_weight: np.float32
    wall_margin: np.float32
    max_acceleration: np.float32


@kernel
def fill_up(places: int) -> int:
    """Round a number of places up, so that vector loops over them leave no rest."""
    return (places + _VECTOR - 1) // _VECTOR * _VECTOR


@kernel
def wall_gradient(coordinate: np.float32, margin: np.float32, weight: np.float32) -> np.float32:
    """Return the derivative of weight * (distance beyond [margin, 1 - margin])^2 along one axis."""
    beyond = max(coordinate - (np.float32(1.0) - margin), np.float32(0.0)) + min(coordinate - margin, np.float32(0.0))
    return np.float32(2.0) * weight * beyond


@kernel
def saturate(acceleration: NDArray[np.float32], limit: np.float32) -> None:
    """Scale a vector down to the given magnitude, keeping its direction; in place."""
    magnitude = math.sqrt(acceleration[0] * acceleration[0] + acceleration[1] * acceleration[1])
    if magnitude > limit:
        acceleration[0] *= limit / magnitude
        acceleration[1] *= limit / magnitude


@reduction
def dot_pair(
    one: NDArray[np.float32], first: NDArray[np.float32], second: NDArray[np.float32]
) -> tuple[np.float32, np.float32]:
    """Return the sums of products of an array with each of two others."""
    with_first, with_second = np.float32(0.0), np.float32(0.0)
    for r in range(one.shape[0]):
        with_first += one[r] * first[r]
        with_second += one[r] * second[r]
    return with_first, with_second


@kernel
def add_weighted_basis(
    weights: NDArray[np.float32],
    cos_x: NDArray[np.float32],
    cos_y: NDArray[np.float32],
    weighted: NDArray[np.float32],
    coefficients: NDArray[np.float32],
) -> None:
    """Add sum_r weights_r F_k(x_r) over places r to coefficients (K, K); `weighted` is scratch."""
    modes, places = cos_x.shape
    for k1 in range(modes):
        for r in range(places):
            weighted[r] = weights[r] * cos_x[k1, r]
        for k2 in range(0, modes - 1, 2):
            first, second = dot_pair(weighted, cos_y[k2], cos_y[k2 + 1])
            coefficients[k1, k2] += first
            coefficients[k1, k2 + 1] += second
        if modes % 2:
            coefficients[k1, modes - 1] += dot_pair(weighted, cos_y[modes - 1], cos_y[modes - 1])[0]


@kernel
def add_potential_gradient(
    error: NDArray[np.float32],
    modes: tuple[int, ...],
    cos_x: NDArray[np.float32],
    sin_x: NDArray[np.float32],
    cos_y: NDArray[np.float32],
    sin_y: NDArray[np.float32],
    slope: NDArray[np.float32],
    gradient_x: NDArray[np.float32],
    gradient_y: NDArray[np.float32],
) -> None:
    """Add the gradient of sum_k error_k F_k at places r to gradient_x and gradient_y (places,).

    `slope` (K, K) is scratch.
    """
    places = cos_x.shape[1]
    for k1 in range(len(modes)):
        for k2 in range(len(modes)):
            slope[k1, k2] = PI * np.float32(k2) * error[k1, k2]
    for k1 in range(len(modes)):
        frequency = PI * np.float32(k1)
        for r in range(places):
            along_x = np.float32(0.0)
            along_y = np.float32(0.0)
            for k2 in range(len(modes)):
                along_x += error[k1, k2] * cos_y[k2, r]
                along_y += slope[k1, k2] * sin_y[k2, r]
            gradient_x[r] -= frequency * sin_x[k1, r] * along_x
            gradient_y[r] -= cos_x[k1, r] * along_y


@kernel
def ergodic(
    positions: NDArray[np.float32],
    velocities: NDArray[np.float32],
    teams: NDArray[np.int8],
    memory: NDArray[np.float32],
    memory_weight: NDArray[np.float32],
    target: NDArray[np.float32],
    parameters: ErgodicParameters,
    accelerations: NDArray[np.float32],
) -> None:
    """Solve the optimal control problem of every drone of one game.

    1. Memory: (m, w) <- decay (m, w) + (F(p), 1).
    2. Each drone looks ahead, coasting, to points h = 1..H one period apart.
    3. c_k = (m_k + sum_h F_k(x_h)) / (w + H).
    4. The team's coefficients are the mean over its drones.
    5. Costate, backwards from rho = 0: rho <- rho + dt (g_h + A' rho), with
       g_h = sum_k q Lambda_k (c_k - phi_k) grad F_k(x_h) + grad Phi(x_h). A point mass's A is
       nilpotent, so the velocity part comes out as dt^2 sum_h (h - 1) g_h, which is what is summed.
    6. u = -R^-1 B' rho, which is that sum over -R.

    Accelerations are not yet saturated. A team without drones is skipped.

    Parameters
    ----------
    positions, velocities : float32 array (drones, 2)
        Map widths, map widths per second.
    teams : int8 array (drones,)
    memory : float32 array (drones, K, K), memory_weight : float32 array (drones,)
        Sums over the past and their weight; updated.
    target : float32 array (2, K, K)
        Fourier coefficients phi_k of each team's target, indexed `[k1 (x), k2 (y)]`.
    parameters : ErgodicParameters
    accelerations : float32 array (drones, 2)
        Overwritten, in map widths per second squared.
    """
    num_drones = positions.shape[0]
    modes, points = len(parameters.modes), len(parameters.times)
    members = np.empty(num_drones, np.int64)
    # One block of scratch, so that its parts always lie at the same distance from each other, with a
    # margin to whatever lies beside it: where arrays lie must never decide which loop runs.
    cells = modes * modes
    most = fill_up(num_drones * points)
    scratch = np.empty(most * (4 * modes + 5) + 2 * cells + modes + 2 * MARGIN, np.float32)
    mean = scratch[MARGIN : MARGIN + cells].reshape(modes, modes)
    slope = scratch[MARGIN + cells : MARGIN + 2 * cells].reshape(modes, modes)
    present = scratch[MARGIN + 2 * cells : MARGIN + 2 * cells + modes]
    for team in range(2):
        size = 0
        for i in range(num_drones):
            if teams[i] == team:
                members[size] = i
                size += 1
        if size == 0:
            continue
        places = fill_up(size * points)
        table, start = modes * places, MARGIN + 2 * cells + modes
        cos_x = scratch[start : start + table].reshape(modes, places)
        sin_x = scratch[start + table : start + 2 * table].reshape(modes, places)
        cos_y = scratch[start + 2 * table : start + 3 * table].reshape(modes, places)
        sin_y = scratch[start + 3 * table : start + 4 * table].reshape(modes, places)
        start += 4 * table
        weights = scratch[start : start + places]
        gradient_x = scratch[start + places : start + 2 * places]
        gradient_y = scratch[start + 2 * places : start + 3 * places]
        path_x = scratch[start + 3 * places : start + 4 * places]
        path_y = scratch[start + 4 * places : start + 5 * places]

        for r in range(size * points, places):  # what fills up counts for nothing
            path_x[r], path_y[r], weights[r] = np.float32(0.5), np.float32(0.5), np.float32(0.0)
        for j in range(size):
            i = members[j]
            memory_weight[i] = parameters.decay * memory_weight[i] + np.float32(1.0)
            share = np.float32(1.0) / (np.float32(size) * (memory_weight[i] + np.float32(points - 1)))
            for h in range(len(parameters.times)):
                path_x[j * points + h] = positions[i, 0] + parameters.times[h] * velocities[i, 0]
                path_y[j * points + h] = positions[i, 1] + parameters.times[h] * velocities[i, 1]
                weights[j * points + h] = share
            weights[j * points] = np.float32(0.0)  # the present counts through the memory
        fill_first_harmonic(path_x, cos_x[1], sin_x[1])
        fill_first_harmonic(path_y, cos_y[1], sin_y[1])
        fill_higher_harmonics(cos_x, sin_x)
        fill_higher_harmonics(cos_y, sin_y)

        mean[:] = np.float32(0.0)
        for j in range(size):
            for k2 in range(len(parameters.modes)):
                present[k2] = cos_y[k2, j * points]
            share = weights[j * points + 1]
            for k1 in range(len(parameters.modes)):
                for k2 in range(len(parameters.modes)):
                    past = parameters.decay * memory[members[j], k1, k2] + cos_x[k1, j * points] * present[k2]
                    memory[members[j], k1, k2] = past
                    mean[k1, k2] += share * past
        add_weighted_basis(weights, cos_x, cos_y, gradient_x, mean)
        for k1 in range(modes):
            for k2 in range(modes):
                mean[k1, k2] = parameters.spectrum[k1, k2] * (mean[k1, k2] - target[team, k1, k2])

        for r in range(places):
            gradient_x[r] = wall_gradient(path_x[r], parameters.wall_margin, parameters.wall_weight)
        for r in range(places):
            gradient_y[r] = wall_gradient(path_y[r], parameters.wall_margin, parameters.wall_weight)
        add_potential_gradient(mean, parameters.modes, cos_x, sin_x, cos_y, sin_y, slope, gradient_x, gradient_y)
        scale = -parameters.inverse_control_weight * parameters.times[1]
        for j in range(size):
            total_x, total_y = np.float32(0.0), np.float32(0.0)
            for h in range(1, len(parameters.times)):
                total_x += parameters.times[h - 1] * gradient_x[j * points + h]
                total_y += parameters.times[h - 1] * gradient_y[j * points + h]
            accelerations[members[j], 0] = scale * total_x
            accelerations[members[j], 1] = scale * total_y
