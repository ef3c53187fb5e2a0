"""A double oracle among patterns: a population that grows by what beats its own equilibrium.

McMahan et al., "Planning in the presence of cost functions controlled by an adversary", ICML 2003. Patterns cost no
network, so their games are cheap.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.errors import CheckpointError, Stopped
from swarm_pz.evaluation.ratings import nash_average
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.evaluation.workers import never, silent
from swarm_pz.files import draft_of
from swarm_pz.policies.pattern import BOUNDS, KINDS, PatternPlayer, numbers_of, points_of
from swarm_pz.policy import Player

Array = NDArray[np.float64]

_GAMES = 24
"""Games of each pair."""
_HALVINGS = ((96, 8), (32, 16), (10, 40), (3, 100))
"""Candidates that are left, and games that each of them plays next."""
_KEPT = 2
"""Candidates that join the population."""
_NEAR, _WIDE, _CROSSED = 0.06, 0.08, 0.04
"""Standard deviations, in the unit cube, of candidates around the equilibrium, any pattern, and a mixture of two."""
_AROUND_EQUILIBRIUM, _AROUND_ANY, _MIXED = 0, 1, 2
"""Kinds of candidates; the rest are drawn evenly."""
_SHARES_OF_KINDS = (0.3, 0.25, 0.2, 0.25)
_CHANGED = 0.6
"""Probability that a number of a candidate differs from those it comes from."""


def play(
    ours: Player, theirs: Player, games: int, game: GameConfig, seed: int, *, threads: int = 1
) -> NDArray[np.float64]:
    """Return the shares of the drones (games,) that a player ends with against another."""
    with closing(Rollout(ours, theirs, range(games), seed=seed, config=game, threads=threads)) as rollout:
        rollout.play()
        return np.array([one.share for one in rollout.games()])


def _play(ours: Array, theirs: Array, game: GameConfig, seed: int, threads: int) -> NDArray[np.float64]:
    """Return the shares of the drones (n,) that patterns (n, 13) end with, each in one game against another."""
    return play(PatternPlayer(ours, game), PatternPlayer(theirs, game), len(ours), game, seed, threads=threads)


@dataclass
class Population:
    """Patterns (n, 13), and the share of the drones (n, n) that each (row) ends with against each other."""

    numbers: Array
    shares: Array
    values: list[float] = field(default_factory=list)
    """The share that the best newcomer of each round had against the equilibrium of those before."""

    @classmethod
    def first(cls, game: GameConfig, seed: int, threads: int = 1) -> Population:
        """Return the population of the patterns that have names."""
        empty = cls(np.zeros((0, len(BOUNDS))), np.zeros((0, 0)))
        return empty.joined(np.array([list(kind.values()) for kind in KINDS.values()]), game, seed, threads)

    @classmethod
    def read(cls, path: Path) -> Population:
        """Return the population that a file holds; raise a CheckpointError if it is corrupt."""
        try:
            plain = json.loads(path.read_text())
            numbers, shares = np.array(plain["numbers"], float), np.array(plain["shares"], float)
            n = len(numbers)
            if numbers.shape != (n, len(BOUNDS)) or shares.shape != (n, n):
                raise ValueError(f"{numbers.shape} and {shares.shape}")
            return cls(numbers, shares, [float(value) for value in plain["values"]])
        except (LookupError, TypeError, ValueError) as error:
            raise CheckpointError(
                f"{path} is corrupt or foreign ({error!r}): remove it, and the search begins anew"
            ) from error

    def write(self, path: Path) -> None:
        """Write the population into a file."""
        plain = {"numbers": self.numbers.tolist(), "shares": self.shares.tolist(), "values": self.values}
        with draft_of(path) as draft:
            draft.write_text(json.dumps(plain) + "\n")

    @property
    def equilibrium(self) -> Array:
        """Mixture (n,) against which no pattern of the population gets more than half of the drones."""
        return nash_average(self.shares)[0]

    def joined(self, more: Array, game: GameConfig, seed: int, threads: int) -> Population:
        """Return the population with more patterns, after their games against all others."""
        numbers, old = np.concatenate([self.numbers, more]), len(self.numbers)
        shares = np.full((len(numbers), len(numbers)), 0.5)
        shares[:old, :old] = self.shares
        pairs = np.array([(new, other) for new in range(old, len(numbers)) for other in range(new)])
        ours, theirs = np.repeat(pairs, _GAMES, axis=0).T
        played = _play(numbers[ours], numbers[theirs], game, seed, threads).reshape(-1, _GAMES).mean(axis=1)
        shares[tuple(pairs.T)], shares[tuple(pairs.T[::-1])] = played, 1.0 - played
        return Population(numbers, shares, self.values)

    def grown(self, game: GameConfig, seed: int, threads: int) -> Population:
        """Return the population with the best of many candidates against its equilibrium."""
        generator = np.random.default_rng([seed, len(self.values)])
        mixture = self.equilibrium
        candidates = self._candidates(mixture, generator)
        won, games, left = np.zeros(len(candidates)), np.zeros(len(candidates)), np.arange(len(candidates))
        for count, each in _HALVINGS:
            left = left[np.argsort(-won[left] / np.maximum(games[left], 1.0), kind="stable")[:count]]
            met = np.tile(self.numbers[generator.choice(len(mixture), size=each, p=mixture)], (len(left), 1))
            ours = np.repeat(candidates[left], each, axis=0)
            latest = _play(ours, met, game, int(generator.integers(2**31)), threads).reshape(-1, each)
            won[left] += latest.sum(axis=1)
            games[left] += each
        order = np.argsort(-latest.mean(axis=1), kind="stable")
        grown = self.joined(candidates[left[order[:_KEPT]]], game, int(generator.integers(2**31)), threads)
        grown.values = [*self.values, float(latest.mean(axis=1)[order[0]])]
        return grown

    def _candidates(self, mixture: Array, generator: np.random.Generator) -> Array:
        """Return the numbers (n, 13) of patterns to try."""
        points, (count, _) = points_of(self.numbers), _HALVINGS[0]
        found = generator.random((count, len(BOUNDS)))
        kinds = generator.choice(len(_SHARES_OF_KINDS), size=count, p=_SHARES_OF_KINDS)
        for place, kind in enumerate(kinds):
            one, other = points[generator.integers(len(points), size=2)]
            if kind == _AROUND_EQUILIBRIUM:
                base, spread = points[generator.choice(len(points), p=mixture)], _NEAR
            elif kind == _AROUND_ANY:
                base, spread = one, _WIDE
            else:
                base, spread = np.where(generator.random(len(BOUNDS)) < 0.5, one, other), _CROSSED
            if kind in (_AROUND_EQUILIBRIUM, _AROUND_ANY, _MIXED):
                changed = generator.random(len(BOUNDS)) < _CHANGED
                found[place] = base + spread * changed * generator.normal(size=len(BOUNDS))
        return numbers_of(found)


def double_oracle(
    path: Path,
    rounds: int,
    game: GameConfig,
    *,
    seed: int,
    threads: int = 1,
    say: Callable[[str], None] = silent,
    should_stop: Callable[[], bool] = never,
) -> Population:
    """Return a population after some rounds, each of which is kept in a file, from which a stopped search goes on."""
    population = Population.read(path) if path.exists() else Population.first(game, seed, threads)
    while len(population.values) < rounds:
        if should_stop():
            raise Stopped(f"{path} is saved at round {len(population.values)} of {rounds}")
        population = population.grown(game, seed, threads)
        population.write(path)
        count = int((population.equilibrium > 1e-3).sum())
        say(
            f"double oracle: round {len(population.values)} of {rounds}, {population.values[-1]:.2f} of the drones "
            f"against the equilibrium before, which mixes {count} of {len(population.numbers)} patterns now"
        )
    return population
