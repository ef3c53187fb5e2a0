"""Policies on their way to other machines: the files of their folders, and a loader that checks them there."""

from __future__ import annotations

import platform
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from swarm_pz.config import GameConfig
from swarm_pz.config.installed import FAULTS
from swarm_pz.errors import PolicyError, WorkerError
from swarm_pz.files import draft_of, explain
from swarm_pz.policy import Player, digest_of, load

MOST_BYTES = 2**26
"""Of the files of a bundle."""


@dataclass(frozen=True)
class PolicyBundle:
    """The files of a policy's folder: its name, and name and content of each, without folders in it."""

    name: str
    files: tuple[tuple[str, bytes], ...]

    @classmethod
    def of(cls, folder: Path) -> PolicyBundle:
        """Read a folder; raise a PolicyError if its files are too large to travel, or cannot be read."""
        try:
            found = (path for path in folder.iterdir() if path.is_file() and not path.name.startswith("."))
            paths = sorted(found, key=lambda path: (path.suffix == ".json", path.name))  # a card never stands alone
            size = sum(path.stat().st_size for path in paths)
            if size > MOST_BYTES:
                raise PolicyError(
                    f"{folder} is too large for the way to other machines: expected {MOST_BYTES:,} bytes or fewer, got "
                    f"{size:,}; name a folder with the policy's own files alone"
                )
            return cls(folder.resolve().name, tuple((path.name, path.read_bytes()) for path in paths))
        except OSError as error:
            raise PolicyError(f"{folder} cannot be read: {explain(error)}") from error

    def unpack(self, where: Path) -> Path:
        """Write the folder into another one; return where it is."""
        folder = where / self.name
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in self.files:
            with draft_of(folder / name) as draft:
                draft.write_bytes(content)
        return folder


@dataclass(frozen=True)
class VerifyingLoader:
    """Loads players, perhaps on another machine, and refuses those whose digest differs from the expected one.

    `bundles` has the files of players from folders; `loader` loads the others.
    """

    loader: Callable[[str, GameConfig], Player]
    digests: Mapping[str, str]
    bundles: dict[str, PolicyBundle]

    def __call__(self, name: str, game: GameConfig) -> Player:
        """Load a player; raise a WorkerError if it cannot be made here, or has another digest."""
        try:
            if name in self.bundles:
                with tempfile.TemporaryDirectory(prefix="swarm-pz-") as place:
                    player = load(self.bundles[name].unpack(Path(place)), game)
            else:
                player = self.loader(name, game)
        except FAULTS as error:  # no game is lost by that
            raise WorkerError(f"{platform.node()} cannot load {name}: {error!r}") from error
        expected = self.digests.get(name)
        if expected is not None and (found := digest_of(name, player)) != expected:
            raise WorkerError(
                f"{name} changed on {platform.node()}: expected digest {expected}, got {found}; undo the change, or "
                "begin again under another name"
            )
        return player


@contextmanager
def unpacked_policy(name: str, game: GameConfig, digest: str | None, bundle: PolicyBundle | None) -> Iterator[str]:
    """Have a policy where a task is done, checked by its digest if that is given; yield its name or folder there.

    Raises a WorkerError if it cannot be had, or is another.
    """
    if digest is not None or bundle is not None:
        digests, bundles = {} if digest is None else {name: digest}, {} if bundle is None else {name: bundle}
        VerifyingLoader(load, digests, bundles)(name, game)
    if bundle is None:
        yield name
        return
    with tempfile.TemporaryDirectory(prefix="swarm-pz-") as place:
        yield str(bundle.unpack(Path(place)))
