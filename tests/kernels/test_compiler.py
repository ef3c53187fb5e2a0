"""A kernel is optimised where Python calls it, and not before."""

from __future__ import annotations

import numpy as np
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
    assert part(np.array([1.0, 3.0])) == 10.0, "tests call kernels themselves"
