"""A tournament: every player against every other, both sides, the same starts; and the ladder it gives.

Games are played in blocks, and a finished block is appended to a file, one line a game, never to be
played again: a tournament that was stopped goes on where it was, and one with more players plays only
what is missing.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.config.base import Config, check, check_count, check_number
from swarm_pz.config.installed import FAULTS
from swarm_pz.errors import CommandError, PolicyError, Stopped, SwarmError
from swarm_pz.evaluation.bundles import PolicyBundle, VerifyingLoader
from swarm_pz.evaluation.ledger import Ledger, PlayedGame, folder_lock
from swarm_pz.evaluation.match import POINTS
from swarm_pz.evaluation.processes import alarm
from swarm_pz.evaluation.ratings import Results
from swarm_pz.evaluation.rollout import Clock, FaultError, Game, play_games
from swarm_pz.evaluation.workers import open_pool, share
from swarm_pz.policy import Player, PrivilegedPolicy, folder_of

_BLOCK = 20
"""Games that one process plays side by side."""
_PATIENCE = 600.0
"""Seconds that getting ready for games, and their first command, may take on top: what players load and compile only
then is done once, on however slow a machine. Who takes longer hangs."""

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
        Milliseconds that a command may take; who takes longer forfeits the game.
    game : GameConfig
        The rules. Of two different controllers the first flies for whichever of two players comes first in the
        alphabet, in all of their games; who wants a ladder of players gives both the same.
    """

    games: int = 40
    seed: int = 0
    budget_ms: float = 2000.0
    game: GameConfig = field(default_factory=GameConfig)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_count(self.games, "games", 2, 10**6)
        check(self.games % 2 == 0, "games", self.games, "even, half for each side")
        check_count(self.seed, "seed", 0, 2**128 - 1)
        check_number(self.budget_ms, "budget_ms", 1e-3, 1e7)
        check(isinstance(self.game, GameConfig), "game", self.game, "a GameConfig")
        self.game.to_dict()  # refuses what the folder cannot name


# --- playing ----------------------------------------------------------------------------------------


def _clock(budget_ms: float) -> Clock:
    def allow(games: int, is_first: bool) -> AbstractContextManager[None]:
        return alarm(games * budget_ms / 1000.0 + (_PATIENCE if is_first else 0.0))

    return allow


def _made(loader: Loader, name: str, game: GameConfig) -> Player:
    try:
        return loader(name, game)
    except SwarmError:
        raise
    except FAULTS as error:
        raise PolicyError(f"{name} cannot be made: {error!r}") from error


def play_block(
    loader: Loader, one: str, other: str, numbers: Sequence[int], config: TournamentConfig
) -> list[PlayedGame]:
    """Play some games of two players; whose policy fails forfeits the game in which it did.

    A policy answers many games at once, so after a failure each game is played again on its own,
    with fresh policies, to see which of them fail.

    Raises
    ------
    PolicyError
        If a player cannot be made: then nothing has been played, and nobody has lost.
    """
    players = [_made(loader, name, config.game) for name in (one, other)]
    clock = _clock(config.budget_ms)
    try:
        games = play_games(players[0], players[1], numbers, seed=config.seed, config=config.game, clock=clock)
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


def play_block_elsewhere(
    loader: Loader,
    one: str,
    other: str,
    numbers: Sequence[int],
    config: TournamentConfig,
    digests: dict[str, str],
    *bundles: PolicyBundle | None,
) -> list[PlayedGame]:
    """Play some games of two players on another machine, from the files of those two that come from folders.

    Raises
    ------
    WorkerError
        If one of them cannot be had there, or is another. That is not its fault, and so no forfeit.
    """
    carried = {name: bundle for name, bundle in zip((one, other), bundles, strict=True) if bundle is not None}
    arrivals = VerifyingLoader(loader, digests, carried)
    for name in (one, other):
        arrivals(name, config.game)
    return play_block(arrivals, one, other, numbers, config)


def _line(one: str, other: str, number: int, game: Game) -> PlayedGame:
    return PlayedGame(
        one=one,
        other=other,
        number=number,
        outcome=game.outcome,
        share=game.share,
        seconds=game.seconds,
        fingerprint=hashlib.sha256(game.fingerprint).hexdigest()[:16],
        sent=game.sent,
        thinking_ms=(round(game.thinking_ms[0], 2), round(game.thinking_ms[1], 2)),
    )


class Tournament:
    """A tournament in a folder, begun or taken up; one process plays in a folder at a time.

    Parameters
    ----------
    players : sequence of str
        Names that the loader knows, at least two.
    config : TournamentConfig
    folder : Path
        Holds ``tournament.json``, the settings, and ``games.jsonl``, the finished games.
    loader : callable
        From a name and a game to a policy; found again by its name in other processes. Of its names those that are
        folders are known on other machines, too; a loader with names of its own has a method `folder_of` that says
        which folder one stands for, or None.
    command : str
        What was called; it stands in the tournament's files.

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

    def __init__(
        self, players: Sequence[str], config: TournamentConfig, folder: Path, loader: Loader, command: str = ""
    ) -> None:
        self.players = tuple(players)
        if len(players) < 2 or len(set(players)) < len(players):
            raise CommandError(f"a tournament needs two or more players, each named once, got {list(players)}")
        self.config, self.folder, self._loader, self.command = config, folder, loader, command
        made = {name: loader(name, config.game) for name in self.players}
        self.privileged = {name for name, player in made.items() if isinstance(player, PrivilegedPolicy)}
        digests = {name: getattr(player, "digest", None) for name, player in made.items()}
        self._learned = {name: digest for name, digest in digests.items() if digest is not None}
        self._ledger = Ledger(
            folder, seed=config.seed, budget_ms=config.budget_ms, game=config.game, learned=self._learned
        )
        self.games = self._ledger.read()

    def pairings(self) -> list[tuple[str, str]]:
        """Return who plays whom, each two in alphabetical order: everybody everybody else."""
        return list(itertools.combinations(sorted(self.players), 2))

    def rules_of(self, one: str, other: str) -> TournamentConfig:
        """Return what the games of two players share: the same for all."""
        return self.config

    def missing(self) -> list[tuple[str, str, list[int]]]:
        """Return what is still to be played: blocks of games of two players."""
        blocks = []
        for one, other in self.pairings():
            numbers = [number for number in range(self.config.games) if (one, other, number) not in self.games]
            size = _BLOCK // 10 if {one, other} & self.privileged else _BLOCK  # planners think game by game
            blocks += [(one, other, numbers[start : start + size]) for start in range(0, len(numbers), size)]
        # Long ones first, so that no process works alone in the end.
        return sorted(blocks, key=lambda block: not {block[0], block[1]} & self.privileged)

    def play(
        self,
        processes: int = 1,
        progress: Callable[[int, int], None] | None = None,
        should_stop: Callable[[], bool] = lambda: False,
        pool: Executor | None = None,
    ) -> None:
        """Play what is missing.

        Parameters
        ----------
        processes : int
            Processes that share the games; with 1 they are played in this one.
        progress : callable, optional
            Called with (games finished, games that were missing).
        should_stop : callable, optional
            Called between blocks of games: whether to stop there.
        pool : Executor, optional
            Who plays them instead, as `open_pool` gives it, or any other; it is left open.

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
            folder_lock(self._ledger.folder),
        ):
            self.games = self._ledger.take_up(self.command)
            self._play_missing(workers, progress, should_stop)

    def _play_missing(
        self, pool: Executor, progress: Callable[[int, int], None] | None, should_stop: Callable[[], bool]
    ) -> None:
        blocks = self.missing()
        done = 0
        total = sum(len(numbers) for _, _, numbers in blocks)

        def keep(games: list[PlayedGame]) -> None:
            self._ledger.append(games)
            self.games |= {game.key: game for game in games}
            nonlocal done
            done += len(games)
            if progress is not None:
                progress(done, total)

        if progress is not None:
            progress(0, total)
        is_elsewhere = getattr(pool, "elsewhere", False)
        share(
            pool,
            play_block_elsewhere if is_elsewhere else play_block,
            self._tasks(blocks, is_elsewhere),
            lambda _, games: keep(games),
            should_stop=should_stop,
            name=lambda task: f"{task[1]} against {task[2]}",
        )
        if self.missing():
            raise self._stopped()

    def _tasks(self, blocks: Sequence[tuple[str, str, list[int]]], is_elsewhere: bool) -> Iterator[tuple[Any, ...]]:
        """Return what `play_block` is given for each block, and on other machines what players are known by."""
        where = getattr(self._loader, "folder_of", folder_of)
        folders = {name: where(name) for name in self.players} if is_elsewhere else {}
        bundles = {name: PolicyBundle.of(folder) for name, folder in folders.items() if folder is not None}
        for one, other, numbers in blocks:
            task = (self._loader, one, other, numbers, self.rules_of(one, other))
            digests = {name: self._learned[name] for name in (one, other) if name in self._learned}
            yield (*task, digests, bundles.get(one), bundles.get(other)) if is_elsewhere else task

    def _stopped(self) -> Stopped:
        left = sum(len(numbers) for _, _, numbers in self.missing())
        return Stopped(f"{len(self.games):,} games are in {self.folder}, {left:,} are missing")

    # --- what the games say -----------------------------------------------------------------------

    def kind(self, player: str) -> str:
        """Return what a player is: "planned" (privileged), "learned" or "scripted"."""
        return "planned" if player in self.privileged else "learned" if player in self._learned else "scripted"

    def between(self, one: str, other: str) -> list[PlayedGame]:
        """Return the finished games of two players in the order of their numbers, as the file has them."""
        first, second = sorted((one, other))
        return [
            game for number in range(self.config.games) if (game := self.games.get((first, second, number))) is not None
        ]

    def counting(self, one: str, other: str) -> list[list[PlayedGame]]:
        """Return the games of two players that count, each as its lines: both of a pair that came out the same."""
        distinct: dict[tuple[int, str], list[PlayedGame]] = {}
        for game in self.between(one, other):
            distinct.setdefault((game.number // 2, game.fingerprint), []).append(game)
        return list(distinct.values())

    def tally(self, player: str, other: str) -> NDArray[np.float64]:
        """Return how many games of every pair a player won, drew and lost against another: (pairs, 3).

        A game that was played twice counts once, half of it from each side: the same colour won both times,
        so a player and its clone share the point.
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
