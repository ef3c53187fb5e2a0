"""How kernels are compiled: those that other kernels call as parts of these, and of nothing else.

numba optimises every function with all that it calls, and again as a part of each of its callers: of kernels that are
called through five others, six times. And it lets each be called from Python, too, which takes more code than most
kernels themselves: arguments such as all arrays of a game are unpacked one by one. Neither is needed of a part. Machine
code is the same either way, but for a faster one here and there.
"""

from __future__ import annotations

import gc
from collections.abc import Callable
from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, PassManager, register_pass
from numba.core.registry import CPUDispatcher
from numba.core.untyped_passes import FixupArgs

from swarm_pz.kernels.cache import StampedCache


class _Part(JITCodeLibrary):
    """The code of one kernel and of what it calls, as it is put into the code of its callers."""

    def _optimize_final_module(self) -> None:
        pass


@register_pass(mutates_CFG=False, analysis_only=False)
class _AsAPart(FunctionPass):
    """Have the code of a function go into a library of its own kind."""

    _name = "as_a_part"

    def __init__(self) -> None:
        FunctionPass.__init__(self)

    def run_pass(self, state: dict[str, object]) -> bool:
        """Make the library, which numba makes itself where there is none."""
        codegen = state.targetctx.codegen()  # type: ignore[attr-defined]
        state.library = _Part(codegen, state.func_id.func_qualname)  # type: ignore[attr-defined]
        return False


class _PartCompiler(CompilerBase):
    """numba's compiler, less its last optimisation and what Python calls."""

    def define_pipelines(self) -> list[PassManager]:
        """Return numba's own passes, and ours among the first."""
        self.state.flags.no_cpython_wrapper = True
        self.state.flags.no_cfunc_wrapper = True
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_AsAPart, FixupArgs)
        passes.finalize()
        return [passes]


class Part(CPUDispatcher):
    """A function that compiled functions call.

    Parameters
    ----------
    function : callable
    **options : object
        As of `numba.jit`.
    """

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        super().__init__(function, targetoptions=options, pipeline_class=_PartCompiler)

    def add_overload(self, compiled: Any) -> None:
        """Keep the code for some arguments where compiled functions look for it, and not where Python does."""
        self.overloads[tuple(compiled.signature.args)] = compiled

    def _compile_for_args(self, *_: Any, **__: Any) -> None:
        raise TypeError(
            f"{self.py_func.__name__} is a part of other kernels, and Python cannot call it: call one that is "
            "decorated with entry_point, or try it as plain Python, with NUMBA_DISABLE_JIT=1"
        )


class EntryPoint(CPUDispatcher):
    """A function that Python calls; its machine code is kept on disk.

    Parameters
    ----------
    function : callable
    **options : object
        As of `numba.jit`.
    """

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        super().__init__(function, targetoptions=options | {"no_cfunc_wrapper": True})
        self._cache = StampedCache(function)

    def _compile_for_args(self, *arguments: Any, **named: Any) -> Any:
        # numba makes millions of small objects, which Python's collector would go through again and again.
        was_enabled = gc.isenabled()
        gc.disable()
        try:
            return super()._compile_for_args(*arguments, **named)  # type: ignore[misc]
        finally:
            if was_enabled:
                gc.enable()
