"""Matches: two policies, both sides, the same seeds for both.

The policy plays a pair of games from each start: as red, and as blue. A pair whose games are identical counts once.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.config.base import check, check_count
from swarm_pz.errors import CommandError
from swarm_pz.evaluation.intervals import middle, wilson
from swarm_pz.evaluation.provenance import provenance
from swarm_pz.evaluation.rollout import Game, play_or_forfeit
from swarm_pz.files import write_json
from swarm_pz.policy import Player, PrivilegedPolicy, load_players, name_of

_BATCH = 256
"""Games played side by side; results do not depend on it."""
_RESAMPLES = 10_000
POINTS = {"win": 1.0, "draw": 0.5, "loss": 0.0}
"""Points of each outcome."""


@dataclass(frozen=True, kw_only=True)
class MatchResult:
    """The games and settings of a match; `privileged` are players that read the simulator."""

    policy: str
    opponent: str
    seed: int
    config: GameConfig
    limit_s: float
    games: list[Game]
    privileged: tuple[str, ...] = ()

    @property
    def unique(self) -> list[Game]:
        """The games that count: of two identical games, only the one as red."""
        return list({(game.pair, game.fingerprint): game for game in reversed(self.games)}.values())[::-1]

    @property
    def lost(self) -> list[Game]:
        """Games that count and that the policy lost."""
        return [game for game in self.unique if game.outcome == "loss"]

    @property
    def forfeits(self) -> list[Game]:
        """Games that a side lost by a fault."""
        return [game for game in self.games if game.forfeit]

    def count(self, outcome: str) -> int:
        """Count unique games that ended in "win", "draw" or "loss"."""
        return sum(game.outcome == outcome for game in self.unique)

    def standing(self) -> str:
        """Return games won-drawn-lost."""
        return f"{self.count('win')}-{self.count('draw')}-{self.count('loss')}"

    def score(self) -> float:
        """Return the share of the points; a draw is half a win."""
        return float(np.mean([POINTS[game.outcome] for game in self.unique]))

    def win_rate_interval(self) -> tuple[float, float]:
        """Return the 95 % interval of the win rate: Wilson's, or a bootstrap over pairs if some games are identical."""
        games = self.unique
        # If all games, or none, are won, a bootstrap has no width.
        if len(games) == len(self.games) or self.count("win") in (0, len(games)):
            return wilson(self.count("win"), len(games))
        totals: dict[int, NDArray[np.float64]] = defaultdict(lambda: np.zeros(2))
        for game in games:
            totals[game.pair] += (game.outcome == "win", 1.0)
        pairs = np.array(list(totals.values()))
        return _bootstrap(pairs, lambda drawn: drawn[..., 0].sum(axis=1) / drawn[..., 1].sum(axis=1))

    def share(self) -> float:
        """Return the mean final fraction of the drones over all games."""
        return float(np.mean([game.share for game in self.games]))

    def share_interval(self) -> tuple[float, float]:
        """Return the 95 % interval of the mean final fraction, from a bootstrap over pairs."""
        return _bootstrap(self.share_by_pair())

    def share_by_pair(self) -> NDArray[np.float64]:
        """Return the mean final fraction of each pair of games."""
        by_pair = np.zeros(len(self.games) // 2)
        for game in self.games:
            by_pair[game.pair] += game.share / 2
        return by_pair

    def summary(self) -> dict[str, Any]:
        """Return the figures of the match as plain values."""
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
            "mean_share": self.share(),
            "mean_share_ci95": list(self.share_interval()),
            "median_seconds": float(np.median(seconds)),
            "restricted_mean_seconds": float(seconds.mean()),
            "time_limit": self.limit_s,
            "thinking_ms": np.mean([game.thinking_ms for game in self.games], axis=0).round(3).tolist(),
            "config_hash": self.config.hash,
            "rules_hash": self.config.rules_hash,
        }

    def write(self, path: Path, command: str = "") -> None:
        """Write the summary as JSON, with lost and forfeited games and the `provenance`."""
        figures = self.summary()
        figures["lost"] = [{"pair": game.pair, "side": game.side, "seconds": game.seconds} for game in self.lost]
        if forfeits := self.forfeits:
            figures["forfeits"] = [{"pair": one.pair, "side": one.side, "reason": one.forfeit} for one in forfeits]
        write_json(path, figures | provenance(self.config, command))


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
    """Play a match of an even number of games, half from each side, by the rules of `config` (see `Rollout`).

    `progress` is called after every step with the numbers of finished and of all games. A side whose control system
    or program fails or takes too long forfeits the game. Raises a ConfigError if `games` is odd or below 2, and a
    PolicyError if a policy is unknown or returns invalid commands.
    """
    games = check_count(games, "games", 2, 10**9)
    check(games % 2 == 0, "games", games, "an even number, half for each side")
    config = config if config is not None else GameConfig()
    players, played = load_players(policy, opponent, config), list[Game]()

    def report(ended: int) -> None:
        if progress is not None:
            progress(len(played) + ended, games)

    for start in range(0, games, _BATCH):
        numbers = range(start, min(start + _BATCH, games))
        played += play_or_forfeit(lambda: players, numbers, progress=report, seed=seed, config=config, threads=threads)
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


def paired_difference(first: MatchResult, second: MatchResult) -> tuple[float, float, float]:
    """Compare the mean final fraction of two policies that played the same opponent on the same seeds.

    Returns the mean of first - second, and the low and high ends of its 95 % interval from a bootstrap over seeds.
    Raises a CommandError if the matches do not share opponent, seed, number of games and rules.
    """
    keys = [(match.opponent, match.seed, len(match.games), match.config.rules_hash) for match in (first, second)]
    if keys[0] != keys[1]:
        raise CommandError(f"the matches must share opponent, seed, games and rules, got {keys[0]} and {keys[1]}")
    differences = first.share_by_pair() - second.share_by_pair()
    return float(differences.mean()), *_bootstrap(differences)


def _bootstrap(
    values: NDArray[np.float64],
    statistic: Callable[[NDArray[np.float64]], NDArray[np.float64]] = lambda drawn: drawn.mean(axis=1),
) -> tuple[float, float]:
    """Return the bootstrap interval of a statistic, by default the mean, of values (n, ...), one for each pair."""
    drawn = np.random.default_rng(0).integers(len(values), size=(_RESAMPLES, len(values)))
    low, high = middle(statistic(values[drawn]))
    return float(low), float(high)
