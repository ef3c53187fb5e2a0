"""Matches: two policies, both sides, the same seeds for both; and what the games say.

Games come in pairs: the policy plays red and then blue from the same start. Where the two games of
a pair are the same game (two deterministic policies that play alike), the pair counts once.
"""

from __future__ import annotations

import json
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from swarm_pz.batch_env import BatchEnv
from swarm_pz.config import RED, TEAM_NAMES, GameConfig
from swarm_pz.errors import CommandError, PolicyError
from swarm_pz.intervals import middle, wilson
from swarm_pz.policy import Player, PrivilegedPolicy, ask, load_players, name_of
from swarm_pz.provenance import provenance
from swarm_pz.scenario import check_seed

_BATCH = 256
"""Games played side by side; results do not depend on it."""
_RESAMPLES = 10_000
POINTS = {"win": 1.0, "draw": 0.5, "loss": 0.0}
"""What an outcome is worth where games are added up."""
_MATCH = 7
"""Sets the seeds of matches apart from those of training."""


@dataclass(frozen=True, kw_only=True)
class Game:
    """One finished game, from the policy's side.

    Attributes
    ----------
    pair : int
        Number of the seed that this game shares with another, sides swapped.
    side : {"red", "blue"}
    outcome : {"win", "draw", "loss"}
    share : float
        The policy's final share of all drones.
    seconds : float
        Length of the game.
    captures, recaptures : int
        Drones taken by both teams together, and those taken back within a second.
    fingerprint : bytes
        Equal for two games that ended alike in every position and team.
    sizes : list of int
        Red's drones at the start and after every step.
    thinking_ms : (float, float)
        Mean milliseconds a command of the policy and of its opponent; not the same twice.
    """

    pair: int
    side: str
    outcome: str
    share: float
    seconds: float
    captures: int
    recaptures: int
    fingerprint: bytes
    sizes: list[int]
    thinking_ms: tuple[float, float] = field(default=(0.0, 0.0), compare=False)


@dataclass(frozen=True, kw_only=True)
class MatchResult:
    """The games of a match and the settings behind them.

    Attributes
    ----------
    policy, opponent : str
    seed : int
    config : GameConfig
    limit_s : float
        Seconds until a draw.
    games : list of Game
    privileged : tuple of str
        Those of the two that see the simulator itself.
    """

    policy: str
    opponent: str
    seed: int
    config: GameConfig
    limit_s: float
    games: list[Game]
    privileged: tuple[str, ...] = ()

    @property
    def unique(self) -> list[Game]:
        """The games that count: of a pair that is the same game twice, the one with the policy as red."""
        first_of_pair = {game.pair: game.fingerprint for game in reversed(self.games)}
        seen: set[int] = set()
        kept = []
        for game in self.games:
            if game.pair in seen and game.fingerprint == first_of_pair[game.pair]:
                continue
            seen.add(game.pair)
            kept.append(game)
        return kept

    def count(self, outcome: str) -> int:
        """Count unique games that ended in "win", "draw" or "loss"."""
        return sum(game.outcome == outcome for game in self.unique)

    def standing(self) -> str:
        """Return games won-drawn-lost."""
        return f"{self.count('win')}-{self.count('draw')}-{self.count('loss')}"

    def score(self) -> float:
        """Return the share of the points, a draw being half a win."""
        return float(np.mean([POINTS[game.outcome] for game in self.unique]))

    def win_rate_interval(self) -> tuple[float, float]:
        """Return the 95 % interval of the win rate.

        Wilson's where all pairs are two different games, or where all or none are won; a bootstrap
        over pairs otherwise.
        """
        games = self.unique
        # Where all games or none are won, a bootstrap has nothing to draw from.
        if len(games) == len(self.games) or self.count("win") in (0, len(games)):
            return wilson(self.count("win"), len(games))
        wins: dict[int, list[float]] = {}
        for game in games:
            wins.setdefault(game.pair, []).append(float(game.outcome == "win"))
        totals = np.array([[sum(pair), len(pair)] for pair in wins.values()])
        drawn = np.random.default_rng(0).integers(len(totals), size=(_RESAMPLES, len(totals)))
        rates = totals[drawn, 0].sum(axis=1) / totals[drawn, 1].sum(axis=1)
        low, high = middle(rates)
        return float(low), float(high)

    def summary(self) -> dict[str, Any]:
        """Return the figures of the match as plain values, ready for JSON."""
        games = self.unique
        seconds = np.array([game.seconds if game.outcome != "draw" else self.limit_s for game in games])
        low, high = self.win_rate_interval()
        return {
            "policy": self.policy,
            "opponent": self.opponent,
            "privileged": list(self.privileged),
            "seed": self.seed,
            "games": len(games),
            "unique_games": len({game.fingerprint for game in games}),
            "wins": self.count("win"),
            "draws": self.count("draw"),
            "losses": self.count("loss"),
            "win_rate": self.count("win") / len(games),
            "win_rate_ci95": [low, high],
            "mean_share": float(np.mean([game.share for game in self.games])),
            "median_seconds": float(np.median(seconds)),
            "restricted_mean_seconds": float(seconds.mean()),
            "time_limit": self.limit_s,
            "thinking_ms": np.mean([game.thinking_ms for game in self.games], axis=0).round(3).tolist(),
            "config_hash": self.config.hash,
            "rules_hash": self.config.rules_hash,
        }

    def write(self, path: Path, command: str = "") -> None:
        """Write the summary as JSON, with where it comes from: see `swarm_pz.provenance`."""
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(self.summary() | provenance(self.config, command), indent=2) + "\n")


def play_match(
    policy: str | Player,
    opponent: str | Player,
    *,
    games: int,
    seed: int = 0,
    config: GameConfig | None = None,
    threads: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> MatchResult:
    """Play a match, half of the games from each side.

    Parameters
    ----------
    policy, opponent : str or Policy
    games : int
        Even.
    seed : int
        Of the match; games and both policies' random streams follow from it.
    config : GameConfig, optional
        The rules. Handicaps swap sides with the policies.
    threads : int
    progress : callable, optional
        Called with (games finished, games in all) after every step.

    Raises
    ------
    CommandError
        If `games` is odd or below 2.
    PolicyError
        If a policy is unknown or answers nonsense.
    """
    if not isinstance(games, int) or isinstance(games, bool) or games < 2 or games % 2:
        raise CommandError(f"games must be an even number of at least 2, half for each side, got {games!r}")
    if isinstance(seed, np.random.SeedSequence):
        raise CommandError(f"a match's seed is a whole number, which its games' seeds follow from, got {seed!r}")
    check_seed(seed)
    config = config if config is not None else GameConfig()
    players = load_players(policy, opponent, config)
    played: list[Game] = []

    def report(done: int) -> None:
        if progress is not None:
            progress(len(played) + done, games)

    for start in range(0, games, _BATCH):
        numbers = range(start, min(start + _BATCH, games))
        played += play_games(players, numbers, seed=seed, config=config, threads=threads, progress=report)
    names = name_of(policy), name_of(opponent)
    return MatchResult(
        policy=names[0],
        opponent=names[1],
        seed=seed,
        config=config,
        limit_s=config.time_limit,
        games=played,
        privileged=tuple(n for n, player in zip(names, players, strict=True) if isinstance(player, PrivilegedPolicy)),
    )


class FaultError(PolicyError):
    """A policy raised, or answered nonsense or too late.

    Attributes
    ----------
    place : int
        0 for the policy, 1 for its opponent.
    """

    def __init__(self, place: int, reason: str) -> None:
        super().__init__(place, reason)  # as it was called, so that it can cross processes
        self.place, self.reason = place, reason

    def __str__(self) -> str:
        return self.reason


def play_games(
    players: tuple[Player, Player],
    numbers: Sequence[int],
    *,
    seed: int,
    config: GameConfig,
    threads: int = 1,
    progress: Callable[[int], None] | None = None,
    clock: Callable[[int, bool], AbstractContextManager[None]] | None = None,
) -> list[Game]:
    """Play games of a match by number: 2p is pair p with the policy as red, 2p + 1 with it as blue.

    Parameters
    ----------
    players : (Player, Player)
    numbers : sequence of int
        A game does not depend on which others are played with it.
    seed : int
        Of the match.
    config : GameConfig
    threads : int
    progress : callable, optional
        Called with the games finished after every step.
    clock : callable, optional
        From a number of games and whether they begin, to a context in which a policy gets ready or
        gives its commands, and which raises if that takes too long.

    Raises
    ------
    FaultError
        If a policy raises, answers nonsense or too late.
    """
    allow = clock if clock is not None else lambda *_: nullcontext()
    batch = BatchEnv(config, len(numbers), threads=threads)
    # Three streams a pair, the same for both of its games: the start and one for each policy.
    streams = [[np.random.SeedSequence(seed, spawn_key=(_MATCH, n // 2, i)) for i in range(3)] for n in numbers]
    sides = np.stack([np.array(numbers) % 2, 1 - np.array(numbers) % 2])
    everyone = np.arange(len(numbers))
    batch.reset([stream[0] for stream in streams])
    for place, player in enumerate(players):
        with blame(place, name_of(player)), allow(len(numbers), True):
            player.reset([stream[1 + place] for stream in streams], everyone)
    cells = config.command_cells
    spent = np.zeros((2, len(numbers)))
    sizes = [batch.simulator.sizes[:, RED]]
    while batch.running.any():
        rows = np.flatnonzero(batch.running)
        commands = np.zeros((len(numbers), 2, cells, cells))
        for place, player in enumerate(players):
            began = time.perf_counter()
            with blame(place, name_of(player)), allow(len(rows), len(sizes) == 1):
                commands[rows, sides[place, rows]] = ask(player, batch, sides[place, rows], rows)
            spent[place, rows] += 1000.0 * (time.perf_counter() - began) / len(rows)
        batch.step_checked(commands)
        sizes.append(batch.simulator.sizes[:, RED])
        if progress is not None:
            progress(int((~batch.running).sum()))
    history = np.stack(sizes, axis=1)
    simulator = batch.simulator
    finished = []
    for row, number in enumerate(numbers):
        side = int(sides[0, row])
        steps = -(-int(simulator.games.ticks[row]) // config.step_ticks)
        finished.append(
            Game(
                pair=int(number) // 2,
                side=TEAM_NAMES[side],
                outcome=batch.outcome(row, side) or "draw",
                share=float(simulator.sizes[row, side] / config.num_drones),
                seconds=float(simulator.time_s[row]),
                captures=int(simulator.games.captures[row].sum()),
                recaptures=int(simulator.games.recaptures[row].sum()),
                fingerprint=simulator.positions[row].tobytes() + simulator.teams[row].tobytes(),
                sizes=history[row, : steps + 1].tolist(),
                thinking_ms=(float(spent[0, row] / steps), float(spent[1, row] / steps)),
            )
        )
    batch.close()
    return finished


@contextmanager
def blame(place: int, name: str) -> Iterator[None]:
    """Turn whatever a policy does wrong in here into a FaultError that says where."""
    try:
        yield
    except PolicyError as error:
        raise FaultError(place, str(error)) from error
    except (Exception, SystemExit) as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(last.filename).name}:{last.lineno}"
        raise FaultError(place, f"policy {name} raised {error!r} ({where})") from error


def paired_difference(first: MatchResult, second: MatchResult, seed: int = 0) -> tuple[float, float, float]:
    """Compare the mean final share of two policies that played the same opponent on the same seeds.

    Returns
    -------
    difference, low, high : float
        Mean of first - second, and its 95 % interval from a bootstrap over seeds.

    Raises
    ------
    CommandError
        If the matches do not share opponent, seed, number of games and rules.
    """
    keys = [(match.opponent, match.seed, len(match.games), match.config.rules_hash) for match in (first, second)]
    if keys[0] != keys[1]:
        raise CommandError(f"the matches must share opponent, seed, games and rules, got {keys[0]} and {keys[1]}")
    shares = []
    for match in (first, second):
        by_pair = np.zeros(len(match.games) // 2)
        for game in match.games:
            by_pair[game.pair] += game.share / 2
        shares.append(by_pair)
    differences = shares[0] - shares[1]
    drawn = np.random.default_rng(seed).integers(len(differences), size=(_RESAMPLES, len(differences)))
    low, high = middle(differences[drawn].mean(axis=1))
    return float(differences.mean()), float(low), float(high)
