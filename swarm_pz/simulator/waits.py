"""Short waits of PyTorch's threads, which leave the processor's cores to the game."""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
import threading

_CHOICES = ("GOMP_SPINCOUNT", "OMP_WAIT_POLICY")
"""How users say how long OpenMP's threads wait."""


def shorten_waits() -> None:
    """Make PyTorch's idle threads sleep soon, whether it is imported already or later.

    Between two operations PyTorch's threads, which are OpenMP's, wait in a busy loop. Beside other work they
    keep the game off the cores. Nothing happens where the user has chosen by `GOMP_SPINCOUNT` or `OMP_WAIT_POLICY`.
    """
    if any(name in os.environ for name in _CHOICES):
        return
    os.environ["GOMP_SPINCOUNT"] = "1000"  # OpenMP reads it once, when PyTorch is imported
    torch = sys.modules.get("torch")
    if torch is not None and sys.platform == "linux":
        with contextlib.suppress(AttributeError, OSError):  # another OpenMP than GNU's, or none
            _crowd(ctypes.CDLL(torch._C.__file__))


def _crowd(openmp: ctypes.CDLL) -> None:
    """Start more OpenMP threads than there are cores; they sleep.

    GNU's OpenMP documents that waits are short then (GOMP_SPINCOUNT), and has no function that makes them so.
    """
    parallel = openmp.GOMP_parallel
    count, nothing = openmp.omp_get_num_procs() + 1, ctypes.cast(openmp.omp_get_level, ctypes.c_void_p)
    started = threading.Event()

    def keep() -> None:
        parallel(nothing, None, count, 0)  # a team lasts as long as the thread that began it
        started.set()
        threading.Event().wait()

    threading.Thread(target=keep, name="openmp-crowd", daemon=True).start()
    started.wait()
