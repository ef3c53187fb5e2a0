"""A tournament: every player against every other, both sides, the same starts; and the ladder it gives.

Games are played in blocks, and a finished block is appended to a file, one line a game, never to be
played again: a tournament that was stopped goes on where it was, and one with more players plays only
what is missing.
"""

from __future__ import annotations

import dataclasses
import hashlib
import itertools
import json
import multiprocessing
import os
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from swarm_pz.config import GameConfig
from swarm_pz.errors import CommandError, ResultsError, Stopped
from swarm_pz.match import POINTS, FaultError, Game, blame, play_games
from swarm_pz.policy import Player, PrivilegedPolicy, load_players
from swarm_pz.ratings import Results
from swarm_pz.scenario import check_seed
from swarm_pz.settings import Config, check, check_count, check_number
from swarm_pz.worker import alarm, end_processes, prepare_process

SETTINGS, GAMES = "tournament.json", "games.jsonl"
_BLOCK = 20
"""Games that one process plays side by side."""
_PATIENCE = 30.0
"""Seconds that a game's first command may take on top: players load and compile then."""

Loader = Callable[[str, GameConfig], Player]


@dataclass(frozen=True, kw_only=True)
class TournamentConfig(Config):
    """What every game of a tournament shares.

    Attributes
    ----------
    games : int
        Games of every two players, even; more may be asked for later.
    seed : int
    budget_ms : float
        Milliseconds that a command may take; who takes longer forfeits the game.
    game : GameConfig
        The rules.
    """

    games: int = 40
    seed: int = 0
    budget_ms: float = 2000.0
    game: GameConfig = field(default_factory=GameConfig)

    def __post_init__(self) -> None:
        check_count(self.games, "games", 2, 10**6)
        check(self.games % 2 == 0, "games", self.games, "even, half for each side")
        check_seed(self.seed)
        check_number(self.budget_ms, "budget_ms", 0.0, 1e7, open_low=True)


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
    thinking_ms: tuple[float, float] = (0.0, 0.0)

    @property
    def key(self) -> tuple[str, str, int]:
        """What no two games share."""
        return self.one, self.other, self.number


# --- playing ----------------------------------------------------------------------------------------


def _clock(budget_ms: float) -> Callable[[int, bool], Any]:
    def allow(games: int, is_first: bool) -> Any:
        return alarm(games * budget_ms / 1000.0 + (_PATIENCE if is_first else 0.0))

    return allow


def play_block(
    loader: Loader, one: str, other: str, numbers: Sequence[int], config: TournamentConfig
) -> list[PlayedGame]:
    """Play some games of two players; whose policy fails forfeits the game in which it did.

    A policy answers many games at once, so after a failure each game is played again on its own,
    with fresh policies, to see which of them fail.
    """
    clock = _clock(config.budget_ms)
    try:
        loaded: list[Player] = []
        for place, name in enumerate((one, other)):
            with blame(place, name), clock(1, True):
                loaded.append(loader(name, config.game))
        players = load_players(loaded[0], loaded[1], config.game)
        games = play_games(players, numbers, seed=config.seed, config=config.game, clock=clock)
    except FaultError as fault:
        if len(numbers) > 1:
            alone = [play_block(loader, one, other, [number], config) for number in numbers]
            return list(itertools.chain.from_iterable(alone))
        outcome = "loss" if fault.place == 0 else "win"
        reason = f"{(one, other)[fault.place]}: {fault}"
        share = float(fault.place)
        return [
            PlayedGame(
                one=one,
                other=other,
                number=numbers[0],
                outcome=outcome,
                share=share,
                seconds=0.0,
                fingerprint=f"forfeit {numbers[0]}",
                forfeit=reason,
            )
        ]
    return [_line(one, other, number, game) for number, game in zip(numbers, games, strict=True)]


def _line(one: str, other: str, number: int, game: Game) -> PlayedGame:
    return PlayedGame(
        one=one,
        other=other,
        number=number,
        outcome=game.outcome,
        share=game.share,
        seconds=game.seconds,
        fingerprint=hashlib.sha256(game.fingerprint).hexdigest()[:16],
        thinking_ms=(round(game.thinking_ms[0], 2), round(game.thinking_ms[1], 2)),
    )


class Tournament:
    """A tournament in a folder, begun or taken up.

    Parameters
    ----------
    players : sequence of str
        Names that the loader knows, at least two.
    config : TournamentConfig
    folder : Path
        Holds ``tournament.json``, the settings, and ``games.jsonl``, the finished games.
    loader : callable
        From a name and a game to a policy; found again by its name in other processes.

    Attributes
    ----------
    privileged : set of str
        Players that see the simulator itself.

    Raises
    ------
    PolicyError
        If a player is unknown or cannot be made.
    ResultsError
        If the folder holds another tournament, or its files are corrupt.
    """

    def __init__(self, players: Sequence[str], config: TournamentConfig, folder: Path, loader: Loader) -> None:
        self.players = tuple(dict.fromkeys(players))
        if len(self.players) < 2:
            raise CommandError(f"a tournament needs at least two different players, got {list(players)}")
        self.config, self.folder, self._loader = config, folder, loader
        made = {name: loader(name, config.game) for name in self.players}
        self.privileged = {name for name, player in made.items() if isinstance(player, PrivilegedPolicy)}
        digests = {name: getattr(player, "digest", None) for name, player in made.items()}
        self._learned = {name: digest for name, digest in digests.items() if digest is not None}
        self._open(self._learned)
        self.games = self._read()

    def _open(self, digests: dict[str, str]) -> None:
        """Write the settings, or check that those of the folder are the same."""
        self.folder.mkdir(parents=True, exist_ok=True)
        path = self.folder / SETTINGS
        settings: dict[str, Any] = {
            "seed": self.config.seed,
            "budget_ms": self.config.budget_ms,
            "config_hash": self.config.game.hash,
            "game": self.config.game.to_dict(),
        }
        known: dict[str, str] = {}
        if path.exists():
            try:
                before = json.loads(path.read_text())
                known = dict(before["learned"])
                differing = [name for name in ("seed", "budget_ms", "config_hash") if before[name] != settings[name]]
            except (OSError, LookupError, TypeError, ValueError) as error:
                raise ResultsError(f"{path} is corrupt or foreign ({error!r}); use another folder") from error
            if differing:
                raise ResultsError(
                    f"{self.folder} holds a tournament with other {', '.join(differing)}; use another folder"
                )
            changed = [name for name, digest in digests.items() if known.get(name, digest) != digest]
            if changed:
                raise ResultsError(
                    f"{', '.join(changed)} changed since its games in {self.folder} were played; use another folder"
                )
        draft = path.with_name(f".{path.name}.draft")
        draft.write_text(json.dumps(settings | {"learned": known | digests}, indent=2) + "\n")
        draft.replace(path)

    def _read(self) -> dict[tuple[str, str, int], PlayedGame]:
        """Read the finished games, and cut off a line that was not finished."""
        path = self.folder / GAMES
        if not path.exists():
            return {}
        text = path.read_bytes()
        whole = text[: text.rfind(b"\n") + 1]
        if len(whole) < len(text):
            with path.open("r+b") as file:
                file.truncate(len(whole))
        games = {}
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                plain = json.loads(line)
                game = PlayedGame(**plain | {"thinking_ms": tuple(plain["thinking_ms"])})
                games[game.key] = game
            except (LookupError, TypeError, ValueError) as error:
                raise ResultsError(f"line {number} of {path} is not a finished game: {error!r}") from error
        return games

    def missing(self) -> list[tuple[str, str, list[int]]]:
        """Return what is still to be played: blocks of games of two players."""
        blocks = []
        for one, other in itertools.combinations(sorted(self.players), 2):
            numbers = [number for number in range(self.config.games) if (one, other, number) not in self.games]
            size = _BLOCK // 10 if {one, other} & self.privileged else _BLOCK  # planners think game by game
            blocks += [(one, other, numbers[start : start + size]) for start in range(0, len(numbers), size)]
        # Long ones first, so that no process works alone in the end.
        return sorted(blocks, key=lambda block: not {block[0], block[1]} & self.privileged)

    def play(
        self,
        processes: int = 1,
        progress: Callable[[int, int], None] | None = None,
        asked: Callable[[], bool] = lambda: False,
    ) -> None:
        """Play what is missing.

        Parameters
        ----------
        processes : int
            Processes that share the games; with 1 they are played in this one.
        progress : callable, optional
            Called with (games finished, games that were missing).
        asked : callable, optional
            Called between blocks of games: whether to stop there.

        Raises
        ------
        Stopped
            If it was asked to; every game that began is finished and kept.
        """
        check_count(processes, "processes", 1, 1024)
        blocks = self.missing()
        done = 0
        total = sum(len(numbers) for _, _, numbers in blocks)
        with (self.folder / GAMES).open("ab") as file:

            def keep(games: list[PlayedGame]) -> None:
                lines = "".join(json.dumps(dataclasses.asdict(game)) + "\n" for game in games)
                file.write(lines.encode())
                file.flush()
                os.fsync(file.fileno())
                self.games |= {game.key: game for game in games}
                nonlocal done
                done += len(games)
                if progress is not None:
                    progress(done, total)

            if processes == 1:
                for block in blocks:
                    if asked():
                        raise self._stopped()
                    keep(play_block(self._loader, *block, self.config))
                return
            context = multiprocessing.get_context("spawn")
            with ProcessPoolExecutor(processes, mp_context=context, initializer=prepare_process) as pool:
                left = iter(blocks)
                waiting: dict[Future[list[PlayedGame]], tuple[str, str, list[int]]] = {}
                try:
                    while not asked():
                        for block in itertools.islice(left, 2 * processes - len(waiting)):
                            waiting[pool.submit(play_block, self._loader, *block, self.config)] = block
                        if not waiting:
                            return
                        for future in wait(waiting, return_when=FIRST_COMPLETED).done:
                            if future.exception() is None:
                                waiting.pop(future)
                                keep(future.result())
                            else:
                                future.result()
                except KeyboardInterrupt:  # at once
                    end_processes()
                    raise
                except BrokenProcessPool as error:
                    playing = ", ".join(sorted({f"{one} against {other}" for one, other, _ in waiting.values()}))
                    raise ResultsError(
                        f"a process of the tournament died while these were played: {playing}; run it again to go on, "
                        "without the player that crashes if it happens again"
                    ) from error
                finally:
                    pool.shutdown(cancel_futures=True)
                    for future in waiting:  # what was finished meanwhile is finished
                        if not future.cancelled() and future.done() and future.exception() is None:
                            keep(future.result())
            if self.missing():
                raise self._stopped()

    def _stopped(self) -> Stopped:
        left = sum(len(numbers) for _, _, numbers in self.missing())
        return Stopped(f"{len(self.games):,} games are in {self.folder}, {left:,} are missing")

    # --- what the games say -----------------------------------------------------------------------

    def kind(self, player: str) -> str:
        """Return what a player is: "planned" (privileged), "learned" or "scripted"."""
        return "planned" if player in self.privileged else "learned" if player in self._learned else "scripted"

    def counting(self, one: str, other: str) -> list[PlayedGame]:
        """Return the games of two players that count: one of a pair that came out the same."""
        return list(
            {(game.number // 2, game.fingerprint): game for game in reversed(self.between(one, other))}.values()
        )

    def between(self, one: str, other: str) -> list[PlayedGame]:
        """Return the finished games of two players in the order of their numbers, as the file has them."""
        first, second = sorted((one, other))
        return [
            game for number in range(self.config.games) if (game := self.games.get((first, second, number))) is not None
        ]

    def results(self) -> Results:
        """Return the points of every pairing; a pair of games that came out the same counts once."""
        points = {}
        for i, j in itertools.combinations(range(len(self.players)), 2):
            one, other = self.players[i], self.players[j]
            pairs: dict[int, dict[str, list[float]]] = {}
            for game in self.between(one, other):
                value = POINTS[game.outcome]
                value = value if game.one == one else 1.0 - value
                pairs.setdefault(game.number // 2, {}).setdefault(game.fingerprint, []).append(value)
            rows = [[sum(map(np.mean, games.values())), len(games)] for games in pairs.values()]
            points[i, j] = np.array(rows, np.float64).reshape(-1, 2)
        return Results(self.players, points)
