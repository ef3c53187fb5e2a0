"""A kernel is compiled for who calls it, and optimised with that."""

from __future__ import annotations

import numpy as np
import pytest
from numba import njit
from numba.core.codegen import JITCodeLibrary

from swarm_pz.kernels import kernel


def total(values: np.ndarray) -> float:
    found = 0.0
    for value in values:
        found += value * value
    return found


def test_only_who_is_called_by_python_is_optimised(monkeypatch):
    optimised, usual = [], JITCodeLibrary._optimize_final_module

    def optimise(library):
        optimised.append(library.name.split(".")[-1])
        usual(library)

    monkeypatch.setattr(JITCodeLibrary, "_optimize_final_module", optimise)
    part = kernel(total)

    @njit
    def twice(values):
        return 2.0 * part(values)

    assert twice(np.array([1.0, 3.0])) == 20.0
    assert "twice" in optimised and "total" not in optimised


@pytest.mark.parametrize("is_compiled", [False, True])
def test_python_is_told_that_it_cannot_call_a_part(is_compiled):
    """Without its words it would not be an error, but the end of the process."""
    part = kernel(total)
    if is_compiled:
        assert njit(lambda values: part(values))(np.ones(2)) == 2.0
    for values in (np.ones(2), np.ones(2, np.float32), None):
        with pytest.raises(TypeError, match="total is a part of other kernels, and Python cannot call it: call one"):
            part(values)


def test_without_numba_parts_are_plain_python(monkeypatch):
    monkeypatch.setattr("numba.config.DISABLE_JIT", 1)
    assert kernel(total) is total
