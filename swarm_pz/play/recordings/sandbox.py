"""A process of its own for recordings of strangers, so that a forged one cannot end the server.

A recording says which rules to simulate. What reads and simulates it runs in this process, with little time and memory.
If that process dies, its death is an error that names the file.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

from swarm_pz.errors import RecordingError, SwarmError

SECONDS, MEMORY = 300, 4 * 2**30
"""Processor time that a piece of work may take between two signs of progress, and bytes of the process."""
_HANGS_S = 10 * SECONDS
"""Seconds after which a process that shows no progress is ended, however busy the machine."""
T = TypeVar("T")


class Sandbox:
    """A process that does one piece of work after the other; a context, at whose end the process ends.

    It is started by its first work, and anew after it died.
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._lock = threading.Lock()
        self._is_closed = False

    def __enter__(self) -> Sandbox:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the process, whatever it is at; any thread may ask."""
        self._is_closed = True
        if (process := self._process) is not None:
            process.kill()
        with self._lock:
            self._end()

    def do(
        self, name: str | Path, work: Callable[..., T], *given: Any, progress: Callable[..., None] | None = None
    ) -> T:
        """Return what some work, a function of a module, returns for arguments that can be pickled.

        `name` is the recording's, for errors. `progress` is called here with what the work tells; the work is then
        given one, too, as its last argument. Raises RecordingError if the process died of the work, or the work raised
        what is no SwarmError; those are raised as they are.
        """
        with self._lock:
            process, is_done = self._started(), False
            try:
                is_raised, answer = _answer_of(process, (work, given, progress is not None), progress)
                is_done = True
            except (EOFError, OSError, pickle.UnpicklingError) as error:
                raise RecordingError("the server is ending" if self._is_closed else _death(name, process)) from error
            finally:
                if not is_done:
                    self._end()
        if not is_raised:
            return cast("T", answer)
        if isinstance(answer, SwarmError):
            raise answer
        raise RecordingError(f"{name} cannot be played again: {answer}; ask for it again where it is from")

    def _started(self) -> subprocess.Popen[bytes]:
        if self._is_closed:
            raise RecordingError("the server is ending")
        if self._process is None:
            # As multiprocessing would, but without the caller's main module, which need not be made for that.
            path = os.pathsep.join(filter(None, sys.path))
            self._process = subprocess.Popen(  # noqa: S603
                [sys.executable, "-P", "-c", f"from {__name__} import _main; _main()"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
                env=os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": path},
            )
        return self._process

    def _end(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.kill()
            with contextlib.suppress(OSError):  # what was not sent
                process.communicate()


def _answer_of(
    process: subprocess.Popen[bytes], asked: tuple[Any, ...], progress: Callable[..., None] | None
) -> tuple[bool, Any]:
    """Ask a process for work; return whether it raised, and what it raised or returned."""
    assert process.stdin is not None and process.stdout is not None  # noqa: S101
    is_over = False
    while not is_over:
        clock = threading.Timer(_HANGS_S, process.kill)
        clock.daemon = True
        clock.start()
        try:
            if asked:
                process.stdin.write(pickle.dumps(asked))
                process.stdin.flush()
                asked = ()
            is_over, is_raised, answer = pickle.load(process.stdout)  # noqa: S301  (of our own process)
        finally:
            clock.cancel()
        if not is_over and progress is not None:
            progress(*answer)
    return is_raised, answer


def _death(name: str | Path, process: subprocess.Popen[bytes]) -> str:
    """Say of what a process died."""
    with contextlib.suppress(subprocess.TimeoutExpired):
        process.wait(5)  # its pipe closes before it is dead, and killed now, it would seem to have been given up
    process.kill()
    status = process.wait()
    if status in (-getattr(signal, "SIGPROF", 0), -getattr(signal, "SIGKILL", 0)):
        return (
            f"{name} was given up: playing it again took more than {SECONDS} s of processor time or {MEMORY >> 30} GiB "
            "of memory; nothing else has suffered"
        )
    names = {-number: number.name for number in signal.Signals}
    return (
        f"{name} ended the process that played it again ({names.get(status, status)}): it was forged or damaged; "
        "nothing else has suffered. Ask for it again where it is from, and report it if it is a game of your own"
    )


# --- in the process -------------------------------------------------------------------------------


def _main() -> None:
    """Do what is asked for on standard input, until that is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal sends it to all; who asked decides
    asked, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever a library prints is no answer
    with contextlib.suppress(ImportError, ValueError, OSError):
        import resource  # not on every system

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    def answer(*told: Any) -> None:
        answers.write(pickle.dumps(told))
        answers.flush()
        _renew()

    with contextlib.suppress(EOFError):
        while True:
            work, given, tells = pickle.load(asked)  # noqa: S301
            _renew()
            if tells:
                given = (*given, lambda *so_far: answer(False, False, so_far))
            try:
                result = False, work(*given)
            except MemoryError:
                result = True, f"it takes more than {MEMORY >> 30} GiB of memory"
            except SwarmError as error:
                result = True, error
            except Exception as error:
                words = str(error).strip().partition("\n")[0][:300]
                result = True, f"{type(error).__name__}: {words}"
            answer(True, *result)


def _renew() -> None:
    """Let the process die after so much more work; programs that it starts have their own time."""
    if hasattr(signal, "ITIMER_PROF"):
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
