"""Ratings of a field with intervals, the cyclic part that they miss, and Nash averaging.

In the Bradley-Terry model player i beats j with probability 1 / (1 + exp(r_j - r_i)) (Biometrika 39, 1952). Strengths r
cannot describe cycles (see `intransitivity`) and depend on who else plays (see `nash_average`).
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_pz.errors import ResultsError, require_extra
from swarm_pz.evaluation.intervals import middle, wilson

Array = NDArray[np.float64]

SCALE = 400.0 / np.log(10.0)
"""Rating points of one unit of r: 400 points are odds of ten to one, as in Elo."""
ANCHOR = 1000.0
"""Rating of the anchor."""
PRIOR = 0.5
"""Points that each player has against each other before the first game, so that ratings are finite."""
_RESAMPLES = 400
_SIMULATIONS = 100
_LP = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
_SLACKS, _TIGHT = (1e-9, 1e-8, 1e-7, 1e-6), 1e-6
"""Tolerances for levels that were found, tried in turn, and the minimum dual value of a tight row."""


@dataclass(frozen=True)
class Results:
    """A round robin: for players i < j, `points[i, j]` (pairs, 2) has i's points and the games of each pair."""

    players: tuple[str, ...]
    points: dict[tuple[int, int], Array]

    def payoffs(self) -> tuple[Array, Array]:
        """Return each player's points (n, n) against each other and the games between them (n, n)."""
        n = len(self.players)
        points, games = np.zeros((n, n)), np.zeros((n, n))
        for (i, j), pairs in self.points.items():
            won, played = pairs.sum(axis=0)
            points[i, j], points[j, i] = won, played - won
            games[i, j] = games[j, i] = played
        return points, games

    def reweighted(self, generator: np.random.Generator) -> Array:
        """Return points (n, n) with random exponential weights of pairs of games and of the prior.

        This is the Bayesian bootstrap (Rubin, Annals of Statistics 9, 1981), which has a width even for equal results.
        """
        n = len(self.players)
        points = np.zeros((n, n))
        for (i, j), pairs in self.points.items():
            weights = generator.exponential(size=len(pairs))
            won, played = weights @ pairs
            prior_won, prior_lost = PRIOR * generator.exponential(size=2)
            points[i, j], points[j, i] = won + prior_won, played - won + prior_lost
        return points


@dataclass(frozen=True)
class Ratings:
    """Ratings in points, (n,) each: the estimate and its 95 % interval."""

    values: Array
    low: Array
    high: Array


def strengths(points: Array) -> Array:
    """Return maximum-likelihood strengths r (n,), mean 0, of points (n, n), all positive off the diagonal."""
    choix = require_extra("choix", "cli")
    return np.asarray(choix.ilsr_pairwise_dense(points, max_iter=1000))


def _with_prior(points: Array) -> Array:
    return points + PRIOR * (1.0 - np.eye(len(points)))


def rate(results: Results, anchor: str | None = None) -> Ratings:
    """Rate a field of two or more players, with games of every two; the anchor, or else the mean, has 1000 points.

    The intervals are from a bootstrap over pairs of games.
    """

    def scaled(values: Array) -> Array:
        origin = values.mean() if anchor is None else values[results.players.index(anchor)]
        return np.asarray(ANCHOR + SCALE * (values - origin))

    generator, points = np.random.default_rng(0), results.payoffs()[0]
    drawn = [scaled(strengths(results.reweighted(generator))) for _ in range(_RESAMPLES)]
    return Ratings(scaled(strengths(_with_prior(points))), *middle(drawn))


@dataclass(frozen=True)
class Intransitivity:
    """The distance of a field from a ladder."""

    cyclic_share: float
    """Fraction of the squared log-odds that no rating explains; 1 is pure rock-paper-scissors."""
    expected: float
    """Mean `cyclic_share` of simulated fields that ratings describe, with as many games."""
    cycles: int
    """Cycles among the `triples`."""
    triples: int
    """Triples of players with three decided pairings (95 % intervals above one half)."""
    strongest: tuple[str, ...]
    """The clearest cycle: each beats the next."""


def _cyclic_share(points: Array, games: Array) -> float:
    odds = np.log((points + PRIOR) / (games - points + PRIOR))
    np.fill_diagonal(odds, 0.0)
    means = odds.mean(axis=1)
    rest = odds - (means[:, None] - means[None, :])
    total = float((odds**2).sum())
    return float((rest**2).sum()) / total if total else 0.0


def intransitivity(results: Results) -> Intransitivity:
    """Measure the distance of a field from a ladder.

    Ratings explain the part r_i - r_j, r_i = mean_j L_ij, of the log-odds L; the rest is cyclic (combinatorial Hodge
    decomposition; Balduzzi et al., "Re-evaluating evaluation", NeurIPS 2018).
    """
    points, games = results.payoffs()
    n = len(results.players)
    ratings = strengths(_with_prior(points))
    chances = 1.0 / (1.0 + np.exp(ratings[None, :] - ratings[:, None]))
    generator = np.random.default_rng(0)
    simulated = []
    for _ in range(_SIMULATIONS):
        upper = np.triu(generator.binomial(games.astype(np.int64), chances), 1)
        simulated.append(_cyclic_share(upper + np.tril(games - upper.T, -1), games))
    lowest = np.zeros((n, n))
    for i, j in itertools.permutations(range(n), 2):
        played, won = round(games[i, j]), round(points[i, j])
        if played:
            lowest[i, j] = wilson(min(won, played), played)[0]
    beats = lowest > 0.5
    cycles: list[tuple[float, tuple[int, int, int]]] = []
    decided = 0
    for i, j, k in itertools.combinations(range(n), 3):
        if all(beats[a, b] or beats[b, a] for a, b in ((i, j), (j, k), (i, k))):
            decided += 1
            for a, b, c in ((i, j, k), (i, k, j)):
                if beats[a, b] and beats[b, c] and beats[c, a]:
                    cycles.append((min(lowest[a, b], lowest[b, c], lowest[c, a]), (a, b, c)))
    strongest: Sequence[int] = max(cycles)[1] if cycles else ()
    return Intransitivity(
        cyclic_share=_cyclic_share(points, games),
        expected=float(np.mean(simulated)),
        cycles=len(cycles),
        triples=decided,
        strongest=tuple(results.players[i] for i in strongest),
    )


def nash_average(shares: Array) -> tuple[Array, Array]:
    """Return the equilibrium mixture (n,) of a field, and every player's skill (n,) against it.

    In the game, both sides choose a player. Linear programs choose one of its equilibria: they minimise the largest
    skill, then the next largest, and so on, then likewise the shares. Both results are unique, and clones of a player
    change no skill (Marris et al., "Deviation ratings", arXiv 2502.11645, 2025); with maximum entropy they may
    (Balduzzi et al., "Re-evaluating evaluation", NeurIPS 2018).

    `shares` (n, n) are the points that each player (row) takes from each other (column); the diagonal is ignored. A
    skill is a share of the points against the mixture minus one half, at most 0 within 1e-6. Raises a ResultsError if
    rounding keeps the linear programs from being solved.
    """
    linprog = require_extra("scipy.optimize", "cli").linprog
    n = len(shares)
    advantage = (shares - shares.T) / 2.0
    np.fill_diagonal(advantage, 0.0)
    rows, levels = np.vstack([advantage, np.eye(n)]), np.ones(2 * n)
    cost, total = np.append(np.zeros(n), 1.0), np.append(np.ones(n), 0.0)[None]
    bounds = [(0.0, None)] * n + [(None, None)]  # the mixture, and the level that is sought
    for begin in (0, n):
        is_open = np.arange(2 * n) // n == begin // n
        while is_open.any():
            table = np.column_stack([rows, -1.0 * is_open])
            for slack in _SLACKS:
                limits = np.where(is_open, 0.0, levels + slack)
                solution = linprog(cost, table, limits, total, [1.0], bounds, options=_LP)
                if solution.success:
                    break
            else:
                raise ResultsError(
                    f"Nash averaging must solve a linear program of {n} players, and SciPy failed: {solution.message}; "
                    "play more games, or leave a player out"
                )
            # A row with a dual value is equal in all solutions; dual values of open rows sum to -1.
            is_tight = is_open & (solution.ineqlin.marginals < -_TIGHT)
            levels[is_tight], mixture = solution.fun, np.maximum(solution.x[:n], 0.0)
            is_open &= ~is_tight
    mixture /= mixture.sum()
    return mixture, np.asarray(advantage @ mixture)
