"""The rules of the game as plain functions over the arrays of ONE game, compiled by numba.

================  ==========================================================
`controllers`     the controllers: commands and the past -> accelerations
`swarm`           the drones of a game, as controllers see them
`lanes`           sixteen numbers that are computed with at once
`fourier`         cosine and sine tables of a drone's path
`dynamics`        motion of the point masses
`capture`         capture field and who is captured
`reconstruction`  the capture field of the preset `released`
`trails`          trails, and what they add to the capture field
`rng`             random numbers within a game
`game`            one game's tick in the order of the rules, and a loop over games
`step`            one call a step: commands, ticks, and how it went
`observation`     one side's grid observation, or its lists of drones
`sight`           what drones that are agents see
`painting`        strokes of a brush on an image
`arrays`          arrays by the type of their numbers
`assignment`      who takes which place of a formation
`compiler`        how kernels are compiled
`cache`           until when machine code is kept
================  ==========================================================

Change a rule by changing its function: the compiled code is rebuilt whenever any file of this
package or of `swarm_pz.config` changes. All that is compiled and kept stands here.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any, TypeVar

import numba

try:
    from swarm_pz.kernels.compiler import EntryPoint, Part
except ImportError as missing:
    EntryPoint = Part = numba.jit  # type: ignore[assignment,misc]
    logging.getLogger("swarm_pz").warning(
        "numba %s is not a version that swarm-pz was tested with (%s): games are the same, but every process compiles "
        "its kernels anew, which takes a minute; `pip install swarm-pz` brings a version that fits",
        numba.__version__,
        missing,
    )

Function = TypeVar("Function", bound=Callable[..., Any])

# Of fast math, what neither hides faults (NaN and infinity stay) nor lets bits depend on where arrays
# lie in memory: compilers choose between scalar and vector loops at run time, and only sums that may
# be reordered tell the two apart.
_FASTMATH = {"contract", "nsz", "arcp"}


def kernel(function: Function) -> Function:
    """Compile a function that other kernels call."""
    return _compiled(Part, function, _FASTMATH)


def loop(function: Function) -> Function:
    """Compile a kernel that makes no arrays and returns none, else it is refused.

    numba counts the users of arrays, which takes longer than many a loop; of these functions' arrays it does not.
    """
    return _compiled(Part, function, _FASTMATH, _nrt=False)


def reduction(function: Function) -> Function:
    """Compile a kernel whose sums may be reordered, which is what lets them become vector sums.

    Its inner loops must only read, so that there is but one way to run them.
    """
    return _compiled(Part, function, _FASTMATH | {"reassoc"})


def entry_point(function: Function) -> Function:
    """Compile a function that Python calls, and keep the machine code on disk until a source changes; see `cache`."""
    return _compiled(EntryPoint, function, _FASTMATH)


def code_for(function: Callable[..., None], *arguments: object) -> Callable[..., None]:
    """Return an entry point's machine code for arguments of the types of these, of arrays in C order.

    It does not look at each argument first, which can take longer than a kernel: others than these make it crash.
    """
    types: Callable[..., Callable[..., None]] | None = getattr(function, "compile", None)
    return function if types is None else types(tuple(map(numba.typeof, arguments)))


def exact(function: Function) -> Function:
    """Compile an entry point without fast math, so that it rounds as NumPy does; its own parts are of `exact_part`."""
    return _compiled(EntryPoint, function, set())


def exact_part(function: Function) -> Function:
    """Compile a kernel without fast math, which entry points without it call."""
    return _compiled(Part, function, set())


def _compiled(kind: type[Part | EntryPoint], function: Function, fastmath: set[str], **options: bool) -> Function:
    if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]  # plain Python then, for debuggers
        return function
    options |= {"nopython": True, "nogil": True}
    return kind(function, fastmath=fastmath, error_model="numpy", **options)  # type: ignore[return-value]
