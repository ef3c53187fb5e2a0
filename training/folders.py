"""Folders of runs: a description of an earlier run, so that none is lost, and the next free folder."""

from __future__ import annotations

import itertools
import json
import time
from pathlib import Path

from swarm_pz.errors import CheckpointError, ConfigError, OutputError
from swarm_pz.files import explain
from swarm_pz.policies.learned import CARD
from swarm_pz.training.checkpoint import CHECKPOINT, read_story

LEAGUE, LEARNER, SEARCH = "league.json", "main", "search.json"
SETTINGS = "config.json"
"""Of a run or a league, which are resumed by them."""


def held_by(folder: Path) -> str | None:
    """Return a description of the run in a folder that a new one would replace; None if there is none."""
    try:
        if (folder / LEAGUE).is_file():
            inner = held_by(folder / LEARNER)
            return f"a league, {inner}" if inner else "a league"
        for path in (folder / CHECKPOINT, folder / CARD, folder / SEARCH):
            if path.is_file():
                return f"{_describe(path)} ({time.strftime('%Y-%m-%d %H:%M', time.localtime(path.stat().st_mtime))})"
    except OSError as error:
        raise OutputError(f"cannot look into {str(folder)!r}: {explain(error)}; choose another folder") from error
    return None


def _describe(path: Path) -> str:
    try:
        if path.name == CHECKPOINT:
            story = read_story(path)
            steps, total = story["learner"]["steps"], story["total_steps"]
            return (
                f"a finished run of {steps:,} steps" if story["finished"] else f"a run at step {steps:,} of {total:,}"
            )
        if path.name == SEARCH:
            return f"a search for what beats {json.loads(path.read_text())['target']}"
        return f"a policy trained for {json.loads(path.read_text())['steps']:,} steps"
    except (CheckpointError, LookupError, TypeError, ValueError):
        return f"a file {path.name} that cannot be read"


def check_folder(folder: Path, *, resume: bool, overwrite: bool, mark: str) -> None:
    """Raise a CheckpointError unless a run may begin in a folder, or go on there, where the file `mark` shows a run."""
    held = held_by(folder)
    if resume and not (folder / mark).is_file():
        there = "holds " + held if held else "holds none" if folder.is_dir() else "does not exist"
        raise CheckpointError(
            f"--resume expects a folder with {mark}, which a run leaves: {folder} {there}; "
            "name the run's folder (--out), or begin one without --resume"
        )
    if held and not resume and not overwrite:
        raise CheckpointError(
            f"{folder} holds {held}: go on with it (--resume), replace it (--overwrite), or take a free folder "
            f"(--out {next_free(folder)})"
        )


def _series(first: Path) -> itertools.chain[Path]:
    """Return first, first-2, first-3, ..."""
    following = (first.with_name(f"{first.name}-{number}") for number in itertools.count(2))
    return itertools.chain([first], following)


def next_free(first: Path) -> Path:
    """Return the first of the folders NAME, NAME-2, NAME-3, ... that holds no run."""
    return next(folder for folder in _series(first) if held_by(folder) is None)


def choose(out: Path | None, default: Path, *, resume: bool, overwrite: bool) -> Path:
    """Return the folder that is given, the next free one, or, to resume, the latest."""
    if resume and overwrite:
        raise ConfigError("resume goes on with a run, overwrite replaces it: give one of them")
    if out is not None:
        return out
    if overwrite:
        raise ConfigError("overwrite must say which run to replace: give its folder (--out)")
    if not resume:
        return next_free(default)
    taken = list(itertools.takewhile(lambda folder: held_by(folder) is not None, _series(default)))
    return taken[-1] if taken else default
