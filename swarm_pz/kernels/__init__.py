"""The rules of the game as plain functions over the arrays of ONE game, compiled by numba.

================  ==========================================================
`controllers`     the controllers: commands and the past -> accelerations
`swarm`           the drones of a game, as controllers see them
`lanes`           vectors of sixteen numbers
`fourier`         cosine and sine tables of a drone's path
`dynamics`        motion of the point masses
`capture`         the capture field, and which drones it captures
`reconstruction`  the capture field of the preset `released`
`trails`          trails, and what they add to the capture field
`rng`             random numbers within a game
`game`            one game's tick in the order of the rules, and a loop over games
`step`            one call a step: commands, ticks and a report
`observation`     one side's grid observation, or its lists of drones
`sight`           observations of drones that are agents
`painting`        strokes of a brush on an image
`arrays`          types of arrays
`assignment`      which drone takes which slot of a formation
`compiler`        how kernels are compiled
`cache`           the sources for which machine code is kept
================  ==========================================================

Change a rule by changing its function: the compiled code is rebuilt whenever any file of this
package or of `swarm_pz.config` changes. All kernels whose machine code is kept must be in this package.
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

# The parts of fast math that keep NaN and infinity, which show faults, and whose results do not depend on where
# arrays lie in memory: compiled code chooses scalar or vector loops at run time, which differ only in sums that
# may be reordered.
_FASTMATH = {"contract", "nsz", "arcp"}


def kernel(function: Function) -> Function:
    """Compile a function that other kernels call."""
    return _compiled(Part, function, _FASTMATH)


def loop(function: Function) -> Function:
    """Compile a kernel that neither makes nor returns arrays; others are refused.

    numba counts the references to arrays, which takes longer than many loops; in these functions it does not.
    """
    return _compiled(Part, function, _FASTMATH, _nrt=False)


def reduction(function: Function) -> Function:
    """Compile a kernel whose sums may be reordered, and so become vector sums.

    Its inner loops must only read, so that there is only one way to run them.
    """
    return _compiled(Part, function, _FASTMATH | {"reassoc"})


def entry_point(function: Function) -> Function:
    """Compile a function that Python calls, and keep the machine code on disk until a source changes; see `cache`."""
    return _compiled(EntryPoint, function, _FASTMATH)


def code_for(function: Callable[..., None], *arguments: object) -> Callable[..., None]:
    """Return an entry point's machine code for arguments of these types, with arrays in C order.

    It does not check its arguments, which can take longer than a kernel: other types make it crash.
    """
    types: Callable[..., Callable[..., None]] | None = getattr(function, "compile", None)
    return function if types is None else types(tuple(map(numba.typeof, arguments)))


def exact(function: Function) -> Function:
    """Compile an entry point without fast math, so that it rounds as NumPy does; it calls kernels of `exact_part`."""
    return _compiled(EntryPoint, function, set())


def exact_part(function: Function) -> Function:
    """Compile a kernel without fast math, so that it rounds as NumPy does."""
    return _compiled(Part, function, set())


def _compiled(kind: type[Part | EntryPoint], function: Function, fastmath: set[str], **options: bool) -> Function:
    if numba.config.DISABLE_JIT:  # type: ignore[attr-defined]  # plain Python then, for debuggers
        return function
    options |= {"nopython": True, "nogil": True}
    return kind(function, fastmath=fastmath, error_model="numpy", **options)  # type: ignore[return-value]
