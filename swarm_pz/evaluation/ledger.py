"""A tournament's folder: its settings, the finished games, and who plays in it."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import os
import platform
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from swarm_pz.config import GameConfig
from swarm_pz.errors import ResultsError, require_extra
from swarm_pz.evaluation.provenance import provenance
from swarm_pz.files import draft_of, named_if_full

SETTINGS, GAMES = "tournament.json", "games.jsonl"
_LOCK, _HOLDER = ".lock", ".holder"
_OPPOSITE = {"win": "loss", "draw": "draw", "loss": "win"}


@dataclass(frozen=True, kw_only=True)
class PlayedGame:
    """One game of a tournament, as its line in the file says it.

    Attributes
    ----------
    one, other : str
        The players, in alphabetical order.
    number : int
        Number within their match: 2p is pair p with `one` as red, 2p + 1 with it as blue.
    outcome : {"win", "draw", "loss"}
        Of `one`.
    share : float
        Final share of all drones of `one`.
    seconds : float
        Length of the game.
    fingerprint : str
        Equal for games that ended alike.
    forfeit : str
        Why the loser forfeited; empty if nobody did.
    sent : (int, int)
        Commands of both that were others than those before.
    thinking_ms : (float, float)
        Mean milliseconds a command.
    """

    one: str
    other: str
    number: int
    outcome: str
    share: float
    seconds: float
    fingerprint: str
    forfeit: str = ""
    sent: tuple[int, int] = (0, 0)
    thinking_ms: tuple[float, float] = (0.0, 0.0)

    @property
    def key(self) -> tuple[str, str, int]:
        """What no two games share."""
        return self.one, self.other, self.number

    def outcome_of(self, player: str) -> str:
        """Return how the game ended for one of the two: "win", "draw" or "loss"."""
        return self.outcome if player == self.one else _OPPOSITE[self.outcome]


@contextlib.contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Keep other processes from playing in a folder.

    The lock is the system's: it ends with the process, however that ends. The file beside it only tells
    others who holds the lock.

    Raises
    ------
    ResultsError
        If another process holds it.
    """
    filelock = require_extra("filelock", "cli")
    folder.mkdir(parents=True, exist_ok=True)
    lock, holder = filelock.FileLock(folder / _LOCK), folder / _HOLDER
    try:
        lock.acquire(timeout=0)
    except filelock.Timeout as error:
        name = holder.read_text() if holder.exists() else "another process"
        raise ResultsError(
            f"{folder} is being played in by {name}: wait until it is done or stop it, or use another folder; "
            "no game is lost"
        ) from error
    try:
        holder.write_text(f"process {os.getpid()} on {platform.node()}")
        yield
    finally:
        holder.unlink(missing_ok=True)
        lock.release()


class Ledger:
    """A folder with one line for every finished game, in ``games.jsonl``, and the settings in ``tournament.json``.

    Parameters
    ----------
    folder : Path
    seed : int
    budget_ms : float
    game : GameConfig
        What all games share.
    learned : dict of str to str
        Digests of learned players; whoever played here under the same name must have been the same.

    Raises
    ------
    ResultsError
        If the folder holds another tournament, or its files are corrupt. Nothing is changed in it before
        somebody holds it.
    """

    def __init__(self, folder: Path, *, seed: int, budget_ms: float, game: GameConfig, learned: dict[str, str]) -> None:
        self.folder, self._game, self._learned = folder, game, learned
        self._settings = {"seed": seed, "budget_ms": budget_ms}
        self._check()

    def _check(self) -> dict[str, str]:
        """Check that the folder holds no other tournament; return the digests of its learned players."""
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
        except (OSError, LookupError, TypeError, ValueError) as error:
            raise ResultsError(f"{path} is corrupt or foreign ({error!r:.300}); use another folder") from error
        differing += ["rules"] if game.rules_hash != self._game.rules_hash else []
        if differing:
            raise ResultsError(
                f"{self.folder} holds a tournament with other {', '.join(differing)}; use another folder"
            )
        if changed := [name for name, digest in self._learned.items() if learned.get(name, digest) != digest]:
            raise ResultsError(
                f"{', '.join(changed)} changed since its games in {self.folder} were played; use another folder"
            )
        return learned

    def take_up(self, command: str) -> dict[tuple[str, str, int], PlayedGame]:
        """Write the settings and return the finished games; for who holds the folder.

        Another process may have played in it since this one looked.
        """
        settings = {
            **self._settings,
            "config_hash": self._game.hash,
            "game": self._game.to_dict(),
            "learned": self._check() | self._learned,
            **provenance(self._game, command),
        }
        with draft_of(self.folder / SETTINGS) as draft:
            draft.write_text(json.dumps(settings, indent=2) + "\n")
        return self.read(mend=True)

    def read(self, *, mend: bool = False) -> dict[tuple[str, str, int], PlayedGame]:
        """Read the finished games; with `mend`, for who holds the folder, cut off a line that was not finished."""
        path = self.folder / GAMES
        if not path.exists():
            return {}
        text = path.read_bytes()
        whole = text[: text.rfind(b"\n") + 1]
        if mend and len(whole) < len(text):
            with path.open("r+b") as file:
                file.truncate(len(whole))
        games = {}
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                plain = json.loads(line)
                pairs = {name: tuple(plain[name]) for name in ("sent", "thinking_ms")}
                game = PlayedGame(**plain | pairs)
                games[game.key] = game
            except (LookupError, TypeError, ValueError) as error:
                raise ResultsError(f"line {number} of {path} is not a finished game: {error!r}") from error
        return games

    def append(self, games: Iterable[PlayedGame]) -> None:
        """Add finished games, so that even a system that crashes keeps them."""
        lines = "".join(json.dumps(dataclasses.asdict(game)) + "\n" for game in games)
        path = self.folder / GAMES
        with named_if_full(path, path), path.open("ab") as file:
            file.write(lines.encode())
            file.flush()
            os.fsync(file.fileno())
