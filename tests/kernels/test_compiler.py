"""A kernel is compiled for who calls it, and optimised with that; and then it is nobody else's code that runs."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from llvmlite.binding import Linkage
from numba import njit

from swarm_pz.kernels import kernel
from swarm_pz.kernels.compiler import _WholeCompiler
from swarm_pz.kernels.fourier import make_targets
from swarm_pz.simulator.commands import make_target


def total(values: np.ndarray) -> float:
    found = 0.0
    for value in values:
        found += value * value
    return found


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


def test_an_entry_point_runs_its_own_code_in_the_process_that_compiled_it_too():
    """A function that others may stand in for could be another entry point's: games would go another way."""
    make_target(np.ones((10, 10)), 10)
    compiled = make_targets.signatures[0]
    shared = {}
    for name, options in (("usual", {}), ("ours", {"pipeline_class": _WholeCompiler})):
        function = njit(**options)(make_targets.py_func)
        function.compile(compiled)
        defined = function.overloads[compiled].library.get_defined_functions()
        shared[name] = [one.name for one in defined if one.linkage == Linkage.linkonce_odr]
    assert shared["usual"], "what the usual way shares differs by numba's version"
    assert not shared["ours"]


SOLVE = """
{remove}
import numpy as np
from swarm_pz.simulator import make_target
print(make_target(np.arange(100.0).reshape(10, 10), 10)[1].tobytes().hex())
"""


def test_without_a_private_part_of_numba_kernels_do_the_same_and_it_is_said_once():
    """The next version of numba may rename what the compiler is made of."""
    remove = "from numba.core.compiler import CompileResult; del CompileResult._find_referenced_environments"
    ours, plain = (
        subprocess.run(  # noqa: S603
            [sys.executable, "-c", SOLVE.format(remove=first)], capture_output=True, text=True, check=True
        )
        for first in ("", remove)
    )
    assert plain.stdout == ours.stdout
    assert plain.stderr.count("not a version that swarm-pz was tested with (CompileResult has no _find_ref") == 1
    assert "not a version" not in ours.stderr


def test_a_part_may_raise():
    """What an exception holds lies in an environment, which numba sets up for what it makes machine code of."""

    @kernel
    def picky(count):
        if count > 2:
            raise ValueError("at most 2, got", count)
        return count

    function = njit(pipeline_class=_WholeCompiler)(lambda count: picky(count))
    assert function(2) == 2
    with pytest.raises(ValueError, match=r"\('at most 2, got', 3\)"):
        function(3)
