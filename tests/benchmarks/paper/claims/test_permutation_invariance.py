from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.claims import permutation_invariance
from swarm_pz.config import GameConfig
from swarm_pz.simulator import Simulator
from tests.benchmarks.paper.given import SEED, spread_around

SMALL = {"SEEDS": 2}
"""What makes the figure quick."""


SAME, ROUNDING = permutation_invariance.SAME, permutation_invariance.ROUNDING


@pytest.mark.parametrize(
    ("farthest", "mean", "apart", "holds"),
    [
        (0.5 * ROUNDING, 0.0, 0.1, True),
        (2.0 * ROUNDING, 0.0, 0.1, False),
        (0.5 * ROUNDING, 0.9, 0.1, True),
        (0.5 * ROUNDING, 0.9, 0.8, False),
        (0.5 * ROUNDING, -0.9, 0.8, False),
        (0.5 * ROUNDING, -3.0, 0.1, False),
    ],
)
def test_which_drone_is_which_is_the_same_to_the_rounding_and_to_the_whole_interval(
    monkeypatch, farthest, mean, apart, holds
):
    seen = []

    class Metric:
        def __init__(self, simulator, team):
            self.is_other = len(seen) % 2
            seen.append(simulator)

        def observe(self):
            pass

        def value(self):
            difference = SAME * spread_around(mean, apart, permutation_invariance.SEEDS)
            return 0.01 + self.is_other * difference

    calls = []

    def distance(one, other, order):
        calls.append((int(one.games.ticks[0]), int(other.games.ticks[0]), order.tolist()))
        return np.array([0.0, 0.0, farthest] if len(calls) == 1 else [9.0])

    monkeypatch.setattr(permutation_invariance, "ErgodicMetric", Metric)
    monkeypatch.setattr(permutation_invariance, "distance", distance)
    monkeypatch.setattr(permutation_invariance, "JUDGED", 1)
    monkeypatch.setattr(permutation_invariance, "DRONES", 5)
    finding = permutation_invariance.measure(SEED)
    assert finding.supported == holds
    assert finding.statistic["largest_distance_after_a_control_period"] == farthest
    assert finding.statistic["difference_of_metric_at_1_s"] == pytest.approx(SAME * mean, abs=1e-9)
    assert finding.seeds == [3000 + number for number in range(20)]
    assert calls[0][:2] == (153, 153) and [ticks[:2] for ticks in calls[1:]] == [(3 * n, 3 * n) for n in range(1, 11)]
    assert sorted(calls[0][2]) == [0, 1, 2, 3, 4] != calls[0][2]


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
