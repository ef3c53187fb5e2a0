"""The figures' statistics, on answers that can be worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.figures import coverage
from swarm_pz.figures.claims import (
    adversary,
    capture_geometry,
    comebacks,
    communication,
    compactness,
    dropout,
    ensemble_tactic,
    flocking_flights,
    permutation_invariance,
    scale_invariance,
    team_sizes,
)
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import ErgodicMetric
from tests import reference


@pytest.mark.parametrize(("centre", "cells"), [((9, 9), 16), ((9, 0), 9), ((0, 0), 5), ((49, 25), 9), ((1, 1), 7)])
def test_walls_shorten_the_ring_around_a_cell(centre, cells):
    ring = capture_geometry.ring_around(centre)
    assert len(ring) == len(set(ring)) == cells
    assert all(max(abs(x - centre[0]), abs(y - centre[1])) == 2 for x, y in ring)


def test_the_worst_mean_and_the_largest_difference_are_of_means_over_seeds():
    values = np.array([[[1.0, 2.0], [5.0, 0.0]], [[3.0, 2.0], [5.0, 4.0]]])  # means: [[2, 2], [5, 2]]
    assert scale_invariance.worst_mean(values) == 5.0
    assert scale_invariance.largest_difference(values) == 3.0


def test_a_permutation_moves_every_drone_with_all_that_is_its_own():
    simulator = Simulator(GameConfig(drones_per_team=3), num_games=2)
    simulator.reset([0, 1])
    simulator.advance(6)
    order = np.array([2, 0, 1, 5, 4, 3])
    there = permutation_invariance.permuted(simulator.snapshot(), order)
    back = permutation_invariance.permuted(there, np.argsort(order))
    assert np.array_equal(there.positions[:, 0], simulator.positions[:, 2])
    assert np.array_equal(there.trails[:, 5, 0], simulator.games.trails[:, 5, 2])
    for one, other in zip(back, simulator.games, strict=True):
        assert np.array_equal(one, other)
    other = Simulator(simulator.config, num_games=2)
    other.restore(there)
    assert permutation_invariance.distance(simulator, other, order).tolist() == [0.0, 0.0]


def test_every_array_with_drones_is_permuted():
    simulator = Simulator(GameConfig(drones_per_team=(2, 11)))
    drones = {
        name for name, array in zip(simulator.games._fields, simulator.games, strict=True) if 13 in array.shape[1:]
    }
    assert drones == {*permutation_invariance._LAST_AXIS, *permutation_invariance._SECOND_AXIS}


def test_moments_of_a_game():
    sizes = [10] * 25 + [6] * 10 + [5] * 10 + [2] * 5 + [1] * 21 + [0]
    assert ensemble_tactic.moments(sizes) == [20, 35, 60, 71]
    assert ensemble_tactic.moments([4, 2, 0]) == [1, 1, 2, 2]


def test_the_last_stand_is_counted_from_the_last_time_there_were_several():
    assert ensemble_tactic.last_stand([10, 1, 3, 1, 1, 0]) == 2
    assert ensemble_tactic.last_stand([10, 4, 0]) == 0


def test_turns_of_the_lead_do_not_count_equal_teams():
    assert team_sizes.turns_of_lead([10, 11, 10, 12, 9, 10, 8, 13], 20) == 2
    assert team_sizes.turns_of_lead([10, 10], 20) == 0


def test_the_median_win_rate_is_over_players():
    wins = np.zeros((4, 3, 2))
    wins[:, 1] = 1.0
    wins[:2, 2] = 1.0
    assert adversary.median_win_rate(wins) == 0.5


def test_every_script_but_uniform_coverage_is_judged():
    assert {"restless", "blind_ring", "ring", "noise"} <= set(adversary.scripts())
    assert not {"uniform", "champion", "planner"} & set(adversary.scripts())


def test_spread_is_the_rms_distance_from_the_mean():
    positions = np.array([[0.0, 0.0], [0.6, 0.8], [9.0, 9.0]], np.float32)
    assert compactness.spread_of(positions, np.array([True, True, False])) == pytest.approx(0.5)


def test_bins_hold_equally_many_looks():
    spread = np.linspace(0.1, 0.5, 80)
    games = [np.stack([spread, spread > 0.3], axis=1)] * 3
    bins = compactness.binned(games)
    assert bins["lost"]["mean"] == bins["half"]["mean"] == [0, 0, 0, 0, 1, 1, 1, 1]
    assert bins["spread"] == sorted(bins["spread"])


def test_the_comeback_shown_is_a_won_one():
    histories = [[1, 1, 1, 0], [1, 2, 12, 20], [1, 2, 3, 20]]
    assert comebacks.longest_behind(histories, ["loss", "win", "win"], 20) == 2
    assert comebacks.longest_behind(histories, ["loss", "loss", "draw"], 20) is None


def test_players_that_cannot_be_loaded_are_left_out(monkeypatch):
    from swarm_pz.errors import MissingExtraError

    def load(name, config):
        if name == "champion":
            raise MissingExtraError("torch is not installed")

    monkeypatch.setattr(comebacks, "load", load)
    assert comebacks.installed(("ring", "champion"), GameConfig()) == ["ring"]


def test_steps_that_surely_fall_are_counted():
    means = np.array([1.0, 2.0, 2.0, 1.5, 3.0])
    noise = np.random.default_rng(0).normal(0.0, 0.01, (20, 5))
    assert communication.steps_that_fall(means + noise) == 1


def test_drones_out_in_the_long_run():
    assert dropout.share_out(0.0, 0.1) == 0.0
    assert dropout.share_out(dropout.HALF_OUT, dropout.REPAIR_RATE) == 0.5


def test_the_first_time_that_a_metric_is_low_enough():
    metric = np.array([[0.1, 0.004, 0.1], [0.1, 0.1, 0.1], [0.001, 0.1, 0.1]])
    assert flocking_flights.first_reached(metric).tolist() == [2.0, np.inf, 1.0]


def test_what_is_near_a_mode():
    squared = flocking_flights.near_modes(np.array([[0.25, 0.35], [0.75, 0.75], [0.5, 0.5]]))
    assert squared[0] == pytest.approx([0.01, np.nan], nan_ok=True)
    assert squared[1] == pytest.approx([np.nan, 0.0], nan_ok=True)
    assert np.isnan(squared[2]).all()


def test_what_the_target_asks_near_its_modes():
    shares, reaches = flocking_flights.asked()
    # A Gaussian has 1 - exp(-a) of its mass within r, a = r^2 / (2 sigma^2), at a mean square of
    # 2 sigma^2 (1 - a exp(-a) / (1 - exp(-a))).
    for (_, _, sigma), share, reach in zip(coverage.BIMODAL, shares, reaches, strict=True):
        a = flocking_flights.NEAR**2 / (2 * sigma**2)
        inside = 1 - np.exp(-a)
        assert share == pytest.approx(inside / 2, abs=0.02)  # the square cuts off what lies beyond its walls
        assert reach == pytest.approx(np.sqrt(2 * sigma**2 * (1 - a * np.exp(-a) / inside)), rel=0.02)


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


def test_lone_drones_know_of_nobody_and_are_judged_together(monkeypatch):
    monkeypatch.setattr(communication, "DRONES", 3)
    monkeypatch.setattr(communication, "JUDGED", 1)
    found = communication.alone([4, 7], "centre")
    together = coverage.start(coverage.lone_team(3), [4, 7], coverage.TARGETS["centre"])
    for game in range(2):
        places = []
        for drone in range(3):
            one = coverage.start(coverage.lone_team(1), [0], coverage.TARGETS["centre"])
            one.games.positions[0, 0] = together.positions[game, drone]
            for _ in range(10):
                one.advance(3)
                places.append(reference.basis(one.positions[0, 0]))
        phi = together.games.coefficients[game, 0]
        assert found[game] == pytest.approx(reference.ergodic_metric(np.mean(places, axis=0), phi), rel=1e-6)


def test_half_of_a_team_is_half():
    bins = compactness.binned([np.stack([np.linspace(0.1, 0.5, 80), np.full(80, 0.5)], axis=1)])
    assert bins["half"]["mean"] == [1.0] * 8 and bins["lost"]["mean"] == [0.5] * 8
