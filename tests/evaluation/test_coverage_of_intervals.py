"""What is called a 95 % interval covers the truth about 95 times of 100, wherever results carry one.

Data are drawn from a distribution whose truth is known, a few hundred times, with fixed seeds. The bounds
leave room for chance, and for bootstraps, which are a little narrow in small samples; not for 85 % or 99 %.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.stats import binom

from swarm_pz.config import GameConfig
from swarm_pz.evaluation import intervals, match, ratings
from swarm_pz.evaluation.match import MatchResult, paired_difference
from swarm_pz.evaluation.ratings import SCALE, Results, rate
from swarm_pz.evaluation.rollout import Game

Generator = np.random.Generator


@pytest.fixture(autouse=True)
def few_resamples(monkeypatch):
    """Take fewer resamples than results do: the ends are rougher, and as often to either side."""
    monkeypatch.setattr(intervals, "RESAMPLES", 250)
    monkeypatch.setattr(match, "_RESAMPLES", 250)
    monkeypatch.setattr(ratings, "_RESAMPLES", 100)


def coverage(interval: Callable[[Generator], tuple[float, float]], truth: float, repeats: int = 400) -> float:
    generator = np.random.default_rng(0)
    ends = np.array([interval(generator) for _ in range(repeats)])
    return float(((ends[:, 0] <= truth) & (truth <= ends[:, 1])).mean())


def game(pair: int, number: int, *, won: bool = True, share: float = 1.0, is_same: bool = False) -> Game:
    return Game(
        pair=pair,
        side=("red", "blue")[number],
        outcome="win" if won else "loss",
        share=share,
        seconds=1.0,
        captures=0,
        recaptures=0,
        fingerprint=bytes([0 if is_same else number]),
        sizes=[1],
    )


def result(games: list[Game]) -> MatchResult:
    return MatchResult(policy="p", opponent="o", seed=0, config=GameConfig(), limit_s=1.0, games=games)


def test_of_a_share():
    trials = 40
    counts = np.arange(trials + 1)
    low, high = np.array([intervals.wilson(count, trials) for count in counts]).T
    # Exactly, from the binomial distribution: it goes up and down with the share, around 95 %.
    covered = [
        binom.pmf(counts[(low <= share) & (share <= high)], trials, share).sum()
        for share in np.arange(0.02, 0.98, 0.01)
    ]
    assert np.mean(covered) == pytest.approx(0.95, abs=0.01)
    assert min(covered) > 0.85


def test_of_a_mean():
    covered = coverage(lambda generator: intervals.mean_with_interval(generator.normal(2.0, 3.0, 60))[1], 2.0)
    assert 0.89 < covered < 0.98


def test_of_a_median():
    truth = np.log(2.0)
    covered = coverage(lambda generator: intervals.median_with_interval(generator.exponential(1.0, 40))[1], truth, 1000)
    assert 0.93 < covered < 0.99


def test_of_a_win_rate_where_some_pairs_are_the_same_game():
    same, as_red, as_either = 0.4, 0.6, 0.3

    def interval(generator: Generator) -> tuple[float, float]:
        games: list[Game] = []
        for pair in range(80):
            is_same = bool(generator.random() < same)
            won = bool(generator.random() < (as_red if is_same else as_either))
            # Two different games of a pair go together here, as they do from a start that suits nobody.
            games += [game(pair, 0, won=won, is_same=is_same), game(pair, 1, won=won != is_same, is_same=is_same)]
        return result(games).win_rate_interval()

    truth = (same * as_red + (1 - same) * 2 * as_either) / (same + (1 - same) * 2)
    assert 0.89 < coverage(interval, truth) < 0.98


def test_of_a_difference_between_two_policies_on_the_same_seeds():
    def interval(generator: Generator) -> tuple[float, float]:
        starts = generator.uniform(0.2, 0.8, 60)
        first, second = (
            result(
                [
                    game(pair, number, share=start + ahead + 0.1 * generator.normal())
                    for pair, start in enumerate(starts)
                    for number in (0, 1)
                ]
            )
            for ahead in (0.1, 0.05)
        )
        return paired_difference(first, second)[1:]

    assert 0.89 < coverage(interval, 0.05) < 0.98


def test_of_a_rating():
    ahead = 0.6

    def interval(generator: Generator) -> tuple[float, float]:
        won = generator.binomial(2, 1 / (1 + np.exp(-ahead)), size=60)
        rated = rate(Results(("one", "other"), {(0, 1): np.stack([won, np.full(60, 2)], axis=1)}), anchor="other")
        return float(rated.low[0]), float(rated.high[0])

    assert 0.88 < coverage(interval, 1000.0 + SCALE * ahead, repeats=100) < 0.995
