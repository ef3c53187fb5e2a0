"""Progress of commands, and the files that they leave behind."""

from __future__ import annotations

import functools
import importlib.util
import json
import os
import shlex
import shutil
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any

from swarm_pz.config import GameConfig
from swarm_pz.errors import require_extra
from swarm_pz.evaluation.provenance import provenance
from swarm_pz.files import draft_of

Move = Callable[..., None]
QUIET = 60.0
"""Seconds without a word that a log may have."""
say = functools.partial(print, flush=True)
arguments: ContextVar[list[str]] = ContextVar("arguments")
"""The words of the command line."""


def command() -> str:
    """Return the command that is being run."""
    return shlex.join(["swarm-pz", *arguments.get()])


def program() -> str:
    """Return the word that calls swarm-pz here: its name, or its place where it is not on the path."""
    called = Path(sys.argv[0])
    if called.name != "swarm-pz" or shutil.which("swarm-pz") is not None:
        return "swarm-pz"
    return shlex.quote(os.path.relpath(called))


def need(extra: str, *modules: str) -> None:
    """Raise MissingExtraError if a module is missing that an extra installs: before any work is done.

    It looks for modules and does not import them, since importing some takes seconds.
    """
    for module in modules:
        if importlib.util.find_spec(module) is None:
            require_extra(module, extra)


def print_rules(game: GameConfig, note: str = "") -> None:
    """Say which rules were played, once they were: results may be compared where they are the same."""
    print(f"rules: {game.rules_hash} {note}".rstrip())


@contextmanager
def progress(what: str = "games", doing: str = "playing") -> Iterator[Move]:
    """Show a bar while games are played, or a line now and then in a log; give the function that moves it.

    That takes how much is done, how much there is, and of what, if that is something else.
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
    """As `progress`, while something goes through a game from its beginning to its end."""
    return progress("seconds of game at most", doing)


def write_json(figures: dict[str, Any], path: Path, game: GameConfig) -> None:
    """Write figures and where they come from to a file, and say where they are."""
    with draft_of(path) as draft:
        draft.write_text(json.dumps(figures | provenance(game, command()), indent=2) + "\n")
    print(f"figures: {path}")
