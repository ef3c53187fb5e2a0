"""Errors of the project.

Every error is a `SwarmError`, and an error of Python's own that fits. `Stopped` stands beside them: a
KeyboardInterrupt that waited until all was saved.
"""

from __future__ import annotations

import difflib
import importlib
import importlib.metadata
import json
import shlex
import sys
from collections.abc import Iterable
from pathlib import Path
from types import ModuleType

NAME = "swarm-pz"
"""The distribution's name."""


class SwarmError(Exception):
    """Base of every error that this project raises on purpose."""


class ConfigError(SwarmError, ValueError):
    """A configuration value is out of range, or a field is unknown."""


class UnknownNameError(ConfigError, TypeError):
    """A keyword or a field is unknown: a ConfigError, and a TypeError as callers of Python expect."""


class CommandError(SwarmError, ValueError):
    """A command, a scenario or a seed is not one that the game can take."""


class GameOverError(SwarmError, RuntimeError):
    """A step of a game that has ended or was never reset."""


class PolicyError(SwarmError, ValueError):
    """A policy is unknown, cannot be loaded, or answered nonsense."""


class ForfeitError(PolicyError):
    """A player's program was late, ended, or answered nonsense: it loses the game."""


class KindError(PolicyError):
    """A policy answers commands of another kind than those that fly its team."""


class FlightError(SwarmError, RuntimeError):
    """A control system raised, returned invalid accelerations, or took too long.

    `team` is 0 for red and 1 for blue. `rows` are the games in which it did, or, if it raised, all that were solved for
    together.
    """

    def __init__(self, team: int, system: str, rows: tuple[int, ...], reason: str) -> None:
        super().__init__(team, system, rows, reason)  # as it was called, so that it can cross processes
        self.team, self.system, self.rows, self.reason = team, system, rows, reason

    def __str__(self) -> str:
        return self.reason


class CheckpointError(SwarmError, ValueError):
    """A file of a training run is corrupt, foreign, or does not fit."""


class ResultsError(SwarmError, ValueError):
    """Results are corrupt, too few to say anything, in use, or belong to another tournament."""


class WorkerError(ResultsError, RuntimeError):
    """A process or a machine that was to play died, cannot be had, or has other versions; finished games are kept."""


class OutputError(SwarmError, OSError):
    """A file cannot be written."""


class RenderError(SwarmError, RuntimeError):
    """A picture cannot be made or shown on this machine."""


class ProtocolError(SwarmError, ValueError):
    """A message or a frame is not one of the protocol."""


class RecordingError(SwarmError, ValueError):
    """A recorded game cannot be read, or plays differently here."""


class MissingExtraError(SwarmError, ImportError):
    """An optional dependency is not installed."""


class Stopped(KeyboardInterrupt):
    """Work was interrupted; all that it did is saved, and the message names the place."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Return a clause that lists `known` and names the entry closest to `name`."""
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"did you mean {close[0]!r}? " if close else ""
    return f"{hint}Known: {', '.join(names)}"


def require_extra(module: str, extra: str) -> ModuleType:
    """Import `module`; raise a MissingExtraError that names its extra of swarm-pz, and the line that installs it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise MissingExtraError(
            f"{module.split('.')[0]} is not installed; install it with: {installing(extra)}"
        ) from error


def installing(extra: str) -> str:
    """Return the line that installs an extra where this swarm-pz came from, for the Python that runs.

    A clone is installed from its folder, with the versions pinned there; a wheel, an archive or a repository
    from where it was fetched; only what came from a registry by its name.
    """
    try:
        origin = json.loads(importlib.metadata.distribution(NAME).read_text("direct_url.json") or "{}")
    except (importlib.metadata.PackageNotFoundError, ValueError):
        origin = {}
    address, wanted = str(origin.get("url", "")), f"{NAME}[{extra}]"
    words = [sys.executable, "-m", "pip", "install"]
    if origin.get("dir_info", {}).get("editable"):
        from urllib.request import url2pathname  # slow to import

        folder = Path(url2pathname(address.removeprefix("file://")))
        if (folder / "constraints.txt").exists():
            words += ["--constraint", str(folder / "constraints.txt")]
        words += ["--editable", f"{folder}[{extra}]"]
    elif "vcs_info" in origin:
        words += [f"{wanted} @ {origin['vcs_info']['vcs']}+{address}@{origin['vcs_info']['commit_id']}"]
    else:
        words += [f"{wanted} @ {address}" if address else wanted]
    return shlex.join(words)
