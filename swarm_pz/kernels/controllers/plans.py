"""Warm starts of the ergodic controller: each solve looks ahead along the plan of the last one.

As in the authors' code, each drone keeps an acceleration for every point of its look-ahead. Where drones keep none,
`plans` is None, and these kernels compile to nothing.
"""

from __future__ import annotations

import math

import numpy as np

from swarm_pz.config import CONTROL_PERIOD
from swarm_pz.kernels import kernel, loop
from swarm_pz.kernels.arrays import Float32s, Int64s

_STEP = np.float32(CONTROL_PERIOD)
"""Seconds from one acceleration of a plan to the next."""


@kernel
def plans_of(plans: Float32s, e: int, warm_start: bool | None) -> Float32s | None:
    """Return the plans of game `e` (N, H, 2), None if drones keep none."""
    if warm_start is None:
        return None
    own: Float32s = plans[e]
    return own


@loop
def saturate_axes(acceleration: Float32s, limit: np.float32) -> None:
    """Scale a vector to the given magnitude if one of its components exceeds that; in place."""
    if max(abs(acceleration[0]), abs(acceleration[1])) > limit:
        factor = limit / math.sqrt(acceleration[0] * acceleration[0] + acceleration[1] * acceleration[1])
        acceleration[0] *= factor
        acceleration[1] *= factor


@loop
def follow_plans(
    drones: Int64s, plans: Float32s | None, times: tuple[np.float32, ...], x: Float32s, y: Float32s
) -> None:
    """Move the points that drones coast to, in the order of `look_ahead`, to where their plans (N, H, 2) take them.

    Acceleration 0 of a plan was flown since the last solve. By Euler's rule, acceleration t changes the velocity at
    point t, and so the positions from point t + 1 on.
    """
    if plans is not None:
        count, horizon = drones.shape[0], len(times) - 1
        for j in range(count):
            plan = plans[drones[j]]
            speed_x, speed_y, away_x, away_y = np.float32(0.0), np.float32(0.0), np.float32(0.0), np.float32(0.0)
            for t in range(1, horizon):
                speed_x += _STEP * plan[t, 0]
                speed_y += _STEP * plan[t, 1]
                away_x += times[1] * speed_x
                away_y += times[1] * speed_y
                x[(horizon - t - 1) * count + j] += away_x
                y[(horizon - t - 1) * count + j] += away_y


@loop
def make_plans(
    drones: Int64s, plans: Float32s | None, scale: np.float32, limit: np.float32, slope_x: Float32s, slope_y: Float32s
) -> None:
    """Write the plans (N, H, 2) of drones: `scale` times the velocity part of the costate at each of their points.

    Acceleration t, flown from point t to t + 1, sums up the slopes at the points from t + 2 on, times 1, 2, ...; so
    the last one is zero. Each is saturated as in the authors' code.
    """
    if plans is not None:
        count, horizon = drones.shape[0], plans.shape[1]
        for j in range(count):
            plan = plans[drones[j]]
            sum_x, sum_y, total_x, total_y = np.float32(0.0), np.float32(0.0), np.float32(0.0), np.float32(0.0)
            plan[horizon - 1] = np.float32(0.0)
            for t in range(horizon - 2, -1, -1):
                sum_x += slope_x[(horizon - t - 2) * count + j]
                sum_y += slope_y[(horizon - t - 2) * count + j]
                total_x += sum_x
                total_y += sum_y
                plan[t, 0], plan[t, 1] = scale * total_x, scale * total_y
                saturate_axes(plan[t], limit)
