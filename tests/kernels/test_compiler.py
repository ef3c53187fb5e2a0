"""A kernel is optimised where Python calls it, and not before; and then it is nobody else's code that runs."""

from __future__ import annotations

import numpy as np
from llvmlite.binding import Linkage
from numba import njit
from numba.core.codegen import JITCodeLibrary

from swarm_pz.kernels import kernel
from swarm_pz.kernels.compiler import WholeCompiler
from swarm_pz.kernels.fourier import make_targets
from swarm_pz.simulator.commands import make_target


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


def test_an_entry_point_runs_its_own_code_in_the_process_that_compiled_it_too():
    """A function that others may stand in for would be a part's, not optimised: games would go another way."""
    make_target(np.ones((10, 10)), 10)
    compiled = make_targets.signatures[0]
    shared = {}
    for name, options in (("usual", {}), ("ours", {"pipeline_class": WholeCompiler})):
        function = njit(**options)(make_targets.py_func)
        function.compile(compiled)
        defined = function.overloads[compiled].library.get_defined_functions()
        shared[name] = [one.name for one in defined if one.linkage == Linkage.linkonce_odr]
    assert any("normalise" in one for one in shared["usual"])
    assert not shared["ours"]
