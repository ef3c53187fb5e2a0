"""One number of many runs and tasks is what rliable says."""

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


@pytest.mark.usefixtures("all_resamples")
def test_numbers_are_those_of_rliable():
    """Of rliable 1.2.0: aggregate_iqm, its interval of 5,000 resamples, improvement and profile."""
    assert interquartile_mean(SCORES) == pytest.approx(0.487, abs=1e-9)
    assert probability_of_improvement(SCORES, OTHERS) == pytest.approx(0.5875, abs=1e-9)
    assert probability_of_improvement(np.array([[1.0, 1.0]]), np.array([[1.0, 0.0]])) == 0.75, "a tie is half of one"
    np.testing.assert_allclose(performance_profile(SCORES, [0.25, 0.5, 0.75]), [0.8, 0.5, 0.225], atol=1e-9)
    (low, high), again = (
        interval(lambda generator: drawn_runs(SCORES, generator), lambda drawn: np.array([interquartile_mean(drawn)]))
        for _ in range(2)
    )
    assert [low[0], high[0]] == pytest.approx([0.3855, 0.6005], abs=0.01) and (low, high) == again


def test_runs_are_drawn_in_each_task_alone_and_pairs_count_as_their_games():
    drawn = drawn_runs(np.array([[0.0, 10.0], [1.0, 11.0]]), np.random.default_rng(0))
    assert set(drawn[:, 0]) <= {0.0, 1.0} and set(drawn[:, 1]) <= {10.0, 11.0}
    pairs = [np.array([[0.5, 1.0], [2.0, 2.0]])]
    found = {float(drawn_pairs(pairs, np.random.default_rng(seed))[0, 0]) for seed in range(20)}
    assert sorted(found) == pytest.approx([0.5, 2.5 / 3, 1.0])
