"""A dataset's folder as Minari wants it: whole, or not there."""

from __future__ import annotations

import copy
import os
import re
import shutil
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, fields
from importlib.metadata import version
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError, OutputError, ResultsError, require_extra
from swarm_pz.evaluation.ledger import folder_lock
from swarm_pz.evaluation.provenance import provenance
from swarm_pz.files import check_folder
from swarm_pz.spaces.formats import Format, FormatOptions
from swarm_pz.spaces.observation import Observations

_ID = re.compile(r"(?:[A-Za-z0-9][-\w]*/)*[A-Za-z0-9][-\w]*-v[0-9]{1,6}")
_ENVIRONMENT = "swarm_pz/Capture-v0"


@dataclass(frozen=True, kw_only=True)
class Episode:
    """A game of T steps as one seat saw it.

    Attributes
    ----------
    observations : array (T + 1, ...), or dict of these
    actions : array (T, ...)
    rewards : float64 array (T,)
    terminations, truncations : bool array (T,)
    infos : dict of array (T + 1,)
        As the Gymnasium environment gives them.
    seed : int
        Of the game.
    about : dict
        What stands beside the episode, in its metadata.
    """

    observations: Observations
    actions: NDArray[Any]
    rewards: NDArray[np.float64]
    terminations: NDArray[np.bool_]
    truncations: NDArray[np.bool_]
    infos: dict[str, NDArray[Any]]
    seed: int
    about: dict[str, str]


@dataclass(frozen=True, kw_only=True)
class Target:
    """Where a dataset is to be.

    Attributes
    ----------
    name : str
        Its id: names with slashes between them, and a version, such as ``swarm-planner-v0``.
    root : Path, optional
        Folder of datasets; Minari's own if not given.

    Raises
    ------
    ConfigError
        If the id is none.
    OutputError
        If there is something already.
    MissingExtraError
        If Minari is not installed.
    """

    name: str
    root: Path | None = None

    def __post_init__(self) -> None:
        for module in ("minari", "h5py", "PIL", "filelock"):
            require_extra(module, "data")
        if not _ID.fullmatch(self.name):
            raise ConfigError(
                f"name must be letters, digits, - and _, and end with a version, such as swarm-planner-v0, got "
                f"{self.name!r}"
            )
        if os.path.lexists(self.folder):
            raise OutputError(f"{str(self.folder)!r} is there already: give the dataset another name or version")

    @property
    def folder(self) -> Path:
        """Of the dataset."""
        if self.root is not None:
            return self.root / self.name
        folder: Path = require_extra("minari.storage.datasets_root_dir", "data").get_dataset_path(self.name)
        return folder


def name_for(player: str) -> str:
    """Return the usual id of the dataset of a player: what of its name an id may hold, and version 0."""
    words = re.sub(r"[^A-Za-z0-9_]+", "_", Path(player).name if "/" in player else player).strip("_")
    return f"swarm-{words or 'player'}-v0"


class Writer:
    """Takes episodes into a dataset that is being made."""

    def __init__(self, storage: Any, folder: Path) -> None:
        self._storage, self._folder = storage, folder
        self.episodes = 0
        self.steps = 0

    def add(self, episodes: Sequence[Episode]) -> None:
        """Write episodes."""
        buffer = require_extra("minari.data_collector", "data").EpisodeBuffer
        kept = [field.name for field in fields(Episode) if field.name != "about"]
        buffers = [buffer(**{name: getattr(one, name) for name in kept}) for one in episodes]
        numbers = range(self.episodes, self.episodes + len(episodes))
        with _in_words(self._folder):
            self._storage.update_episodes(buffers)
            self._storage.update_episode_metadata([one.about for one in episodes], numbers)
        self.episodes += len(episodes)
        self.steps += sum(len(one.rewards) for one in episodes)


@contextmanager
def new_dataset(
    target: Target,
    form: Format,
    config: GameConfig,
    keywords: Mapping[str, Any],
    options: FormatOptions,
    metadata: Mapping[str, Any],
    command: str = "",
) -> Iterator[Writer]:
    """Give the writer of a dataset, which is there when the block ends and nowhere if it fails.

    Its spaces are those of a form; ``recover_environment`` makes the Gymnasium environment again from the rules,
    `keywords` and `options`. `metadata` is what the dataset says of itself, `command` what was called.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    folder = target.folder
    check_folder(folder.parent)
    spec = copy.deepcopy(gymnasium.spec(_ENVIRONMENT))
    spec.kwargs = {"config": config.to_dict(), **keywords, **options}
    told = {
        "requirements": [f"swarm-pz=={version('swarm-pz')}"],
        "config_hash": config.hash,
        **provenance(config, command),
        "format": dict(options),
        **metadata,
    }
    storages = require_extra("minari.dataset.minari_storage", "data").MinariStorage
    with _alone(folder) as draft:
        with _in_words(folder):
            draft.mkdir(mode=folder.parent.stat().st_mode & 0o777)
            # As they are: Minari would make JPEGs of images.
            storage = storages.new(
                draft / "data", form.observation_space, form.action_space, spec, "hdf5", jpeg_encoding=False
            )
            storage.update_metadata(
                {"dataset_id": target.name, "minari_version": require_extra("minari", "data").__version__, **told}
            )
        yield Writer(storage, folder)
        with _in_words(folder):
            draft.rename(folder)


@contextmanager
def _alone(folder: Path) -> Iterator[Path]:
    """Give where a dataset is drafted, without what a killed process has left; it is gone when the block ends."""
    # Absolute: Minari mistakes the sizes of files whose folder is not.
    place = folder.parent.absolute() / f".{folder.name}.draft"
    with ExitStack() as stack:
        try:
            with _in_words(folder):
                stack.enter_context(folder_lock(place))
        except ResultsError as error:
            raise OutputError(
                f"{str(folder)!r} is being made by another process: wait until it is done, or choose another name"
            ) from error
        stack.callback(shutil.rmtree, place, ignore_errors=True)
        shutil.rmtree(place / "whole", ignore_errors=True)
        yield place / "whole"


@contextmanager
def _in_words(folder: Path) -> Iterator[None]:
    """Turn what keeps a dataset from being written, HDF5's own complaints among it, into words."""
    try:
        yield
    except (OSError, RuntimeError) as error:
        number = getattr(error, "errno", None)
        reason = os.strerror(number).lower() if number else str(error).split("\n")[0]
        raise OutputError(f"cannot write {str(folder)!r}: {reason}") from error
