"""A kernel is compiled into its caller, and runs no other entry point's code."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from swarm_pz.kernels import kernel, loop
from swarm_pz.kernels.compiler import _WholeCompiler


def picky(values: np.ndarray) -> float:
    if len(values) > 2:
        raise ValueError("at most 2, got", len(values))
    return values[0] * values[1]


def test_a_part_is_for_kernels_may_raise_and_is_no_function_of_pythons():
    """Without this error, a call from Python would end the process."""
    part = kernel(picky)
    whole = njit(pipeline_class=_WholeCompiler)(lambda values: part(values))
    for _ in range(2):  # before the part is compiled, and after
        with pytest.raises(TypeError, match="picky is a part of other kernels"):
            part(np.ones(2))
        assert whole(np.full(2, 2.0)) == 4.0
    with pytest.raises(ValueError, match=r"\('at most 2, got', 3\)"):
        whole(np.ones(3))


@pytest.mark.parametrize("returned", [lambda values: values, lambda values: (1.0, values[1:])], ids=["array", "view"])
def test_a_loop_that_returns_an_array_is_refused(returned):
    part = loop(returned)
    with pytest.raises(TypingError, match="freed twice"):
        njit(lambda values: len(part(values)))(np.ones(2))


def test_without_a_private_part_of_numba_kernels_do_the_same_and_it_is_said_once():
    """The next version of numba may rename the private parts that our compiler uses."""
    code = """
from numba.core.compiler import CompileResult; del CompileResult._find_referenced_environments
import numpy as np
from swarm_pz.kernels.game import are_decided
print(are_decided(np.array([[0, 1], [1, 1], [0, 0]], np.int8)).tolist())
"""
    plain = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)  # noqa: S603
    assert plain.stdout == "[False, True, True]\n"
    assert plain.stderr.count("not a version that swarm-pz was tested with (CompileResult has no _find_ref") == 1
