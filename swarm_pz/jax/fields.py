"""Cells and capture fields, in whole numbers, so that rounding cannot decide a capture."""

from __future__ import annotations

import numpy as np
from jax import lax
from jax import numpy as jnp

from swarm_pz.config import GRID_CELLS
from swarm_pz.jax.params import Array
from swarm_pz.kernels.capture import FIELD_UNIT, RING_COUNTS, RING_RADIUS

WEIGHTS = (FIELD_UNIT // RING_COUNTS).astype(np.int32)
_FIXED = 29
"""Fractional bits of a coordinate that are used to find its cell: all those of a float32 of at least 1/64."""


def cells_of(positions: Array) -> Array:
    """Return the cells (N,), row * 50 + column. The product with 50 is exact: float32 could round it up."""
    column, row = along(positions).T
    return row * GRID_CELLS + column


def along(coordinates: Array) -> Array:
    """Return the columns of x coordinates, or the rows of y coordinates."""
    fixed = (coordinates * np.float32(2**_FIXED)).astype(jnp.int32)  # bits are cut off only within the first cell
    high, low = fixed >> 16, fixed & 0xFFFF
    return jnp.minimum((GRID_CELLS * high + (GRID_CELLS * low >> 16)) >> (_FIXED - 16), GRID_CELLS - 1)


def fields_of(occupancy: Array) -> Array:
    """Return both capture fields (2, 50, 50), whole numbers in units of `swarm_pz.kernels.capture.FIELD_UNIT`.

    A ring is a square of cells less a smaller one.
    """
    framed = jnp.pad(occupancy, ((0, 0), (RING_RADIUS, RING_RADIUS), (RING_RADIUS, RING_RADIUS)))
    size, last = GRID_CELLS, 2 * RING_RADIUS
    narrow = sum((framed[:, d : d + size] for d in range(2, last)), framed[:, 1 : size + 1])
    wide = narrow + framed[:, :size] + framed[:, last:]
    narrow, wide = lax.optimization_barrier((narrow, wide))  # else XLA recomputes them for each column
    inner = sum(narrow[:, :, d : d + size] for d in range(1, last))
    outer = sum(wide[:, :, d : d + size] for d in range(last + 1))
    return WEIGHTS * (outer - inner).astype(jnp.int32)


def limits_of(fields: Array, threshold: Array) -> Array:
    """Return the values (2,) above which fields capture."""
    return limit_of(fields.max(axis=(1, 2)), threshold)


def limit_of(maximum: Array, threshold: Array) -> Array:
    """Return the whole part of maximum * threshold / `PARTS`."""
    most = maximum.astype(jnp.uint32)
    # In halves of 16 bits, since a product of two 32-bit numbers overflows.
    high, low, of_high, of_low = most >> 16, most & 0xFFFF, threshold >> 16, threshold & 0xFFFF
    one, other = high * of_low + (low * of_low >> 16), low * of_high
    carried = (one & 0xFFFF) + (other & 0xFFFF) >> 16
    return (high * of_high + (one >> 16) + (other >> 16) + carried).astype(jnp.int32)
