"""Who is better: ratings of a field from its games, with intervals, and how far they hold.

The Bradley-Terry model gives player i a strength r_i such that i beats j with probability
1 / (1 + exp(r_j - r_i)) (Bradley & Terry, "Rank analysis of incomplete block designs", Biometrika 39, 1952).
One number a player cannot describe a field in which a beats b, b beats c and c beats a, so
`intransitivity` says how much of the results it leaves out.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarm_pz.errors import CommandError, require_extra

Array = NDArray[np.float64]

SCALE = 400.0 / np.log(10.0)
"""Rating points of one unit of r: 400 points are odds of ten to one, as in Elo's ratings."""
ANCHOR = 1000.0
"""Rating of the player that the scale is fixed to."""
_RESAMPLES = 400


@dataclass(frozen=True)
class Results:
    """The points of a round robin.

    Attributes
    ----------
    players : tuple of str
        n names.
    points : dict of (int, int) to float64 array (pairs, 2)
        For players i < j and each pair of games from the same start: i's points, a draw being half
        a point, and the number of games that count.
    """

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

    def resampled(self, generator: np.random.Generator) -> Results:
        """Return a bootstrap sample: of every pairing, as many pairs of games, drawn with replacement."""
        drawn = {
            pairing: pairs[generator.integers(len(pairs), size=len(pairs))] for pairing, pairs in self.points.items()
        }
        return Results(self.players, drawn)


@dataclass(frozen=True)
class Ratings:
    """Ratings in points, (n,) each: the estimate and its 95 % interval."""

    values: Array
    low: Array
    high: Array


def strengths(points: Array) -> Array:
    """Return maximum-likelihood strengths r (n,), mean 0, of points (n, n).

    Every two players get one drawn game on top, or who never lost would be infinitely strong.
    """
    choix = require_extra("choix", "ladder")
    n = len(points)
    prior = 0.5 * (1.0 - np.eye(n))
    return np.asarray(choix.ilsr_pairwise_dense(points + prior, max_iter=1000))


def rate(results: Results, anchor: str | None = None, seed: int = 0) -> Ratings:
    """Rate a field.

    Parameters
    ----------
    results : Results
    anchor : str, optional
        Player whose rating is 1000; the field's mean if not given.
    seed : int
        Of the bootstrap over pairs of games.

    Raises
    ------
    CommandError
        If there are fewer than two players, or a pairing without games.
    """
    points, games = results.payoffs()
    n = len(results.players)
    if n < 2 or (games + np.eye(n) == 0).any():
        raise CommandError("ratings need at least two players, and games between every two of them")

    def scaled(values: Array) -> Array:
        origin = values.mean() if anchor is None else values[results.players.index(anchor)]
        return np.asarray(ANCHOR + SCALE * (values - origin))

    generator = np.random.default_rng(seed)
    drawn = [scaled(strengths(results.resampled(generator).payoffs()[0])) for _ in range(_RESAMPLES)]
    low, high = np.quantile(drawn, [0.025, 0.975], axis=0)
    return Ratings(scaled(strengths(points)), low, high)


@dataclass(frozen=True)
class Intransitivity:
    """How far a field is from a ladder.

    Attributes
    ----------
    cyclic_share : float
        Share of the squared log-odds between players that no rating can explain: 0 for a ladder, 1 for
        pure rock-paper-scissors.
    cycles : int
        Triples in which each beats another, every time with a 95 % interval above one half.
    triples : int
        Triples with three such decided pairings, cyclic or not.
    strongest : tuple of str
        The cycle whose closest pairing is the clearest: each name beats the next, the last the
        first. Empty if there is none.
    """

    cyclic_share: float
    cycles: int
    triples: int
    strongest: tuple[str, ...]


def intransitivity(results: Results) -> Intransitivity:
    """Measure how far a field is from a ladder.

    The log-odds L (n, n) are antisymmetric. Their part that ratings explain is r_i - r_j with
    r_i = mean_j L_ij; the rest is cyclic (the combinatorial Hodge decomposition; Balduzzi et al.,
    "Re-evaluating evaluation", NeurIPS 2018).
    """
    stats = require_extra("scipy.stats", "cli")
    points, games = results.payoffs()
    n = len(results.players)
    odds = np.log((points + 0.5) / (games - points + 0.5))
    np.fill_diagonal(odds, 0.0)
    means = odds.mean(axis=1)
    rest = odds - (means[:, None] - means[None, :])
    total = float((odds**2).sum())
    lowest = np.zeros((n, n))
    for i, j in itertools.permutations(range(n), 2):
        played, won = round(games[i, j]), round(points[i, j])
        if played:
            lowest[i, j] = stats.binomtest(min(won, played), played).proportion_ci(0.95, method="wilson").low
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
        cyclic_share=float((rest**2).sum()) / total if total else 0.0,
        cycles=len(cycles),
        triples=decided,
        strongest=tuple(results.players[i] for i in strongest),
    )
