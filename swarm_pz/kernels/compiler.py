"""Compilation of kernels: entry points as a whole, and their parts only as far as entry points need them.

numba compiles every function to optimised machine code with all that it calls, and again within each of its callers:
a kernel that is called through five others, six times. It also lets Python call each one, with a wrapper that is more
code than most kernels, since it unpacks all arrays of a game one by one. Of a part we keep only the code that its
callers inline.

The code of an entry point is private to it. If two entry points, or a function and its part, contained functions of the
same name, the linker would use the first one for all. Their code may round differently, and a game would go differently
in the process that compiled it than in those that load it later.

All this uses private parts of numba. If one is missing, this module cannot be imported, and `swarm_pz.kernels` uses
`numba.jit`.
"""

from __future__ import annotations

import contextlib
import gc
import hashlib
import importlib
import logging
from collections.abc import Callable
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from llvmlite.binding import Linkage
from numba.core.caching import FunctionCache, IndexDataCacheFile
from numba.core.codegen import Codegen, JITCodeLibrary
from numba.core.compiler import CompilerBase, CompileResult, DefaultPassBuilder
from numba.core.compiler_lock import global_compiler_lock
from numba.core.compiler_machinery import FunctionPass, LoweringPass, PassManager, register_pass
from numba.core.errors import TypingError
from numba.core.registry import CPUDispatcher
from numba.core.typed_passes import NativeLowering, NoPythonBackend
from numba.core.types import Array
from numba.core.untyped_passes import FixupArgs

from swarm_pz.errors import SwarmError
from swarm_pz.kernels.cache import STAMP

_PRIVATE: dict[type, str] = {
    JITCodeLibrary: "_optimize_final_module _finalize_final_module _finalize_dynamic_globals "
    "_verify_declare_only_symbols _finalized _final_module",
    CompileResult: "_find_referenced_environments",
    CPUDispatcher: "_compile_for_args",
    FunctionCache: "_impl _cache_file",
    IndexDataCacheFile: "_index_name _data_name_pattern",
}
"""Private attributes of numba that are used here, and may change in its next version."""
for _kind, _names in _PRIVATE.items():
    _of_instances = getattr(getattr(_kind.__init__, "__code__", None), "co_names", ())  # type: ignore[misc]
    for _name in _names.split():
        if not hasattr(_kind, _name) and _name not in _of_instances:
            raise ImportError(f"{_kind.__name__} has no {_name}")


class _PartLibrary(JITCodeLibrary):
    """The code of one kernel and of all that it calls, which becomes machine code only within its callers."""

    def add_llvm_module(self, module: Any) -> None:
        """Inline the code into its callers: passing on all arrays of a game takes longer than most parts."""
        for function in module.functions:
            if not function.is_declaration and function.name.startswith("_Z"):  # not what makes exceptions
                function.add_function_attribute("alwaysinline")
        super().add_llvm_module(module)

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


class _WholeLibrary(JITCodeLibrary):
    """The code of an entry point and of all kernels that it calls, which the linker cannot replace by another's."""

    def __init__(self, codegen: Codegen, name: str) -> None:
        super().__init__(codegen, name)
        self.enable_object_caching()  # as numba does with libraries that it makes itself

    def _optimize_final_module(self) -> None:
        super()._optimize_final_module()
        for function in self._final_module.functions:
            # After the optimisation, which would treat internal functions differently: so the code stays the same.
            if not function.is_declaration and function.linkage == Linkage.linkonce_odr:
                function.linkage = Linkage.internal


class _IntoALibrary(FunctionPass):
    """Put the code of a function into a library of another kind than numba's."""

    library: type[JITCodeLibrary]

    def __init__(self) -> None:
        FunctionPass.__init__(self)

    def run_pass(self, state: dict[str, object]) -> bool:
        """Make the library; numba makes its own only if there is none."""
        codegen = state.targetctx.codegen()  # type: ignore[attr-defined]
        state.library = self.library(codegen, state.func_id.func_qualname)  # type: ignore[attr-defined]
        return False


@register_pass(mutates_CFG=False, analysis_only=False)
class _AsAPart(_IntoALibrary):
    _name = "as_a_part"
    library = _PartLibrary


@register_pass(mutates_CFG=False, analysis_only=False)
class _AsAWhole(_IntoALibrary):
    _name = "as_a_whole"
    library = _WholeLibrary


def _holds_array(kind: Any) -> bool:
    return isinstance(kind, Array) or any(map(_holds_array, getattr(kind, "types", ())))


@register_pass(mutates_CFG=False, analysis_only=False)
class _OfferToKernels(LoweringPass):
    """Let other kernels find a part, as numba does only for functions with machine code."""

    _name = "offer_to_kernels"

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: dict[str, object]) -> bool:
        """Register the part by a key, in place of the function that Python would call."""
        if not state.flags.nrt and _holds_array(state["return_type"]):  # type: ignore[attr-defined]
            name = state.func_id.func_name  # type: ignore[attr-defined]
            raise TypingError(f"{name} is a loop, and arrays that it returns would be freed twice: write into one")
        key, lowered = object(), state["cr"]
        state.targetctx.insert_user_function(key, lowered.fndesc, [state.library])  # type: ignore[attr-defined]
        state["cr"] = lowered._replace(cfunc=key)  # type: ignore[attr-defined]
        return False


@register_pass(mutates_CFG=False, analysis_only=False)
class _WithItsPartsEnvironments(LoweringPass):
    """Tell the code where the parts' environments are, as numba does for code that comes from a file."""

    _name = "with_its_parts_environments"

    def __init__(self) -> None:
        LoweringPass.__init__(self)

    def run_pass(self, state: dict[str, object]) -> bool:
        """Put each environment where the code looks for it to make exceptions."""
        compiled = state["cr"]
        for environment in compiled._find_referenced_environments():  # type: ignore[attr-defined]
            compiled.library.codegen.set_env(environment.env_name, environment)  # type: ignore[attr-defined]
        return False


class _PartCompiler(CompilerBase):
    def define_pipelines(self) -> list[PassManager]:
        """Return numba's own passes, and ours among them."""
        flags = self.state.flags
        flags.no_cpython_wrapper = flags.no_cfunc_wrapper = flags.no_compile = True
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_AsAPart, FixupArgs)
        passes.add_pass_after(_OfferToKernels, NativeLowering)
        passes.finalize()
        return [passes]


class _WholeCompiler(CompilerBase):
    def define_pipelines(self) -> list[PassManager]:
        """Return numba's own passes, and ours among them."""
        self.state.flags.no_cfunc_wrapper = True
        passes = DefaultPassBuilder.define_nopython_pipeline(self.state)
        passes.add_pass_after(_AsAWhole, FixupArgs)
        passes.add_pass_after(_WithItsPartsEnvironments, NoPythonBackend)
        passes.finalize()
        return [passes]


class Part(CPUDispatcher):
    """A function that compiled functions call, with options of `numba.jit`."""

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        super().__init__(function, targetoptions=options, pipeline_class=_PartCompiler)

    def add_overload(self, compiled: Any) -> None:
        """Keep the code for some arguments where compiled functions look for it, and not where Python does."""
        self.overloads[tuple(compiled.signature.args)] = compiled

    def _compile_for_args(self, *_: Any, **__: Any) -> None:
        raise TypeError(
            f"{self.py_func.__name__} is a part of other kernels, and Python cannot call it: call one that is "
            "decorated with entry_point, or its plain Python, py_func; NUMBA_DISABLE_JIT=1 makes all of them plain"
        )


class EntryPoint(CPUDispatcher):
    """A function that Python calls, with options of `numba.jit`; its machine code is kept on disk."""

    def __init__(self, function: Callable[..., Any], **options: Any) -> None:
        super().__init__(function, targetoptions=options, pipeline_class=_WholeCompiler)
        self._cache = StampedCache(function)

    def compile(self, sig: Any) -> Any:
        """Return the machine code for arguments of some types, and compile it if there is none."""
        _load_without_scipy()
        # numba makes millions of small objects, which Python's collector would go through again and again.
        was_enabled = gc.isenabled()
        gc.disable()
        try:
            return super().compile(sig)
        finally:
            if was_enabled:
                gc.enable()


@cache
def _load_without_scipy() -> None:
    """Load numba's functions of arrays, but not `scipy.linalg`, which takes longer than all else that kernels need.

    numba imports it to see whether there is BLAS, and again for a function that uses it; no kernel does.
    """
    from numba.np import linalg

    if find_spec("scipy") is not None:
        with global_compiler_lock:
            look, linalg.ensure_blas = linalg.ensure_blas, lambda: None
            try:
                importlib.import_module("numba.np.arraymath")
            finally:
                linalg.ensure_blas = look


class _Files(IndexDataCacheFile):
    """numba's files of a function's machine code, each named by the arguments that its code takes.

    numba itself numbers them. Two processes that compile a function for different arguments at once would use the
    same number, and the index of one could then lead to the code of the other.
    """

    def save(self, key: Any, data: Any) -> None:
        """Save machine code in a file for these arguments only."""
        name, arguments = self._index_name.removesuffix(".nbi"), hashlib.sha256(repr(key).encode()).hexdigest()[:16]
        self._data_name_pattern = f"{name}-{arguments}.{{number}}.nbc"
        super().save(key, data)


class StampedCache(FunctionCache):
    """numba's cache of a function's machine code, with the stamp in the names of its files.

    numba itself checks only the file of the function, and would miss a change in a kernel that it calls.
    Files of other sources are never opened: they may name classes that no longer exist, and numba writes an
    index before the code that it lists, so that an old file could be taken for a new one.

    Raises
    ------
    SwarmError
        If the function is not in `swarm_pz.kernels`, since the stamp would not cover its file.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        if not function.__module__.startswith(f"{__package__}."):
            raise SwarmError(
                f"an entry point must be a function of {__package__}, whose sources its machine code is kept by; "
                f"got {function.__qualname__} of {function.__module__}: move it there, or compile it with numba.njit"
            )
        super().__init__(function)
        self._function_name = function.__name__
        self._unstamped = self._impl.filename_base
        self._cache_file = _Files(self.cache_path, f"{self._unstamped}-{STAMP}", STAMP)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Load machine code for a signature; if there is none, log that it is compiled."""
        found = super().load_overload(sig, target_context)
        if found is None:
            _tell_that_it_compiles(self._function_name)
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Save machine code, and delete that of other sources."""
        super().save_overload(sig, data)
        function = self._unstamped.split("-")[0]
        for path in Path(self.cache_path).glob(f"{function}-*.nb[ic]"):
            if STAMP not in path.name:
                with contextlib.suppress(OSError):  # another process was quicker, or has it open
                    path.unlink()


def _tell_that_it_compiles(name: str) -> None:
    logger = logging.getLogger("swarm_pz")
    _announce_compilation(logger)
    logger.warning("compiling %s", name)


@cache
def _announce_compilation(logger: logging.Logger) -> None:
    logger.warning(
        "swarm-pz compiles its kernels for this machine, each once, when it is first needed: some seconds, or a minute "
        "on a slow machine (`swarm-pz warmup` does it ahead of time)"
    )
