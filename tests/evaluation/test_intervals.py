from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.intervals import (
    bootstrap,
    mean_with_interval,
    median_with_interval,
    rounded,
    wilson,
)


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [(0, 10, 0.0, 0.2775), (5, 10, 0.2366, 0.7634), (10, 10, 0.7225, 1.0), (81, 263, 0.2553, 0.3662)],
)
def test_wilson_is_that_of_the_books(successes, trials, low, high):
    assert wilson(successes, trials) == pytest.approx((low, high), abs=1e-4)


def test_a_bootstrap_of_equal_samples_is_certain_and_repeats_itself():
    mean, low, high = bootstrap(np.full((7, 3), 2.5))
    assert mean.tolist() == low.tolist() == high.tolist() == [2.5, 2.5, 2.5]
    values = np.random.default_rng(0).normal(size=50)
    assert mean_with_interval(values) == mean_with_interval(values)


def test_a_bootstrap_is_about_as_wide_as_theory_says():
    values = np.random.default_rng(1).normal(3.0, 2.0, size=400)
    mean, (low, high) = mean_with_interval(values)
    assert mean == pytest.approx(values.mean())
    assert (high - low) / 2 == pytest.approx(1.96 * values.std() / 20, rel=0.1)


def test_medians_take_never_for_an_answer():
    assert median_with_interval(np.arange(1.0, 21.0)) == (10.5, (6.0, 15.0))
    assert median_with_interval([4.0] * 5 + [np.inf] * 15) == (np.inf, (np.inf, np.inf))
    assert median_with_interval([3.0, 1.0, np.inf]) == (3.0, (1.0, np.inf))


@pytest.mark.parametrize("interval", [bootstrap, mean_with_interval, median_with_interval])
@pytest.mark.parametrize("values", [[], np.empty((0, 3)), 5.0])
def test_intervals_of_nothing_are_refused(interval, values):
    with pytest.raises(ResultsError, match="at least one sample, got an array of shape"):
        interval(values)


@pytest.mark.parametrize(("successes", "trials"), [(0, 0), (3, 2), (-1, 4)])
def test_shares_of_nothing_and_of_too_much_are_refused(successes, trials):
    with pytest.raises(ResultsError, match=f"got {successes} of {trials}"):
        wilson(successes, trials)


def test_a_median_of_what_is_no_number_is_refused():
    with pytest.raises(ResultsError, match="NaN"):
        median_with_interval([1.0, np.nan, 3.0])


def test_rounding_keeps_significant_digits():
    assert rounded([123456.0, 0.00012345678, 0.0, -9.87654]) == [123500.0, 0.0001235, 0.0, -9.877]
    assert rounded([np.inf, 1.0]) == [np.inf, 1.0]
