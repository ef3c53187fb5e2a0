"""Where machine code is kept, and the stamp that says of which sources it is.

A compiled function holds the code of all that it calls and the value of every constant that it names. So
its machine code is of the sources of the whole package `swarm_pz.kernels`, folders within it too, and of
`swarm_pz.config`, whose constants kernels take; they may take nothing from elsewhere.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import llvmlite.binding
import numba
from numba.core.caching import FunctionCache, IndexDataCacheFile

from swarm_pz.errors import SwarmError

SOURCES = ("kernels", "config")
"""What machine code is of: modules of swarm_pz, or packages with all that is in them."""


def sources(package: Path) -> list[Path]:
    """Return the files that machine code is of, in the folder of swarm_pz or a copy of it."""
    return sorted(path for name in SOURCES for path in (*package.glob(f"{name}.py"), *package.glob(f"{name}/**/*.py")))


def stamp_of(package: Path) -> str:
    """Return a digest of the names and texts of those files."""
    digest = hashlib.sha256()
    for path in sources(package):
        text = path.read_bytes()
        digest.update(f"{path.relative_to(package).as_posix()} {len(text)}\n".encode())
        digest.update(text)
    return digest.hexdigest()[:16]


STAMP = stamp_of(Path(__file__).parents[1])
"""Of the sources as this process found them."""


def processor() -> str:
    """Return the kind of processor that machine code is made for; on another a game may go another way."""
    return str(getattr(numba.config, "CPU_NAME", None) or llvmlite.binding.get_host_cpu_name())


class _Files(IndexDataCacheFile):
    """numba's files of a function's machine code, each called by the arguments that its code takes.

    numba numbers them. Of two processes that compile a function at once for other arguments, both would take the
    same number, and the index of one could then lead to the code of the other.
    """

    def save(self, key: Any, data: Any) -> None:
        """Keep machine code in a file that no other arguments have."""
        name, arguments = self._index_name.removesuffix(".nbi"), hashlib.sha256(repr(key).encode()).hexdigest()[:16]
        self._data_name_pattern = f"{name}-{arguments}.{{number}}.nbc"
        super().save(key, data)


class StampedCache(FunctionCache):
    """numba's cache of a function's machine code, in files that carry the stamp in their names.

    numba's own looks at the file of the function alone, and would miss a change in a kernel that it calls.
    Files of other sources are never opened: they may name classes that are there no more, and numba writes an
    index before the code that it lists, so that an old file could be taken for a new one.

    Raises
    ------
    SwarmError
        If the function is not one of `swarm_pz.kernels`, since its own file would not be stamped.
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
        """Load machine code for a signature, or say that it is compiled."""
        found = super().load_overload(sig, target_context)
        if found is None:
            _tell_that_it_compiles(self._function_name)
        return found

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep machine code, and no longer what is of other sources."""
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
