from __future__ import annotations

import numpy as np

from swarm_pz.figures import coverage
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import ErgodicMetric


def test_the_metric_over_time_falls():
    simulator = coverage.start(coverage.lone_team(6), [0, 1], coverage.TARGETS["centre"])
    metric = coverage.metric_over_time(simulator, seconds=8)
    assert metric.shape == (2, 8)
    assert (metric[:, -1] < 0.1 * metric[:, 0]).all()


def test_the_metric_is_that_of_each_second_of_the_seeds_own_games():
    config, target = coverage.lone_team(4), coverage.TARGETS["bimodal"]
    found = coverage.metric_over_time(coverage.start(config, [5, 9], target), seconds=2)
    simulator = Simulator(config, 2)
    simulator.reset([5, 9])
    simulator.command(0, np.stack([target] * 2))
    metric = ErgodicMetric(simulator, 0)
    for second in range(2):
        for _ in range(10):
            simulator.advance(3)
            metric.observe()
        np.testing.assert_array_equal(found[:, second], metric.value())


def test_a_gaussian_is_where_it_was_asked_for():
    row, column = np.unravel_index(coverage.gaussian(0.85, 0.25, 0.1).argmax(), (10, 10))
    assert (row, column) == (2, 8)
