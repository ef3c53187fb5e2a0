"""Processes that run policies: a time limit, and termination with their parent."""

from __future__ import annotations

import multiprocessing
import multiprocessing.process
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from multiprocessing import resource_tracker
from pathlib import Path
from types import FrameType

_WAITS = Path("/proc/thread-self/schedstat")
"""File of Linux whose second number is the time in ns that a thread has waited for a processor."""
_AGAIN_S = 0.5
"""Maximum seconds until an alarm fires again, if code caught it or could not be interrupted."""


class LostTaskError(BrokenExecutor):
    """One task killed several workers; the pool still works."""


@contextmanager
def alarm(seconds: float) -> Iterator[None]:
    """Raise a TimeoutError in Python code that takes longer; without SIGALRM or outside the main thread, after it.

    Time spent waiting for a busy processor does not count on Linux. Imports and compilation are finished first: an
    interrupt would leave a half-loaded library or a half-compiled function.
    """
    late = f"no command within {seconds:g} s"
    entered = sys._getframe(2)  # the caller's frame; frame 1 is contextlib's

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
    """Return a clock in seconds that stops while this thread waits for a processor."""
    try:
        waited = int(_WAITS.read_bytes().split()[1]) / 1e9
    except (OSError, LookupError, ValueError):  # not on Linux
        waited = 0.0
    return time.monotonic() - waited


def _gets_ready(frame: FrameType | None, until: FrameType | None) -> bool:
    """Return True if this thread compiles, or a call between the frames imports something."""
    numba = sys.modules.get("numba.core.compiler_lock")
    if numba is not None and numba.global_compiler_lock.is_locked():  # by this thread
        return True
    while frame is not None and frame is not until:
        if frame.f_code.co_filename.startswith("<frozen importlib."):
            return True
        frame = frame.f_back
    return False


@contextmanager
def interrupts_blocked() -> Iterator[None]:
    """Start processes with SIGINT blocked, until `prepare_process` ignores it."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    resource_tracker.ensure_running()  # started later, it would unblock SIGINT
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def prepare_process() -> None:
    """Make this process end with its parent, ignore Ctrl-C, and use one core."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        # A terminal sends Ctrl-C to all processes; only the one that distributes the work handles it.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        if hasattr(signal, "pthread_sigmask"):
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})

        def end_with(parent: multiprocessing.process.BaseProcess) -> None:
            parent.join()
            os._exit(1)

        threading.Thread(target=end_with, args=(parent,), daemon=True).start()
    # PyTorch and others read this when their thread pools are loaded.
    os.environ["OMP_NUM_THREADS"] = "1"
