"""What a process needs that runs other people's policies: a limit to their time, and an end of its own."""

from __future__ import annotations

import multiprocessing
import multiprocessing.process
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

_WAITS = Path("/proc/thread-self/schedstat")
"""Where Linux tells how long a thread waited for a processor: the second number, in nanoseconds."""


_AGAIN_S = 0.5
"""Seconds at most between two rings of an alarm, for code that catches one or must not be interrupted yet."""


@contextmanager
def alarm(seconds: float) -> Iterator[None]:
    """Interrupt Python code that takes longer, where the system has alarms; elsewhere say so afterwards.

    What is waited for a processor that others keep busy does not count, where the system tells it: who is late is late
    on an idle machine, too. Imports and compilation are never interrupted, since half of a library, or of a function,
    would be left behind for all who use it later; code that is late by them is interrupted when they are done.
    """
    late = f"no command within {seconds:g} s"
    entered = sys._getframe(2)  # of who calls this; the first is contextlib's

    def ring(_: int, frame: FrameType | None) -> None:
        if _own_time() - began > seconds and not _gets_ready(frame, entered):
            raise TimeoutError(late)

    began = _own_time()
    if hasattr(signal, "SIGALRM") and threading.current_thread() is threading.main_thread():
        before = signal.signal(signal.SIGALRM, ring)
        signal.setitimer(signal.ITIMER_REAL, seconds, min(seconds, _AGAIN_S))
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)
    else:
        yield
    if _own_time() - began > seconds:
        raise TimeoutError(late)


def _own_time() -> float:
    """Return seconds that pass while this thread works or sleeps, and not while it waits for a processor."""
    try:
        waited = int(_WAITS.read_bytes().split()[1]) / 1e9
    except (OSError, LookupError, ValueError):  # not every system tells
        waited = 0.0
    return time.monotonic() - waited


def _gets_ready(frame: FrameType | None, until: FrameType | None) -> bool:
    """Return whether something is being imported or compiled by what was called after a frame."""
    numba = sys.modules.get("numba.core.compiler_lock")
    if numba is not None and numba.global_compiler_lock.is_locked():  # by this thread
        return True
    while frame is not None and frame is not until:
        if frame.f_code.co_filename.startswith("<frozen importlib."):
            return True
        frame = frame.f_back
    return False


def _end_with(parent: multiprocessing.process.BaseProcess) -> None:
    parent.join()
    os._exit(1)


def end_processes() -> None:
    """End the processes that this one started, whatever they are at."""
    for process in multiprocessing.active_children():
        process.terminate()


def prepare_process() -> None:
    """Make ready: end with the process that started this one, not by Ctrl-C, and leave other cores to others."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        # A terminal sends it to all of them; what becomes of the work is for the one that shares it out.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    # Read by PyTorch's and others' thread pools when they are first loaded.
    os.environ["OMP_NUM_THREADS"] = "1"
