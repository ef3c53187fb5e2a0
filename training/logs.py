"""Loggers of a run's curves: TensorBoard's files, and trackers of experiments, which no extra of swarm-pz installs."""

from __future__ import annotations

import importlib
import importlib.util
import secrets
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stable_baselines3.common.logger import KVWriter, Logger, TensorBoardOutputFormat

from swarm_pz.errors import ConfigError, MissingExtraError, nearest
from swarm_pz.files import draft_of

TENSORBOARD, RUN_NAME = "tensorboard", "run_name.txt"
LOGS = (TENSORBOARD, "trackio", "wandb")


def check_logs(names: Sequence[str]) -> None:
    """Raise a ConfigError of a name that is not in `LOGS`, or a MissingExtraError of what is not installed."""
    for name in names:
        if name not in LOGS:
            raise ConfigError(f"log must be names with commas between them, got {name!r}; {nearest(name, LOGS)}")
        if importlib.util.find_spec(name) is None:
            line = shlex.join([sys.executable, "-m", "pip", "install", name])
            raise MissingExtraError(f"{name} is not installed; install it with: {line}")


def open_logs(names: Sequence[str], folder: Path, settings: dict[str, Any]) -> Logger:
    """Return the logger of one sitting of the run in a folder."""
    files = [TensorBoardOutputFormat(str(folder / TENSORBOARD))] if TENSORBOARD in names else []
    return Logger(None, [*files, *(_Tracker(name, folder, settings) for name in names if name != TENSORBOARD)])


class _Tracker(KVWriter):
    """Writes to trackio or wandb, which are called alike; a resumed run goes on under the name in its folder."""

    def __init__(self, name: str, folder: Path, settings: dict[str, Any]) -> None:
        path = folder / RUN_NAME
        if not path.exists():
            with draft_of(path) as draft:
                draft.write_text(f"{folder.resolve().name}-{secrets.token_hex(4)}")
        run = path.read_text()
        more = {"id": run[-8:], "dir": str(folder)} if name == "wandb" else {}
        self._tracker = importlib.import_module(name)
        try:
            self._run = self._tracker.init(project="swarm-pz", name=run, config=settings, resume="allow", **more)
        except Exception as error:  # of any type
            raise ConfigError(f"{name} cannot begin a run: {error}; set {name} up, or leave it out of --log") from error

    def write(self, key_values: dict[str, Any], key_excluded: dict[str, tuple[str, ...]], step: int = 0) -> None:
        self._run.log({key: float(value) for key, value in key_values.items()}, step=step)

    def close(self) -> None:
        self._tracker.finish()  # and not the run: trackio would end that again as the program ends
