"""Files of policies for other machines, and a loader that checks digests."""

from __future__ import annotations

import platform
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from swarm_pz.config import GameConfig
from swarm_pz.config.installed import FAULTS
from swarm_pz.errors import PolicyError, WorkerError
from swarm_pz.files import draft_of, explain
from swarm_pz.policy import Player, digest_of, load

MOST_BYTES = 2**26
"""Maximum size of a bundle."""


@dataclass(frozen=True)
class PolicyBundle:
    """The files of a policy's folder, by name and content, without subfolders and hidden files."""

    name: str
    files: tuple[tuple[str, bytes], ...]

    @classmethod
    def of(cls, folder: Path) -> PolicyBundle:
        """Read a folder; raise a PolicyError if it is too large or cannot be read."""
        try:
            files = (path for path in folder.iterdir() if path.is_file() and not path.name.startswith("."))
            paths = sorted(files, key=lambda path: (path.suffix == ".json", path.name))  # the card last
            size = sum(path.stat().st_size for path in paths)
            if size > MOST_BYTES:
                raise PolicyError(
                    f"{folder} is too large to send: expected {MOST_BYTES:,} bytes or fewer, got {size:,}; name a "
                    "folder with the policy's files alone"
                )
            return cls(folder.resolve().name, tuple((path.name, path.read_bytes()) for path in paths))
        except OSError as error:
            raise PolicyError(f"{folder} cannot be read: {explain(error)}") from error

    def unpack(self, where: Path) -> Path:
        """Write the folder into another one, and return its path."""
        folder = where / self.name
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in self.files:
            with draft_of(folder / name) as draft:
                draft.write_bytes(content)
        return folder


def load_verified(
    name: str,
    game: GameConfig,
    digest: str | None,
    bundle: PolicyBundle | None,
    loader: Callable[[str, GameConfig], Player] = load,
) -> Player:
    """Load a player by `loader`, or from its bundle; raise a WorkerError if that fails here or its digest differs."""
    try:
        if bundle is not None:
            with tempfile.TemporaryDirectory(prefix="swarm-pz-") as place:
                player = load(bundle.unpack(Path(place)), game)
        else:
            player = loader(name, game)
    except FAULTS as error:  # this forfeits no game
        raise WorkerError(f"{platform.node()} cannot load {name}: {error!r}") from error
    if digest is not None and (found := digest_of(name, player)) != digest:
        raise WorkerError(
            f"{name} changed on {platform.node()}: expected digest {digest}, got {found}; undo the change, or begin "
            "again under another name"
        )
    return player


@contextmanager
def unpacked_policy(name: str, game: GameConfig, digest: str | None, bundle: PolicyBundle | None) -> Iterator[str]:
    """Yield a policy's name, or the folder of its unpacked bundle; raise a WorkerError if its digest differs."""
    with tempfile.TemporaryDirectory(prefix="swarm-pz-") as place:
        policy = name if bundle is None else str(bundle.unpack(Path(place)))
        if digest is not None or bundle is not None:
            load_verified(policy, game, digest, None)
        yield policy
