"""The search for patterns that beat a policy: CMA-ES, without learning.

Hansen, "The CMA evolution strategy: a tutorial", arXiv 1604.00772; the package cma implements it.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.errors import Stopped, require_extra
from swarm_pz.evaluation.bundles import PolicyBundle, unpacked_policy
from swarm_pz.evaluation.rollout import FaultError, Rollout
from swarm_pz.evaluation.workers import share
from swarm_pz.policies.pattern import BOUNDS, KINDS, PatternPlayer, name_of, numbers_of, points_of
from swarm_pz.policy import load

Array = NDArray[np.float64]
Score = Callable[[Array], Array]

_SPREAD = 0.12
"""Standard deviation, in the unit cube, of the first candidates of a kind."""
_BEST_KINDS = 2
"""Number of kinds from which CMA-ES continues."""
_PARTS = 4
"""Tasks into which a generation is split."""


@dataclass(frozen=True)
class Target:
    """A policy to search against: its name or folder, its digest if known, and its files for other machines."""

    policy: str
    game: GameConfig
    digest: str | None = None
    bundle: PolicyBundle | None = None


def rounds_of(generations: int) -> int:
    """Return the number of times that `search` asks for scores."""
    return len(KINDS) + _BEST_KINDS * generations


def search(score: Score, *, generations: int, candidates: int, seed: int, keep: int = 3) -> list[str]:
    """Return the names of the best patterns that a search finds, the best first.

    `score` maps patterns' numbers (n, 13) to scores (n,). As many candidates of each kind are tried as in a generation.
    CMA-ES then continues from the best candidate of each of the two best kinds.
    """
    cma = require_extra("cma", "train")
    generator = np.random.default_rng(seed)
    scored: list[tuple[float, str]] = []

    def tried(points: Array) -> Array:
        numbers = numbers_of(points)
        values = score(numbers)
        scored.extend(zip(values.tolist(), map(name_of, numbers), strict=True))
        return values

    begun = []
    for kind in KINDS.values():
        centre = points_of(np.array([list(kind.values())]))
        points = (
            centre + _SPREAD * generator.normal(size=(candidates, len(BOUNDS))) * (np.arange(candidates) > 0)[:, None]
        )
        values = tried(points)
        begun.append((float(values.max()), np.clip(points[int(values.argmax())], 0.0, 1.0)))
    for _, point in sorted(begun, key=lambda one: -one[0])[:_BEST_KINDS]:
        options = {"bounds": [0.0, 1.0], "popsize": candidates, "seed": seed + 1, "verbose": -9, "CMA_stds": None}
        strategy = cma.CMAEvolutionStrategy(point, _SPREAD, options)
        for _ in range(generations):
            proposals = strategy.ask()
            strategy.tell(proposals, (-tried(np.array(proposals))).tolist())
    return list(dict.fromkeys(name for _, name in sorted(scored, reverse=True)))[:keep]


def search_against(
    target: Target,
    *,
    games: int,
    generations: int,
    candidates: int,
    seed: int,
    pool: Executor,
    show: Callable[..., None] = lambda *_: None,
    should_stop: Callable[[], bool] = lambda: False,
) -> list[str]:
    """Return the names of the patterns that a search finds to be best against a policy, the best first.

    Each candidate plays `games` games. Raises Stopped if `should_stop` returns True; no results are kept.
    """
    rounds = 0

    def score(numbers: Array) -> Array:
        nonlocal rounds
        parts = np.array_split(np.arange(len(numbers)), min(_PARTS, len(numbers)))
        values = np.full(len(numbers), np.nan)

        def keep(task: tuple[Any, ...], won: Array) -> None:
            values[parts[task[0]]] = won

        tasks = [(place, target, numbers[part], games, seed) for place, part in enumerate(parts)]
        share(pool, worth, tasks, keep, should_stop=should_stop, name=lambda _: f"the search against {target.policy}")
        if np.isnan(values).any():
            raise Stopped(f"the search against {target.policy} begins again")
        rounds += 1
        show(rounds, rounds_of(generations))
        return values

    return search(score, generations=generations, candidates=candidates, seed=seed)


def worth(place: int, target: Target, numbers: Array, games: int, seed: int) -> Array:  # noqa: ARG001
    """Return patterns' mean final share of the drones (n,) against a policy; a task for a pool.

    A policy that fails loses all games. `place` is the task's index.
    """
    game = target.game
    with unpacked_policy(target.policy, game, target.digest, target.bundle) as name:
        try:
            players = PatternPlayer(np.repeat(numbers, games, axis=0), game), load(name, game)
            with closing(Rollout(*players, [*range(games)] * len(numbers), seed=seed, config=game)) as rollout:
                rollout.play()
                played = rollout.games()
        except FaultError as fault:
            if fault.place == 0:
                raise
            return np.ones(len(numbers))
    shares = [game.share for game in played]
    return np.asarray(np.reshape(shares, (len(numbers), games)).mean(axis=1))
