"""Progress of commands, and words about them."""

from __future__ import annotations

import functools
import importlib.util
import os
import shlex
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from pathlib import Path

from swarm_pz.config import GameConfig
from swarm_pz.errors import require_extra

Move = Callable[..., None]
QUIET = 60.0
"""Seconds between two lines of progress in a log."""
say = functools.partial(print, flush=True)
arguments: ContextVar[list[str]] = ContextVar("arguments")
"""The words of the command line."""


def command() -> str:
    """Return the command that is being run."""
    return shlex.join(["swarm-pz", *arguments.get()])


def program() -> str:
    """Return the word that calls swarm-pz here: its name, or its path if it is not on PATH."""
    path = Path(sys.argv[0])
    if path.name != "swarm-pz" or shutil.which("swarm-pz") is not None:
        return "swarm-pz"
    return shlex.quote(os.path.relpath(path))


def need(extra: str, *modules: str) -> None:
    """Raise a MissingExtraError, before any work is done, if a module of an extra is missing.

    It does not import modules, since importing some takes seconds.
    """
    for module in modules:
        if importlib.util.find_spec(module) is None:
            require_extra(module, extra)


def print_rules(game: GameConfig, note: str = "") -> None:
    """Print the hash of the rules; results may be compared if it is the same."""
    print(f"rules: {game.rules_hash} {note}".rstrip())


@contextmanager
def progress(what: str = "games", doing: str = "playing") -> Iterator[Move]:
    """Show a progress bar, or a line now and then in a log; yield the function that moves it.

    Its arguments are the amount done, the total, and the unit if it is not `what`.
    """
    from rich.progress import Progress

    bar = Progress(transient=True, refresh_per_second=4)
    bar.disable = not bar.console.is_terminal
    with bar:
        task = bar.add_task(doing, total=None)
        said = time.monotonic()

        def move(done: float, total: float, of: str = what) -> None:
            nonlocal said
            bar.update(task, completed=done, total=total, description=doing if of == what else of)
            if bar.disable and time.monotonic() - said > QUIET:
                said = time.monotonic()
                print(f"{done:,.0f} of {total:,.0f} {of}", flush=True)

        yield move


def in_seconds(doing: str = "filming") -> AbstractContextManager[Move]:
    """Return `progress` in seconds of a game that is played through."""
    return progress("seconds of game at most", doing)
