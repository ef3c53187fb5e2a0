from __future__ import annotations

import itertools
from fractions import Fraction

import numpy as np
import pytest

from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.survival import kaplan_meier, survival_curve


def test_the_median_is_kaplan_meiers():
    # By hand: wins at 10, 20, 40 s; draws at 30 s and 60 s. Survival: 4/5, 3/5, (draw), 3/5 * 1/2, (draw).
    median, mean = kaplan_meier([10, 20, 30, 40, 60], [True, True, False, True, False])
    assert median == 40
    assert mean == pytest.approx(10 * 1 + 10 * 0.8 + 20 * 0.6 + 20 * 0.3)
    assert kaplan_meier([300, 300, 10], [False, False, True])[0] is None
    assert kaplan_meier([5, 7], [True, True]) == (5.0, 6.0)


def survival_by_fractions(seconds, decided):
    """Go through the games one moment after the other, with exact fractions."""
    survival, area, median = Fraction(1), Fraction(0), None
    for now, then in itertools.pairwise([0.0, *sorted(set(seconds))]):
        area += survival * (Fraction(then) - Fraction(now))
        at_risk = sum(length >= then for length in seconds)
        ends = sum(length == then and ended for length, ended in zip(seconds, decided, strict=True))
        survival *= 1 - Fraction(ends, at_risk)
        if median is None and ends and survival <= Fraction(1, 2):
            median = then
    return median, float(area)


def test_the_median_is_exact_where_half_of_the_games_are_over():
    generator = np.random.default_rng(0)
    halves = 0
    for _ in range(1500):
        count = int(generator.integers(1, 25))
        seconds = generator.integers(0, 12, count).astype(float).tolist()
        decided = (generator.random(count) < generator.choice([0.3, 0.7, 1.0])).tolist()
        expected_median, expected_mean = survival_by_fractions(seconds, decided)
        median, mean = kaplan_meier(seconds, decided)
        assert median == expected_median, (seconds, decided)
        assert mean == pytest.approx(expected_mean)
        halves += all(decided) and count % 2 == 0 and sorted(seconds)[count // 2 - 1] < sorted(seconds)[count // 2]
    assert halves > 50
    # As a product of floats, one half comes out above one half at some of these sizes.
    for count in range(2, 400, 2):
        assert kaplan_meier(range(count), [True] * count)[0] == count / 2 - 1


@pytest.mark.parametrize(
    ("seconds", "decided", "message"),
    [
        ([], [], "at least one game"),
        ([1.0], [True, False], r"shapes \(1,\) and \(2,\)"),
        ([np.nan], [True], "finite"),
        ([np.inf], [False], "finite"),
        ([-1.0], [True], "not below 0"),
    ],
)
def test_survival_of_nothing_or_of_what_is_no_time_is_refused(seconds, decided, message):
    with pytest.raises(ResultsError, match=message):
        kaplan_meier(seconds, decided)


def test_the_curve_falls_where_games_are_decided():
    assert survival_curve([10.0, 30.0, 20.0, 20.0], [True, False, True, False]) == (
        [0.0, 10.0, 20.0, 30.0],
        [1.0, 0.75, 0.5, 0.5],
    )
