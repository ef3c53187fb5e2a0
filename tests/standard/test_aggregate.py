"""One number of many runs and tasks is what rliable says."""

import functools

import numpy as np
import pytest

from swarm_pz.evaluation.intervals import middle
from swarm_pz.standard.aggregate import (
    drawn_pairs,
    drawn_runs,
    interquartile_mean,
    mean_of_known,
    probability_of_improvement,
    resampled,
)

SCORES = np.random.default_rng(1).random((5, 8)).round(2)
OTHERS = np.random.default_rng(2).random((4, 8)).round(2) * 0.9


@pytest.mark.usefixtures("all_resamples")
def test_numbers_are_those_of_rliable():
    """Of rliable 1.2.0: aggregate_iqm, its interval of 5,000 resamples, and improvement."""
    assert interquartile_mean(SCORES) == pytest.approx(0.487, abs=1e-9)
    assert probability_of_improvement(SCORES, OTHERS) == pytest.approx(0.5875, abs=1e-9)
    assert probability_of_improvement(np.array([[1.0, 1.0]]), np.array([[1.0, 0.0]])) == 0.75, "a tie is half of one"
    (low, high), again = (
        middle(interquartile_mean(resampled(functools.partial(drawn_runs, SCORES)))) for _ in range(2)
    )
    assert [low, high] == pytest.approx([0.3855, 0.6005], abs=0.01) and [low, high] == list(again)


def test_what_is_not_known_counts_nowhere():
    """Not as a loss, nor as a tie."""
    scores = np.array([[1.0, np.nan, np.nan], [0.0, 0.5, np.nan]])
    assert mean_of_known(scores, 0)[:2].tolist() == [0.5, 0.5] and np.isnan(mean_of_known(scores, 0)[2])
    assert probability_of_improvement(scores, np.array([[0.0, 0.5, 1.0]])) == pytest.approx((0.75 + 0.5) / 2)


def test_runs_are_drawn_in_each_task_alone_and_pairs_together():
    drawn = drawn_runs(np.array([[0.0, 10.0], [1.0, 11.0]]), np.random.default_rng(0), 9)
    assert set(drawn[..., 0].flat) == {0.0, 1.0} and set(drawn[..., 1].flat) == {10.0, 11.0}
    found = drawn_pairs([np.array([0.5, 1.0]), np.array([])], np.random.default_rng(0), 20)
    assert sorted(set(found[..., 0].flat)) == [0.5, 0.75, 1.0] and np.isnan(found[..., 1]).all()
