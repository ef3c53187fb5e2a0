"""How kernels that other kernels call are compiled: without optimising them, which is done once, by who calls them all.

numba optimises every function with all that it calls, and again as a part of each of its callers: of kernels that are
called through five others, six times. Machine code is the same either way, but for a faster one here and there.
"""

from __future__ import annotations

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, PassManager, register_pass
from numba.core.untyped_passes import FixupArgs


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


class PartCompiler(CompilerBase):
    """numba's compiler, less its last optimisation."""

    def define_pipelines(self) -> list[PassManager]:
        """Return numba's own passes, and ours among the first."""
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_AsAPart, FixupArgs)
        passes.finalize()
        return [passes]
