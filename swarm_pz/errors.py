"""Errors of the project.

Every error is a `SwarmError` and a fitting built-in exception, except `Stopped`: a
KeyboardInterrupt, raised once all that can be kept is saved.
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
    """A keyword or a field is unknown: a ConfigError, and also the TypeError that Python raises."""


class CommandError(SwarmError, ValueError):
    """A command, a scenario or a seed is not valid in this game."""


class GameOverError(SwarmError, RuntimeError):
    """A step of a game that has ended or was never reset."""


class PolicyError(SwarmError, ValueError):
    """A policy is unknown, cannot be loaded, or returned invalid commands."""


class ForfeitError(PolicyError):
    """A player's program was late, ended, or sent an invalid answer: it loses the game."""


class KindError(PolicyError):
    """A policy returns commands of a kind that its team's control system does not take."""


class FlightError(SwarmError, RuntimeError):
    """A control system raised, returned invalid accelerations, or took too long.

    `team` is 0 for red and 1 for blue. `rows` are the games with invalid accelerations, or else all games of
    that call.
    """

    def __init__(self, team: int, system: str, rows: tuple[int, ...], reason: str) -> None:
        super().__init__(team, system, rows, reason)  # its own arguments, so that it can be pickled
        self.team, self.system, self.rows, self.reason = team, system, rows, reason

    def __str__(self) -> str:
        return self.reason


class CheckpointError(SwarmError, ValueError):
    """A file of a training run is corrupt, foreign, or does not fit."""


class ResultsError(SwarmError, ValueError):
    """Results are corrupt, too few to say anything, in use, or belong to another tournament."""


class WorkerError(ResultsError, RuntimeError):
    """A worker process or machine died, cannot be reached, or has other versions; finished games are kept."""


class OutputError(SwarmError, OSError):
    """A file cannot be written."""


class RenderError(SwarmError, RuntimeError):
    """A picture cannot be made or shown on this machine."""


class ProtocolError(SwarmError, ValueError):
    """A message or a frame breaks the protocol."""


class RecordingError(SwarmError, ValueError):
    """A recorded game cannot be read, or plays differently here."""


class MissingExtraError(SwarmError, ImportError):
    """An optional dependency is not installed."""


class Stopped(KeyboardInterrupt):
    """Work was interrupted; what can be kept is saved, and the message says how far it got."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Return a clause that lists `known` and names the entry closest to `name`."""
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"did you mean {close[0]!r}? " if close else ""
    return f"{hint}Known: {', '.join(names)}"


def require_extra(module: str, extra: str) -> ModuleType:
    """Import `module`, or raise a MissingExtraError with the command that installs its extra of swarm-pz."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise MissingExtraError(
            f"{module.split('.')[0]} is not installed; install it with: {installing(extra)}"
        ) from error


def installing(extra: str) -> str:
    """Return the command that installs an extra from this swarm-pz's source, for the Python that runs.

    A clone is installed from its folder, with the versions pinned there. A wheel, an archive or a repository is
    installed from its address, and a package from a registry by its name.
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
