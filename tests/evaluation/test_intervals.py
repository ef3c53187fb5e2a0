"""Intervals agree with textbooks, and 95 % intervals cover the truth about 95 times in 100."""

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import ResultsError
from swarm_pz.evaluation import match
from swarm_pz.evaluation.intervals import bootstrap, mean_with_interval, median_with_interval, over_runs, wilson
from swarm_pz.evaluation.match import MatchResult, paired_difference
from swarm_pz.evaluation.rollout import Game


def test_intervals_are_those_of_the_books():
    values = np.random.default_rng(1).normal(3.0, 2.0, size=400)
    mean, (low, high) = mean_with_interval(values)
    assert mean == pytest.approx(values.mean()) and (mean, (low, high)) == mean_with_interval(values)
    assert (high - low) / 2 == pytest.approx(1.96 * values.std() / 20, rel=0.1)
    assert [part.tolist() for part in bootstrap(np.full((7, 3), 2.5))] == [[2.5] * 3] * 3
    for given, ends in {(0, 10): (0.0, 0.2775), (5, 10): (0.2366, 0.7634), (81, 263): (0.2553, 0.3662)}.items():
        assert wilson(*given) == pytest.approx(ends, abs=1e-4)
    assert over_runs([0.5, 0.6, 0.7]) == pytest.approx((0.3516, 0.8484), abs=1e-4)
    assert over_runs([0.9, 1.0, 1.0])[1] == 1.0, "a share"
    assert median_with_interval(np.arange(1.0, 21.0)) == (10.5, (6.0, 15.0))
    assert median_with_interval([4.0] * 5 + [np.inf] * 15) == (np.inf, (np.inf, np.inf))
    assert median_with_interval([3.0, 1.0, np.inf]) == (3.0, (1.0, np.inf))


@pytest.mark.parametrize(
    ("interval", "given"),
    [(one, (values,)) for one in (bootstrap, median_with_interval) for values in ([], 5.0)]
    + [(median_with_interval, ([1.0, np.nan],)), (over_runs, ([0.5],))]
    + [(wilson, given) for given in ((0, 0), (3, 2), (-1, 4))],
)
def test_intervals_of_nothing_or_nonsense_are_refused(interval, given):
    with pytest.raises(ResultsError, match=r"got|at least two"):
        interval(*given)


# --- how often they cover a known truth -----------------------------------------------------------


def game(pair, number, *, won=True, share=1.0, is_same=False):
    return Game(
        pair=pair, side=("red", "blue")[number], outcome="win" if won else "loss", share=share, seconds=1.0, captures=0,
        recaptures=0, fingerprint=bytes([0 if is_same else number]), sizes=[1],
    )  # fmt: skip


def result(games):
    return MatchResult(policy="p", opponent="o", seed=0, config=GameConfig(), limit_s=1.0, games=games)


SAME, AS_RED, AS_EITHER = 0.4, 0.6, 0.3


def of_a_win_rate(generator):
    """Return an interval; some pairs are one game twice, and in the others both games have the same outcome."""
    games = []
    for pair in range(80):
        is_same = bool(generator.random() < SAME)
        won = bool(generator.random() < (AS_RED if is_same else AS_EITHER))
        games += [game(pair, 0, won=won, is_same=is_same), game(pair, 1, won=won != is_same, is_same=is_same)]
    return result(games).win_rate_interval()


def of_a_difference(generator):
    starts = generator.uniform(0.2, 0.8, 60)
    shares = [np.repeat(starts, 2) + ahead + 0.1 * generator.normal(size=120) for ahead in (0.1, 0.05)]
    matches = [result([game(n // 2, n % 2, share=share) for n, share in enumerate(one)]) for one in shares]
    return paired_difference(*matches)[1:]


@pytest.mark.parametrize(
    ("interval", "truth"),
    [
        (of_a_win_rate, (SAME * AS_RED + (1 - SAME) * 2 * AS_EITHER) / (SAME + (1 - SAME) * 2)),
        (of_a_difference, 0.05),
    ],
)
def test_an_interval_covers_the_truth_as_often_as_it_says(interval, truth, monkeypatch):
    """The bounds leave room for chance and for bootstraps of small samples, but not for 85 % or 100 %."""
    monkeypatch.setattr(match, "_RESAMPLES", 150)
    generator = np.random.default_rng(0)
    ends = np.array([interval(generator) for _ in range(100)])
    assert 0.88 < ((ends[:, 0] <= truth) & (truth <= ends[:, 1])).mean() < 0.99
