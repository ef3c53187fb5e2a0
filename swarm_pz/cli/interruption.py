"""Ctrl-C, and SIGTERM the same: stop where nothing is lost, and say how to go on.

A command whose work can be resumed is written so:

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
"""Status of a command that was interrupted, as shells have it."""


@contextmanager
def goes_on_with(line: str) -> Iterator[None]:
    """If the work within is interrupted, say where it stopped and which line goes on, and exit with status 130."""
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
    """Let a first signal wait for the work within, which asks the yielded function now and then; a second one ends it.

    Work that should stop saves what it has and raises `Stopped`. If it ends without having asked, KeyboardInterrupt is
    raised at the end of the block.
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
