"""What a process needs that runs other people's policies: a limit to their time, and an end of its own."""

from __future__ import annotations

import multiprocessing
import multiprocessing.process
import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def alarm(seconds: float) -> Iterator[None]:
    """Interrupt Python code that takes longer, where the system has alarms; elsewhere say so afterwards."""
    late = f"no command within {seconds:g} s"

    def ring(_: int, __: FrameType | None) -> None:
        raise TimeoutError(late)

    began = time.monotonic()
    if hasattr(signal, "SIGALRM") and threading.current_thread() is threading.main_thread():
        before = signal.signal(signal.SIGALRM, ring)
        # Again and again, for the one that catches it.
        signal.setitimer(signal.ITIMER_REAL, seconds, seconds)
        try:
            yield
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)
    else:
        yield
    if time.monotonic() - began > seconds:
        raise TimeoutError(late)


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
