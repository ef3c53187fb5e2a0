"""How kernels that other kernels call are compiled: without optimising them, which is done once, by who calls them all.

numba optimises every function with all that it calls, and again as a part of each of its callers: of kernels that are
called through five others, six times. Machine code is the same either way, but for a faster one here and there.

Who calls them all keeps them to itself. In a process that has just compiled them they are there twice, as parts, too,
and the linker takes the first of two functions of one name: their code rounds differently, since it was not optimised,
and a game would go another way in the process that compiled it than in all that load it later.
"""

from __future__ import annotations

from llvmlite.binding import Linkage
from numba.core.codegen import Codegen, JITCodeLibrary
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, PassManager, register_pass
from numba.core.untyped_passes import FixupArgs


class _Part(JITCodeLibrary):
    """The code of one kernel and of what it calls, as it is put into the code of its callers."""

    def _optimize_final_module(self) -> None:
        pass


class _Whole(JITCodeLibrary):
    """The code of an entry point, and of all kernels that it calls, which nobody else's can stand in for."""

    def __init__(self, codegen: Codegen, name: str) -> None:
        super().__init__(codegen, name)
        self.enable_object_caching()  # as numba does with libraries that it makes itself

    def _optimize_final_module(self) -> None:
        super()._optimize_final_module()
        for function in self._final_module.functions:
            # After the optimisation, which treats these otherwise: so the code is what it always was.
            if not function.is_declaration and function.linkage == Linkage.linkonce_odr:
                function.linkage = Linkage.internal


class _IntoALibrary(FunctionPass):
    """Have the code of a function go into a library of another kind than numba's."""

    library: type[JITCodeLibrary]

    def __init__(self) -> None:
        FunctionPass.__init__(self)

    def run_pass(self, state: dict[str, object]) -> bool:
        """Make the library, which numba makes itself where there is none."""
        codegen = state.targetctx.codegen()  # type: ignore[attr-defined]
        state.library = self.library(codegen, state.func_id.func_qualname)  # type: ignore[attr-defined]
        return False


@register_pass(mutates_CFG=False, analysis_only=False)
class _AsAPart(_IntoALibrary):
    _name = "as_a_part"
    library = _Part


@register_pass(mutates_CFG=False, analysis_only=False)
class _AsAWhole(_IntoALibrary):
    _name = "as_a_whole"
    library = _Whole


class PartCompiler(CompilerBase):
    """numba's compiler, less its last optimisation."""

    def define_pipelines(self) -> list[PassManager]:
        """Return numba's own passes, and ours among the first."""
        return _passes(self, _AsAPart)


class WholeCompiler(CompilerBase):
    """numba's compiler, for a function whose code stands for itself."""

    def define_pipelines(self) -> list[PassManager]:
        """Return numba's own passes, and ours among the first."""
        return _passes(self, _AsAWhole)


def _passes(compiler: CompilerBase, ours: type[FunctionPass]) -> list[PassManager]:
    passes = DefaultPassBuilder.define_nopython_pipeline(compiler.state)
    passes.add_pass_after(ours, FixupArgs)
    passes.finalize()
    return [passes]
