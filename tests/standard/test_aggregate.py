"""One number of many runs and tasks is what rliable says."""

import functools

import numpy as np
import pytest

from swarm_pz.evaluation.intervals import middle
from swarm_pz.standard import aggregate
from swarm_pz.standard.aggregate import (
    drawn_pairs,
    drawn_runs,
    interquartile_mean,
    performance_profile,
    probability_of_improvement,
    resampled,
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
        middle(interquartile_mean(resampled(functools.partial(drawn_runs, SCORES)))) for _ in range(2)
    )
    assert [low, high] == pytest.approx([0.3855, 0.6005], abs=0.01) and [low, high] == list(again)


def test_runs_are_drawn_in_each_task_alone_and_pairs_count_as_their_games():
    drawn = drawn_runs(np.array([[0.0, 10.0], [1.0, 11.0]]), np.random.default_rng(0), 9)
    assert set(drawn[..., 0].flat) == {0.0, 1.0} and set(drawn[..., 1].flat) == {10.0, 11.0}
    pairs = [np.array([[0.5, 1.0], [2.0, 2.0]])]
    found = drawn_pairs(pairs, np.random.default_rng(0), 20)
    assert sorted(set(found.flat)) == pytest.approx([0.5, 2.5 / 3, 1.0])


def test_many_draws_are_those_that_one_after_another_would_be(monkeypatch):
    """Else published intervals would change."""
    monkeypatch.setattr(aggregate, "_AT_ONCE", 50)
    pairs = [np.random.default_rng(count).random((count, 2)) for count in (10, 3, 1, 10)]
    generators = [np.random.default_rng(4) for _ in range(2)]
    many = drawn_pairs(pairs, generators[0], 9)[:, 0]
    for row in many:
        drawn = [task[generators[1].integers(len(task), size=len(task))].sum(axis=0) for task in pairs]
        assert row.tolist() == pytest.approx([points / games for points, games in drawn], rel=1e-12)
    many = drawn_runs(SCORES, generators[0], 9)
    for one in many:
        assert (one == drawn_runs(SCORES, generators[1], 1)[0]).all()
    means = [float(interquartile_mean(one)) for one in many]
    assert interquartile_mean(many).tolist() == pytest.approx(means, rel=1e-12)
    profiles = [performance_profile(one, [0.25, 0.5]) for one in many]
    assert (performance_profile(many, [0.25, 0.5]) == profiles).all()
