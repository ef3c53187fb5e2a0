"""A tournament: every player against every other, both sides, the same starts.

Finished blocks of games are appended to a file. So a stopped tournament continues, and one with more players plays only
the missing games.
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
from swarm_pz.evaluation.bundles import PolicyBundle, load_verified
from swarm_pz.evaluation.ledger import Ledger, PlayedGame, folder_lock
from swarm_pz.evaluation.match import POINTS
from swarm_pz.evaluation.processes import alarm
from swarm_pz.evaluation.ratings import Results
from swarm_pz.evaluation.rollout import FaultError, Game, play_or_forfeit
from swarm_pz.evaluation.workers import open_pool, share
from swarm_pz.policy import Player, digest_of, folder_of, sort_of

_BLOCK = 20
"""Games that one process plays side by side."""
_PATIENCE = 600.0
"""Extra seconds for a reset and a first command, which may load and compile code."""

_OUTCOMES = tuple(POINTS)

Loader = Callable[[str, GameConfig], Player]


@dataclass(frozen=True, kw_only=True)
class TournamentConfig(Config):
    """Settings of all games of a tournament."""

    games: Annotated[int, Range(2, 10**6)] = 40
    """Games of every two players, half from each side; must be even, and may be raised later."""
    seed: Annotated[int, Range(0, 2**128 - 1)] = 0
    """Seed of all games; all pairs of players play from the same starts."""
    budget_ms: Annotated[float, Range(1e-3, 1e7)] = 2000.0
    """Milliseconds for a command; a player that takes longer forfeits the game."""
    game: GameConfig = field(default_factory=GameConfig)
    """The rules. The first of two controllers flies for the player whose name is first in the alphabet."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check(self.games % 2 == 0, "games", self.games, "even, half for each side")
        self.game.to_dict()  # refuses control systems that are not installed


def play_block(
    loader: Loader,
    one: str,
    other: str,
    numbers: Sequence[int],
    config: TournamentConfig,
    digests: Mapping[str, str] = MappingProxyType({}),
    *bundles: PolicyBundle | None,
) -> list[PlayedGame]:
    """Play some games of two players; a policy that fails in a game forfeits it.

    Players without an entry in `digests` are not checked. On another machine, `bundles` hold the files of `one` and of
    `other` if they come from folders. Raises a WorkerError if a player cannot be loaded here or has another digest;
    that is not a forfeit.
    """
    carried = dict(zip((one, other), bundles, strict=False))

    def make(name: str) -> Player:
        return load_verified(name, config.game, digests.get(name), carried.get(name), loader)

    def clock(games: int, is_first: bool) -> AbstractContextManager[None]:
        return alarm(games * config.budget_ms / 1000.0 + (_PATIENCE if is_first else 0.0))

    games = play_or_forfeit(
        lambda: (make(one), make(other)),
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
    """A tournament of two or more players in a folder, new or continued; one process plays in a folder at a time.

    The folder holds ``tournament.json``, the settings with the `command` line, and ``games.jsonl``, the finished games.
    `loader` makes a policy from a name and a game. It must be picklable, and may have a method `folder_of` from a name
    to a folder. `sorts` maps each player to its `sort_of`. Raises a PolicyError if a player is unknown or cannot be
    made, and a ResultsError if the folder holds another tournament or corrupt files.
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
        """Return all pairs of players, each pair in alphabetical order."""
        return list(itertools.combinations(sorted(self.players), 2))

    def rules_of(self, one: str, other: str) -> TournamentConfig:
        """Return the settings of the games of two players: here, the same for all."""
        return self.config

    def missing(self) -> list[tuple[str, str, list[int]]]:
        """Return the blocks of games that are still to be played."""
        blocks = []
        planned = {name for name, sort in self.sorts.items() if sort == "planned"}
        for one, other in self.pairings():
            numbers = [number for number in range(self.config.games) if (one, other, number) not in self.games]
            size = _BLOCK // 10 if {one, other} & planned else _BLOCK  # planners compute one game at a time
            blocks += [(one, other, numbers[start : start + size]) for start in range(0, len(numbers), size)]
        # Long blocks first, so that no process works alone at the end.
        return sorted(blocks, key=lambda block: not {block[0], block[1]} & planned)

    def play(
        self,
        processes: int = 1,
        progress: Callable[[int, int], None] | None = None,
        should_stop: Callable[[], bool] = lambda: False,
        pool: Executor | None = None,
    ) -> None:
        """Play the missing games, with processes or in a pool, which is left open.

        `progress` is called with games finished and games that were missing, `should_stop` between blocks. Finished
        games are always kept. Raises a ResultsError if another process plays in the folder, or it holds another
        tournament; a WorkerError if a process died, or a player changed; Stopped if games are left.
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

    def between(self, one: str, other: str) -> list[PlayedGame]:
        """Return the finished games of two players, ordered by number."""
        keys = [(*sorted((one, other)), number) for number in range(self.config.games)]
        return [self.games[key] for key in keys if key in self.games]

    def counting(self, one: str, other: str) -> list[list[PlayedGame]]:
        """Return lists of two players' games that each count once; only identical games of a pair share a list."""
        groups: dict[tuple[int, str], list[PlayedGame]] = {}
        for game in self.between(one, other):
            groups.setdefault((game.number // 2, game.fingerprint), []).append(game)
        return list(groups.values())

    def tally(self, player: str, other: str) -> NDArray[np.float64]:
        """Return a player's wins, draws and losses in each pair of games (pairs, 3); identical games count half."""
        pairs: dict[int, list[float]] = {}
        for alike in self.counting(player, other):
            row = pairs.setdefault(alike[0].number // 2, [0.0] * len(_OUTCOMES))
            for game in alike:
                row[_OUTCOMES.index(game.outcome_of(player))] += 1.0 / len(alike)
        return np.array(list(pairs.values())).reshape(-1, len(_OUTCOMES))

    def results(self) -> Results:
        """Return the points of every pairing."""
        points = {}
        for i, j in itertools.combinations(range(len(self.players)), 2):
            counts = self.tally(self.players[i], self.players[j])
            points[i, j] = np.stack([counts @ [POINTS[outcome] for outcome in _OUTCOMES], counts.sum(axis=1)], axis=1)
        return Results(self.players, points)
