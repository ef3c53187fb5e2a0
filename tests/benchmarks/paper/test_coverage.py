from __future__ import annotations

import numpy as np

from benchmarks.paper import coverage
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import ErgodicMetric
from tests.benchmarks.paper.given import spread_around


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


def test_a_flight_is_told_of_second_by_second_and_its_maps_are_upright(monkeypatch):
    monkeypatch.setattr(coverage, "SECONDS", 4)
    upper_left = np.zeros((10, 10))
    upper_left[9, 0] = 1.0
    told = []
    flight = coverage.Flight(coverage.start(coverage.lone_team(2), [0, 1, 2], upper_left), told.append)
    assert told == [1, 2, 3, 4] and flight.metric.shape == (3, 4) and flight.places.shape == (3, 40, 2, 2)
    for game, found in enumerate(flight.maps(5)):
        assert found.sum() == 1.0
        cells = np.minimum(np.floor(5 * flight.places[game].reshape(-1, 2)), 4)
        assert found[4, 0] == (cells == [0, 4]).all(axis=1).mean()


def test_a_gaussian_is_where_it_was_asked_for():
    row, column = np.unravel_index(coverage.gaussian(0.85, 0.25, 0.1).argmax(), (10, 10))
    assert (row, column) == (2, 8)


def test_over_seeds_are_the_mean_and_its_interval_at_each_second():
    values = np.stack([spread_around(5.0, 1.0, 20), np.full(20, 2.0)], axis=1)
    found = coverage.over_seeds(values)
    assert found["mean"] == [5.0, 2.0] and 4.3 < found["low"][0] < 4.8 and 5.2 < found["high"][0] < 5.7
    assert found["low"][1] == found["high"][1] == 2.0
