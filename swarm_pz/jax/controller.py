"""The ergodic controller as pure functions; see `swarm_pz.kernels.controllers.ergodic`."""

from __future__ import annotations

import math

import jax
import numpy as np
from jax import lax
from jax import numpy as jnp

from swarm_pz.config import BLUE, TICKS_PER_CONTROL_PERIOD, GameConfig
from swarm_pz.jax.params import ABSENT, Array, State
from swarm_pz.kernels.controllers.ergodic import ergodic_parameters
from swarm_pz.simulator.commands import coefficient_matrix

_RULES = GameConfig()
CONTROLLER = ergodic_parameters(_RULES)
MODES, HORIZON = _RULES.controller.modes, _RULES.controller.horizon
_TIMES = np.array(CONTROLLER.times, np.float32)
_FREQUENCIES = (np.pi * np.arange(MODES)).astype(np.float32)
_MATRIX = coefficient_matrix(MODES, _RULES.command_cells).astype(np.float32)
_COSINE, _SINE = (
    [np.float32((-1) ** (n // 2) * math.pi**n / math.factorial(n)) for n in range(first, 13, 2)] for first in (0, 1)
)
"""Taylor coefficients of cos(pi x) and sin(pi x) / x, in powers of x squared."""


def harmonics(places: Array) -> tuple[Array, Array]:
    """Return cos(pi k x) and sin(pi k x), (K, ...), to 1e-6.

    The whole number nearest to k x gives the sign, and the remainder goes into a Taylor series. Each entry is computed
    separately: a CPU takes five times as long for tables that are stacked from rows.
    """
    return circle(lax.broadcasted_iota(jnp.float32, (MODES, *places.shape), 0) * places)


def circle(turns: Array) -> tuple[Array, Array]:
    """Return cos(pi x) and sin(pi x), to 1e-6."""
    whole = jnp.floor(turns + 0.5)
    left = turns - whole
    sign, square = 1.0 - 2.0 * (whole - 2.0 * jnp.floor(0.5 * whole)), left * left
    return sign * _polynomial(_COSINE, square), sign * left * _polynomial(_SINE, square)


def _polynomial(factors: list[np.float32], x: Array) -> Array:
    result = factors[-1]
    for factor in factors[-2::-1]:
        result = result * x + factor
    return result


def wanted_of(targets: Array) -> Array:
    """Return the Fourier coefficients (2, K, K) of targets (2, A, A)."""
    wanted = jnp.einsum("tab,bk,al->tkl", targets, _MATRIX, _MATRIX, precision="highest")
    return wanted / wanted[:, :1, :1]


def solve(state: State, goes_on: Array) -> State:
    """Choose all accelerations; the steps are those of `swarm_pz.kernels.controllers.ergodic.ergodic`.

    Tables are `[mode, place]`, and point h of drone n is place h * N + n, so that summands are adjacent.
    """
    of_team = (state.teams == jnp.arange(2)[:, None]).astype(jnp.float32)  # (2, N)
    positions, velocities = state.positions.T, state.velocities.T
    with jax.default_matmul_precision("highest"):
        (cos_x, _), (cos_y, _) = harmonics(positions[0]), harmonics(positions[1])
        # A drone captured since the last solve has no memory.
        decay = jnp.where(state.capture_ticks > state.tick - TICKS_PER_CONTROL_PERIOD, 0.0, CONTROLLER.decay)
        memory = decay * state.memory + cos_x[:, None] * cos_y[None, :]  # (K, K, N)
        weight = decay * state.memory_weight + 1.0
        share = of_team / (jnp.maximum(of_team.sum(axis=1, keepdims=True), 1.0) * (weight + HORIZON))

        ahead = (positions[:, None] + _TIMES[1:, None] * velocities[:, None]).reshape(2, -1)  # (2, H N)
        (cos_x, sin_x), (cos_y, sin_y) = lax.optimization_barrier((harmonics(ahead[0]), harmonics(ahead[1])))
        past = jnp.einsum("tn,kln->tkl", share, memory)
        coming = jnp.einsum("tp,kp,lp->tkl", jnp.tile(share, HORIZON), cos_x, cos_y)
        error = CONTROLLER.spectrum * (past + coming - wanted_of(state.targets))  # (2, K, K)

        is_blue = jnp.tile(state.teams == BLUE, HORIZON)

        def across(images: Array, table: Array) -> Array:
            """Return sums (K, places) over k2 of images (2, K, K) times a table (K, places), by each place's team."""
            red, blue = (images.reshape(-1, MODES) @ table).reshape(2, MODES, -1)
            return jnp.where(is_blue, blue, red)

        # XLA fuses Python's sums of rows and their summands into one loop; a reduction over modes takes longer.
        along_x = -sum(_FREQUENCIES[:, None] * sin_x * across(error, cos_y))
        along_y = -sum(cos_x * across(error * _FREQUENCIES, sin_y))
    margin = CONTROLLER.wall_margin
    beyond = jnp.maximum(ahead - (1.0 - margin), 0.0) + jnp.minimum(ahead - margin, 0.0)
    gradient = jnp.stack([along_x, along_y]) + 2.0 * CONTROLLER.wall_weight * beyond
    costate = (_TIMES[:-1, None] * gradient.reshape(2, HORIZON, -1)).sum(axis=1)
    accelerations = -CONTROLLER.inverse_control_weight * _TIMES[1] * costate.T
    size = jnp.sqrt((accelerations**2).sum(axis=1, keepdims=True))
    limit = CONTROLLER.max_acceleration
    accelerations = jnp.where(size > limit, accelerations * (limit / jnp.where(size > limit, size, 1.0)), accelerations)
    is_there = (state.teams != ABSENT)[:, None]
    return state._replace(
        accelerations=jnp.where(goes_on, jnp.where(is_there, accelerations, 0.0), state.accelerations),
        memory=jnp.where(goes_on, memory, state.memory),
        memory_weight=jnp.where(goes_on, weight, state.memory_weight),
    )
