"""A tournament: every player against every other, both sides, the same starts.

Games are played in blocks, and a finished block is appended to a file, one line a game. So a tournament that was
stopped goes on where it was, and one with more players plays only what is missing.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.config.base import Config, Range, check
from swarm_pz.errors import CommandError, Stopped
from swarm_pz.evaluation.bundles import PolicyBundle, VerifyingLoader
from swarm_pz.evaluation.ledger import Ledger, PlayedGame, distinct, folder_lock
from swarm_pz.evaluation.match import POINTS
from swarm_pz.evaluation.processes import alarm
from swarm_pz.evaluation.ratings import Results
from swarm_pz.evaluation.rollout import FaultError, Game, play_or_forfeit
from swarm_pz.evaluation.workers import open_pool, share
from swarm_pz.policy import Player, digest_of, folder_of, sort_of

_BLOCK = 20
"""Games that one process plays side by side."""
_PATIENCE = 600.0
"""Seconds that a reset and a first command may take on top, for what is loaded and compiled only then."""

_OUTCOMES = tuple(POINTS)

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
        Milliseconds that a command may take; a player that takes longer forfeits the game.
    game : GameConfig
        The rules. Of two different controllers the first flies for the player whose name comes first in the alphabet,
        in all games of the two.
    """

    games: Annotated[int, Range(2, 10**6)] = 40
    seed: Annotated[int, Range(0, 2**128 - 1)] = 0
    budget_ms: Annotated[float, Range(1e-3, 1e7)] = 2000.0
    game: GameConfig = field(default_factory=GameConfig)

    def __post_init__(self) -> None:
        super().__post_init__()
        check(self.games % 2 == 0, "games", self.games, "even, half for each side")
        self.game.to_dict()  # refuses what the folder cannot name


# --- playing ----------------------------------------------------------------------------------------


def play_block(
    loader: Loader,
    one: str,
    other: str,
    numbers: Sequence[int],
    config: TournamentConfig,
    digests: Mapping[str, str] = MappingProxyType({}),
    *bundles: PolicyBundle | None,
) -> list[PlayedGame]:
    """Play some games of two players; a policy that fails forfeits the game in which it did.

    Parameters
    ----------
    loader : callable
    one, other : str
    numbers : sequence of int
    config : TournamentConfig
    digests : dict of str to str
        Expected digests of players; others are not checked.
    *bundles : PolicyBundle or None
        On another machine, the files of `one` and of `other`, where they come from a folder.

    Raises
    ------
    WorkerError
        If a player cannot be made here, or has another digest: nobody has lost by that.
    """
    carried = {name: bundle for name, bundle in zip((one, other), bundles, strict=False) if bundle is not None}
    make = VerifyingLoader(loader, digests, carried)

    def clock(games: int, is_first: bool) -> AbstractContextManager[None]:
        return alarm(games * config.budget_ms / 1000.0 + (_PATIENCE if is_first else 0.0))

    games = play_or_forfeit(
        lambda: (make(one, config.game), make(other, config.game)),
        numbers,
        forfeits=FaultError,
        seed=config.seed,
        config=config.game,
        clock=clock,
    )
    return [_line(one, other, number, game) for number, game in zip(numbers, games, strict=True)]


def _line(one: str, other: str, number: int, game: Game) -> PlayedGame:
    at_fault = one if game.outcome == "loss" else other
    return PlayedGame(
        one=one,
        other=other,
        number=number,
        outcome=game.outcome,
        share=game.share,
        seconds=game.seconds,
        fingerprint=f"forfeit {number}" if game.forfeit else hashlib.sha256(game.fingerprint).hexdigest()[:16],
        forfeit=f"{at_fault}: {game.forfeit}" if game.forfeit else "",
        sent=game.sent,
        thinking_ms=(round(game.thinking_ms[0], 2), round(game.thinking_ms[1], 2)),
    )


class Tournament:
    """A tournament in a folder, new or continued; one process plays in a folder at a time.

    Parameters
    ----------
    players : sequence of str
        Names that the loader knows, at least two.
    config : TournamentConfig
    folder : Path
        Holds ``tournament.json``, the settings, and ``games.jsonl``, the finished games.
    loader : callable
        From a name and a game to a policy; importable by its name in other processes. A loader with names of its own
        has a method `folder_of`, from a name to its folder or None, for other machines.
    command : str
        What was called; it stands in the tournament's files.

    Attributes
    ----------
    sorts : dict of str to str
        What each player is, as of `sort_of`.

    Raises
    ------
    PolicyError
        If a player is unknown or cannot be made.
    ResultsError
        If the folder holds another tournament, or its files are corrupt.
    """

    def __init__(
        self, players: Sequence[str], config: TournamentConfig, folder: Path, loader: Loader, command: str = ""
    ) -> None:
        self.players = tuple(players)
        if len(players) < 2 or len(set(players)) < len(players):
            raise CommandError(f"a tournament needs two or more players, each named once, got {list(players)}")
        self.config, self.folder, self._loader, self.command = config, folder, loader, command
        made = {name: loader(name, config.game) for name in self.players}
        self.sorts = {name: sort_of(player) for name, player in made.items()}
        digests = {name: digest_of(name, player) for name, player in made.items()}
        self._digests = {name: digest for name, digest in digests.items() if digest is not None}
        self._ledger = Ledger(
            folder, seed=config.seed, budget_ms=config.budget_ms, game=config.game, digests=self._digests
        )
        self.games = self._ledger.read()

    def pairings(self) -> list[tuple[str, str]]:
        """Return every two players, each two in alphabetical order."""
        return list(itertools.combinations(sorted(self.players), 2))

    def rules_of(self, one: str, other: str) -> TournamentConfig:
        """Return what the games of two players share: the same for all."""
        return self.config

    def missing(self) -> list[tuple[str, str, list[int]]]:
        """Return what is still to be played: blocks of games of two players."""
        blocks = []
        planned = {name for name, sort in self.sorts.items() if sort == "planned"}
        for one, other in self.pairings():
            numbers = [number for number in range(self.config.games) if (one, other, number) not in self.games]
            size = _BLOCK // 10 if {one, other} & planned else _BLOCK  # planners think game by game
            blocks += [(one, other, numbers[start : start + size]) for start in range(0, len(numbers), size)]
        # Long ones first, so that no process works alone in the end.
        return sorted(blocks, key=lambda block: not {block[0], block[1]} & planned)

    def play(
        self,
        processes: int = 1,
        progress: Callable[[int, int], None] | None = None,
        should_stop: Callable[[], bool] = lambda: False,
        pool: Executor | None = None,
    ) -> None:
        """Play what is missing, with processes or, if it is given, a pool, which is left open.

        `progress` is called with games finished and games that were missing, `should_stop` between blocks of games.

        Raises
        ------
        ResultsError
            If another process plays in the folder, or the folder holds another tournament.
        WorkerError
            If a process died; the finished games are kept.
        Stopped
            If it was asked to; every game that began is finished and kept.
        """
        with (
            nullcontext(pool) if pool is not None else open_pool(processes) as workers,
            folder_lock(self.folder),
        ):
            self.games = self._ledger.take_up(self.command)
            blocks = self.missing()
            done, total = 0, sum(len(numbers) for _, _, numbers in blocks)
            tell = progress if progress is not None else lambda *_: None

            def keep(_: tuple[Any, ...], games: list[PlayedGame]) -> None:
                nonlocal done
                self._ledger.append(games)
                self.games |= {game.key: game for game in games}
                done += len(games)
                tell(done, total)

            tell(0, total)
            share(
                workers,
                play_block,
                self._tasks(blocks, getattr(workers, "elsewhere", False)),
                keep,
                should_stop=should_stop,
                name=lambda task: f"{task[1]} against {task[2]}",
            )
        if left := sum(len(numbers) for _, _, numbers in self.missing()):
            raise Stopped(f"{len(self.games):,} games are in {self.folder}, {left:,} are missing")

    def _tasks(self, blocks: Sequence[tuple[str, str, list[int]]], is_elsewhere: bool) -> Iterator[tuple[Any, ...]]:
        """Yield the arguments of `play_block` for each block."""
        where = getattr(self._loader, "folder_of", folder_of)
        folders = {name: where(name) for name in self.players} if is_elsewhere else {}
        bundles = {name: PolicyBundle.of(folder) for name, folder in folders.items() if folder is not None}
        for one, other, numbers in blocks:
            digests = {name: self._digests[name] for name in (one, other) if name in self._digests}
            rules = self.rules_of(one, other)
            yield self._loader, one, other, numbers, rules, digests, bundles.get(one), bundles.get(other)

    # --- what the games say -----------------------------------------------------------------------

    def between(self, one: str, other: str) -> list[PlayedGame]:
        """Return the finished games of two players in the order of their numbers, as the file has them."""
        keys = [(*sorted((one, other)), number) for number in range(self.config.games)]
        return [self.games[key] for key in keys if key in self.games]

    def counting(self, one: str, other: str) -> list[list[PlayedGame]]:
        """Return the games of two players that count, as of `distinct`."""
        return distinct(self.between(one, other))

    def tally(self, player: str, other: str) -> NDArray[np.float64]:
        """Return how many games of every pair a player won, drew and lost against another: (pairs, 3).

        A game that was played twice counts once, half of it from each side.
        """
        pairs: dict[int, list[float]] = {}
        for alike in self.counting(player, other):
            row = pairs.setdefault(alike[0].number // 2, [0.0] * len(_OUTCOMES))
            for game in alike:
                row[_OUTCOMES.index(game.outcome_of(player))] += 1.0 / len(alike)
        return np.array(list(pairs.values())).reshape(-1, len(_OUTCOMES))

    def results(self) -> Results:
        """Return the points of every pairing, from the same counts as `tally`."""
        points = {}
        for i, j in itertools.combinations(range(len(self.players)), 2):
            counts = self.tally(self.players[i], self.players[j])
            points[i, j] = np.stack([counts @ [POINTS[outcome] for outcome in _OUTCOMES], counts.sum(axis=1)], axis=1)
        return Results(self.players, points)
