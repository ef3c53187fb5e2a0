"""Sleep of idle OpenMP threads, PyTorch's among them, which leaves the processor's cores to the game."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
import threading


def limit_spinning() -> None:
    """Let PyTorch's threads sleep soon between two operations, whether or not PyTorch is imported already.

    By default they spin: they wait in a busy loop. A user's choice by `GOMP_SPINCOUNT` or `OMP_WAIT_POLICY` is kept.
    """
    if "GOMP_SPINCOUNT" in os.environ or "OMP_WAIT_POLICY" in os.environ:
        return
    os.environ["GOMP_SPINCOUNT"] = "1000"  # OpenMP reads it once, when PyTorch is imported
    torch = sys.modules.get("torch")
    if torch is not None and sys.platform == "linux":
        with contextlib.suppress(AttributeError, OSError):  # another OpenMP than GNU's, or none
            _outnumber_cores(ctypes.CDLL(torch._C.__file__))


def _outnumber_cores(openmp: ctypes.CDLL) -> None:
    """Keep more sleeping threads than there are cores: GNU's OpenMP then spins briefly (see its GOMP_SPINCOUNT)."""
    parallel = openmp.GOMP_parallel
    count, nothing = openmp.omp_get_num_procs() + 1, ctypes.cast(openmp.omp_get_level, ctypes.c_void_p)
    started = threading.Event()

    def keep() -> None:
        parallel(nothing, None, count, 0)  # a team lasts as long as the thread that began it
        started.set()
        threading.Event().wait()

    threading.Thread(target=keep, name="openmp-crowd", daemon=True).start()
    started.wait()
