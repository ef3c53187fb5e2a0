"""A tournament's folder: its settings, its finished games, and its lock."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
import os
import platform
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from swarm_pz.config import GameConfig
from swarm_pz.config.base import Config, Range, Share, check_choice
from swarm_pz.errors import ResultsError, require_extra
from swarm_pz.evaluation.provenance import provenance
from swarm_pz.files import named_if_full, write_json

SETTINGS, GAMES = "tournament.json", "games.jsonl"
NotNegative = Annotated[float, Range(0.0, math.inf)]
_OPPOSITE = {"win": "loss", "draw": "draw", "loss": "win"}


@dataclass(frozen=True, kw_only=True)
class PlayedGame(Config):
    """One game of a tournament, a line of the file.

    `one` and `other` are in alphabetical order; `outcome` and `share` are those of `one`, which is red if the number is
    even. `fingerprint` is hashed; see `rollout.Game`.
    """

    one: str
    other: str
    number: Annotated[int, Range(0, 10**9)]
    outcome: str
    share: Share
    seconds: NotNegative
    fingerprint: str
    forfeit: str = ""
    sent: tuple[Annotated[int, Range(0, 10**9)], Annotated[int, Range(0, 10**9)]] = (0, 0)
    thinking_ms: tuple[NotNegative, NotNegative] = (0.0, 0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_choice(self.outcome, "outcome", tuple(_OPPOSITE))

    @property
    def key(self) -> tuple[str, str, int]:
        """Names and number, which are unique."""
        return self.one, self.other, self.number

    def outcome_of(self, player: str) -> str:
        """Return the outcome for one of the two: "win", "draw" or "loss"."""
        return self.outcome if player == self.one else _OPPOSITE[self.outcome]


@contextlib.contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Lock a folder; raise a ResultsError if another process holds it. The lock ends with the process."""
    filelock = require_extra("filelock", "cli")
    folder.mkdir(parents=True, exist_ok=True)
    lock, holder = filelock.FileLock(folder / ".lock"), folder / ".holder"
    try:
        lock.acquire(timeout=0)
    except filelock.Timeout as error:
        name = holder.read_text() if holder.exists() else "another process"
        raise ResultsError(
            f"{folder} is being played in by {name}: wait until it is done or stop it, or use another folder; "
            "no game is lost"
        ) from error
    with contextlib.ExitStack() as stack:
        stack.callback(lock.release)
        holder.write_text(f"process {os.getpid()} on {platform.node()}")
        stack.callback(holder.unlink, missing_ok=True)
        yield


def recorded_digests(folder: Path) -> dict[str, str]:
    """Return the digests of the players in a tournament's folder, or none if its settings cannot be read."""
    try:
        return {
            str(name): str(digest) for name, digest in json.loads((folder / SETTINGS).read_text())["learned"].items()
        }
    except (OSError, LookupError, TypeError, ValueError, RecursionError):  # `Ledger` reports why
        return {}


class Ledger:
    """A tournament's folder.

    Files stay unchanged until `take_up`. Raises a ResultsError for a folder of another tournament, with players of
    other digests, or with corrupt files.
    """

    def __init__(self, folder: Path, *, seed: int, budget_ms: float, game: GameConfig, digests: dict[str, str]) -> None:
        self.folder, self._game, self._digests = folder, game, digests
        self._settings = {"seed": seed, "budget_ms": budget_ms}
        self._check()

    def _check(self) -> dict[str, str]:
        """Check that the folder holds no other tournament; return the digests of its players."""
        path = self.folder / SETTINGS
        if not path.exists():
            return {}
        try:
            before = json.loads(path.read_text())
            learned = dict(before["learned"])
            game = GameConfig.from_dict(before["game"])
            if game.hash != before["config_hash"]:
                raise ResultsError(f"config_hash is {before['config_hash']}, its game has {game.hash}")
            differing = [name for name, value in self._settings.items() if before[name] != value]
        except (OSError, LookupError, TypeError, ValueError, RecursionError) as error:
            raise ResultsError(f"{path} is corrupt or foreign ({error!r:.300}); use another folder") from error
        differing += ["rules"] if game.rules_hash != self._game.rules_hash else []
        if differing:
            raise ResultsError(
                f"{self.folder} holds a tournament with other {', '.join(differing)}; give the same options as then, "
                "or use another folder"
            )
        if changed := [name for name, digest in self._digests.items() if learned.get(name, digest) != digest]:
            raise ResultsError(
                f"{', '.join(changed)} changed since its games in {self.folder} were played; undo the change and play "
                "the new version under another name, or use another folder"
            )
        return learned

    def take_up(self, command: str) -> dict[tuple[str, str, int], PlayedGame]:
        """Check again, write the settings, cut off an unfinished line, and return the games; needs the lock."""
        settings = {
            **self._settings,
            "config_hash": self._game.hash,
            "game": self._game.to_dict(),
            "learned": self._check() | self._digests,
            **provenance(self._game, command),
        }
        write_json(self.folder / SETTINGS, settings)
        path = self.folder / GAMES
        if path.exists():
            os.truncate(path, path.read_bytes().rfind(b"\n") + 1)
        return self.read()

    def read(self) -> dict[tuple[str, str, int], PlayedGame]:
        """Return the finished games."""
        path = self.folder / GAMES
        games = {}
        whole = path.read_bytes().splitlines(keepends=True) if path.exists() else []
        for number, line in enumerate(whole, 1):
            if not line.endswith(b"\n"):
                break
            try:
                game = PlayedGame.from_dict(json.loads(line))
                games[game.key] = game
            except (LookupError, TypeError, ValueError, RecursionError) as error:
                raise ResultsError(
                    f"line {number} of {path} is not a finished game: {error!r:.300}; delete the line, and its game is "
                    "played again"
                ) from error
        return games

    def append(self, games: Iterable[PlayedGame]) -> None:
        """Append finished games; they survive a crash of the system."""
        lines = "".join(json.dumps(dataclasses.asdict(game)) + "\n" for game in games)
        path = self.folder / GAMES
        with named_if_full(path, path), path.open("ab") as file:
            file.write(lines.encode())
            file.flush()
            os.fsync(file.fileno())
