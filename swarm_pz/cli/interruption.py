"""Ctrl-C and SIGTERM: stop where nothing is lost, and print how to continue.

Write a command whose work can be resumed like this:

    with goes_on_with(command()):
        with stops_at_safe_points() as should_stop:
            while work_is_left:
                do_and_save_some()
                if should_stop():
                    raise Stopped("12 of 40 games are in runs/ladder")
        draw_what_was_saved()  # a signal here ends it at once
"""

from __future__ import annotations

import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from swarm_pz.cli import report
from swarm_pz.errors import Stopped

SIGNALS = (signal.SIGINT, signal.SIGTERM)
STOPPED = 130
"""Exit status of an interrupted command, as in shells."""


@contextmanager
def goes_on_with(line: str) -> Iterator[None]:
    """On an interrupt, print where the work stopped and the command that continues it, and exit with status 130."""
    with _handled(signal.default_int_handler):
        try:
            yield
        except KeyboardInterrupt as interrupt:
            where = f": {interrupt}" if isinstance(interrupt, Stopped) else ""
            typed = line.replace("swarm-pz", report.program(), 1)
            print(f"\nstopped{where}\ngo on with: {typed}", file=sys.stderr, flush=True)
            sys.exit(STOPPED)


@contextmanager
def stops_at_safe_points() -> Iterator[Callable[[], bool]]:
    """Yield a function that returns True after a first signal, for the work to call often; a second one ends the work.

    Work that should stop saves its results and raises `Stopped`. If it ends otherwise after a signal, the block raises
    a KeyboardInterrupt.
    """
    signals = 0

    def note(*_: Any) -> None:
        nonlocal signals
        signals += 1
        if signals > 1:
            raise KeyboardInterrupt
        print("\nstopping at the next safe point (once more: at once)", file=sys.stderr, flush=True)

    with _handled(note):
        yield lambda: signals > 0
    if signals:
        raise KeyboardInterrupt


@contextmanager
def _handled(handler: Callable[[int, Any], Any]) -> Iterator[None]:
    before = {number: signal.signal(number, handler) for number in SIGNALS}
    try:
        yield
    finally:
        for number, previous in before.items():
            signal.signal(number, previous)
