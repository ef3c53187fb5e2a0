from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.paper.claims import flocking_comparison, flocking_flights
from swarm_pz.config import GameConfig
from tests.benchmarks.paper.given import SEED, spread_around

SMALL = {"SEEDS": 2}
"""What makes the figure quick."""


def flight(seconds):
    metric = np.where(np.arange(1, 61) < np.array(seconds, float)[:, None], 0.1, 0.001)
    places = np.full((len(seconds), 600, 12, 2), flocking_flights.MODES[0])
    places[:, :, 6:] = flocking_flights.MODES[1]
    maps = np.full((len(seconds), 25, 25), 1 / 625)
    return SimpleNamespace(metric=metric, places=places, config=GameConfig(), maps=lambda cells: maps)


def reached(count, soonest, latest=None, seeds=20):
    latest = soonest if latest is None else latest
    return [*np.linspace(soonest, latest, count), *[np.inf] * (seeds - count)]


def given(monkeypatch, ways, widths):
    """Let flights reach the target at these seconds, and flocks be so many times as wide with the least weight."""
    flown = []

    def fly(seeds):
        flown.append(seeds)
        names = flocking_comparison.ERGODIC, flocking_comparison.SEQUENCE, flocking_comparison.ADAPTER
        return dict(zip(names, map(flight, ways), strict=True))

    def spreads(seeds):
        flown.append(seeds)
        return 0.1 * np.linspace(widths, np.ones(len(seeds)), 6, axis=1)

    monkeypatch.setattr(flocking_comparison, "fly", fly)
    monkeypatch.setattr(flocking_comparison, "spreads", spreads)
    return flown


@pytest.mark.parametrize(
    ("ergodic", "sequence", "adapter", "holds"),
    [
        (reached(20, 5, 9), reached(20, 40, 50), reached(0, 1), True),
        (reached(12, 5, 9), reached(0, 1), reached(0, 1), False),  # more than half, not surely
        (reached(20, 5, 9), reached(20, 40, 50), reached(8, 5), False),  # fewer than half, not surely
        (reached(20, 5, 25), reached(20, 10, 30), reached(0, 1), False),  # sooner, not surely
        (reached(20, 40, 50), reached(20, 5, 9), reached(0, 1), False),
    ],
)
def test_one_drawing_does_what_takes_a_flock_two_attractors_where_all_three_intervals_say_so(
    monkeypatch, ergodic, sequence, adapter, holds
):
    flown = given(monkeypatch, (ergodic, sequence, adapter), np.full(20, 9.0))
    finding = flocking_comparison.measure(SEED)
    assert finding.supported == holds and [*finding.parts.values()] == [holds, True]
    assert flown == [[3000 + number for number in range(20)]] * 2
    assert finding.statistic["reached_by_ergodic"] == np.isfinite(ergodic).mean()
    assert finding.statistic["reached_by_drawing_to_flock"] == np.isfinite(adapter).mean()
    assert finding.statistic["median_seconds_two_attractors"] == np.median(np.ceil(sequence))
    assert [flight["commands"] for flight in finding.series["flights"].values()] == [1, 2, 1]


@pytest.mark.parametrize(("mean", "apart", "holds"), [(1.1, 0.01, True), (1.1, 0.6, False), (0.8, 0.01, False)])
def test_a_weight_sets_the_compactness_where_flocks_are_surely_wider_by_as_much_as_was_drawn(
    monkeypatch, mean, apart, holds
):
    _, reaches = flocking_flights.asked()
    wanted = reaches[0] / reaches[1]
    ways = reached(20, 5, 9), reached(20, 40, 50), reached(0, 1)
    given(monkeypatch, ways, wanted * spread_around(mean, apart, 20))
    finding = flocking_comparison.measure(SEED)
    assert finding.supported == holds and [*finding.parts.values()] == [True, holds]
    assert finding.statistic["drawn_spots_diffuse_over_compact"] == pytest.approx(wanted) and wanted > 1.2
    assert finding.statistic["flock_at_least_weight_over_largest"] == pytest.approx(wanted * mean)
