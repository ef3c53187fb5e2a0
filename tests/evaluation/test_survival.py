"""Medians and means of lengths, some of which are only lower bounds."""

import itertools
from fractions import Fraction

import numpy as np
import pytest

from swarm_pz.evaluation.survival import kaplan_meier, survival_curve


def by_fractions(seconds, decided):
    """Compute median and mean moment by moment, in exact fractions."""
    survival, area, median = Fraction(1), Fraction(0), None
    for now, then in itertools.pairwise([0.0, *sorted(set(seconds))]):
        area += survival * (Fraction(then) - Fraction(now))
        at_risk = sum(length >= then for length in seconds)
        ends = sum(length == then and ended for length, ended in zip(seconds, decided, strict=True))
        survival *= 1 - Fraction(ends, at_risk)
        if median is None and ends and survival <= Fraction(1, 2):
            median = then
    return median, float(area)


def test_median_and_mean_are_kaplan_meiers():
    # By hand: wins at 10, 20, 40 s; draws at 30 and 60 s. S: 4/5, 3/5, (draw), 3/5 * 1/2, (draw).
    found = kaplan_meier([10, 20, 30, 40, 60], [True, True, False, True, False])
    assert found == (40, pytest.approx(10 * 1 + 10 * 0.8 + 20 * 0.6 + 20 * 0.3))
    generator = np.random.default_rng(0)
    for _ in range(100):
        count = int(generator.integers(1, 25))
        seconds = generator.integers(0, 12, count).astype(float).tolist()
        decided = (generator.random(count) < generator.choice([0.3, 0.7, 1.0])).tolist()
        median, mean = by_fractions(seconds, decided)
        assert kaplan_meier(seconds, decided) == (median, pytest.approx(mean)), (seconds, decided)
    for draws, count in itertools.product((0, 1), range(2, 300, 14)):  # in floats, one half can be rounded up
        seconds, decided = [0.0] * draws + [*range(1, count + 1)], [False] * draws + [True] * count
        assert kaplan_meier(seconds, decided)[0] == count / 2


def test_the_curve_falls_where_games_are_decided():
    curve = survival_curve([10.0, 30.0, 20.0, 20.0], [True, False, True, False])
    assert curve == ([0.0, 10.0, 20.0, 30.0], [1.0, 0.75, 0.5, 0.5])
