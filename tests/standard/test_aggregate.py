from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.standard.aggregate import (
    drawn_pairs,
    drawn_runs,
    interquartile_mean,
    interval,
    performance_profile,
    probability_of_improvement,
)

SCORES = np.random.default_rng(1).random((5, 8)).round(2)
OTHERS = np.random.default_rng(2).random((4, 8)).round(2) * 0.9
RLIABLE = {"iqm": 0.487, "interval": [0.3855, 0.6005], "improvement": 0.5875, "profile": [0.8, 0.5, 0.225]}
"""What rliable 1.2.0 says of them: aggregate_iqm, its interval of 5,000 resamples, probability_of_improvement, and
create_performance_profile above 0.25, 0.5 and 0.75."""


def test_one_number_is_what_rliable_says():
    assert interquartile_mean(SCORES) == pytest.approx(RLIABLE["iqm"], abs=1e-9)
    assert probability_of_improvement(SCORES, OTHERS) == pytest.approx(RLIABLE["improvement"], abs=1e-9)
    np.testing.assert_allclose(performance_profile(SCORES, [0.25, 0.5, 0.75]), RLIABLE["profile"], atol=1e-9)


def test_an_interval_is_what_rliable_says_and_the_same_twice():
    (low, high), again = (
        interval(lambda generator: drawn_runs(SCORES, generator), lambda drawn: np.array([interquartile_mean(drawn)]))
        for _ in range(2)
    )
    assert [low[0], high[0]] == pytest.approx(RLIABLE["interval"], abs=0.01)
    assert (low, high) == again


def test_a_tie_is_half_an_improvement():
    assert probability_of_improvement(np.array([[1.0, 1.0]]), np.array([[1.0, 0.0]])) == 0.75


def test_runs_are_drawn_in_each_task_alone():
    drawn = drawn_runs(np.array([[0.0, 10.0], [1.0, 11.0]]), np.random.default_rng(0))
    assert set(drawn[:, 0]) <= {0.0, 1.0} and set(drawn[:, 1]) <= {10.0, 11.0}


def test_pairs_count_as_the_games_in_them():
    pairs = [np.array([[0.5, 1.0], [2.0, 2.0]])]
    drawn = {float(drawn_pairs(pairs, np.random.default_rng(seed))[0, 0]) for seed in range(20)}
    assert sorted(drawn) == pytest.approx([0.5, 2.5 / 3, 1.0])
