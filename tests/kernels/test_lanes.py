"""Compiled lanes compute the same as plain Python."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from swarm_pz.kernels.lanes import WIDTH, floor, larger, load, spread, store, sum_rows


def compute(table, line, number, out):
    for start in range(0, 2 * WIDTH, WIDTH):
        lanes = spread(number) - load(table, 1, start) * number
        lanes += load(line, start)
        lanes -= number * larger(floor(lanes), number)
        store(larger(number, lanes), out, 0, start)
    store(sum_rows(table, 2, 5), out, 1, 3)


def test_lanes_are_computed_with_as_arrays_are_and_what_lies_beside_them_stays():
    generator = np.random.default_rng(0)
    table = generator.normal(size=(3, 300)).astype(np.float32)
    line = generator.normal(size=2 * WIDTH).astype(np.float32)
    compiled, plain = np.full((2, 2, 40), 7.0, np.float32)
    njit(compute)(table, line, np.float32(0.3), compiled)
    compute(table, line, np.float32(0.3), plain)
    np.testing.assert_allclose(compiled, plain, rtol=1e-6, atol=1e-6)
    np.testing.assert_allclose(compiled[1, 3:19], table[2, 5:261].reshape(16, 16).sum(axis=1), rtol=1e-4, atol=1e-5)
    assert (compiled[0, 32:] == 7.0).all() and (compiled[1, 19:] == 7.0).all()


def test_lanes_are_of_float32_alone():
    with pytest.raises(TypingError, match="No implementation of function"):
        njit(lambda array: load(array, 0))(np.zeros(16))
