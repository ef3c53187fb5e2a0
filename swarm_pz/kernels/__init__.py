"""The rules of the game as plain functions over the arrays of ONE game, compiled by numba.

================  ==========================================================
`fourier`         cosine and sine tables of a drone's path
`ergodic`         the ergodic controller: targets and past -> accelerations
`communication`   the same where not everybody hears everybody
`flocking`        the flocking controller: attractors -> accelerations
`dynamics`        motion of the point masses
`capture`         capture field and who is captured
`reconstruction`  the capture field of the preset `released`
`trails`          trails, and what they add to the capture field
`chance`          random numbers within a game
`game`            one game's tick in the order of the rules, and a loop over games
`grids`           one seat's grid observation
`phases`          parts of a control period, for measuring
================  ==========================================================

Change a rule by changing its function: the compiled code is rebuilt whenever any file of this
package changes.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from numba import njit

Function = TypeVar("Function", bound=Callable[..., Any])

# Of fast math, what neither hides faults (NaN and infinity stay) nor lets bits depend on where arrays
# lie in memory: compilers choose between scalar and vector loops at run time, and only sums that may
# be reordered tell the two apart.
_FASTMATH = {"contract", "nsz", "arcp"}


def kernel(function: Function) -> Function:
    """Compile a function that other kernels call."""
    compiled: Any = njit(nogil=True, fastmath=_FASTMATH, error_model="numpy")(function)
    return compiled  # type: ignore[no-any-return]


def reduction(function: Function) -> Function:
    """Compile a kernel whose sums may be reordered, which is what lets them become vector sums.

    Its inner loops must only read, so that there is but one way to run them.
    """
    compiled: Any = njit(nogil=True, fastmath=_FASTMATH | {"reassoc"}, error_model="numpy")(function)
    return compiled  # type: ignore[no-any-return]


def entry_point(function: Function) -> Function:
    """Compile a function that Python calls, and keep the machine code on disk.

    numba's cache looks at the file of the function alone and would miss a change in a kernel that
    it calls, so the cache is stamped with the text of the whole package and of the constants in config.
    """
    compiled: Any = njit(nogil=True, fastmath=_FASTMATH, error_model="numpy", cache=True)(function)
    if hasattr(compiled, "_cache"):  # not with NUMBA_DISABLE_JIT=1, which leaves plain Python
        compiled._cache._cache_file._source_stamp = _sources_digest()
        load = compiled._cache.load_overload

        def load_or_tell(signature: Any, target: Any) -> Any:
            found = load(signature, target)
            if found is None:
                _tell_that_it_compiles(function.__name__)
            return found

        compiled._cache.load_overload = load_or_tell
    return compiled  # type: ignore[no-any-return]


def _tell_that_it_compiles(name: str) -> None:
    logger = logging.getLogger("swarm_pz")
    _announce_compilation(logger)
    logger.warning("compiling %s", name)


@cache
def _announce_compilation(logger: logging.Logger) -> None:
    logger.warning(
        "swarm-pz compiles its kernels for this machine: once, in one to two minutes "
        "(`swarm-pz warmup` does it ahead of time)"
    )


@cache
def _sources_digest() -> str:
    digest = hashlib.sha256()
    folder = Path(__file__).parent
    for path in [*sorted(folder.glob("*.py")), folder.parent / "config.py"]:
        digest.update(path.read_bytes())
    return digest.hexdigest()
