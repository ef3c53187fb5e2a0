from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.figures.claims import flocking_comparison
from tests.figures.given import SEED

SMALL = {"SEEDS": 2}
"""What makes the figure quick."""


def flight(seconds):
    seconds = np.array(seconds, float)
    return SimpleNamespace(
        seconds=seconds, metric=np.full((len(seconds), 60), 0.01), reaches=np.array([0.1, 0.2]), config=GameConfig(),
        series=lambda commands: {"commands": commands},
    )  # fmt: skip


def reached(count, soonest, latest=None, seeds=20):
    latest = soonest if latest is None else latest
    return [*np.linspace(soonest, latest, count), *[np.inf] * (seeds - count)]


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
def test_one_density_does_what_takes_a_flock_two_where_all_three_intervals_say_so(
    monkeypatch, ergodic, sequence, adapter, holds
):
    flown = []

    def fly(seeds):
        flown.append(seeds)
        names = flocking_comparison.ERGODIC, flocking_comparison.SEQUENCE, flocking_comparison.ADAPTER
        return dict(zip(names, map(flight, (ergodic, sequence, adapter)), strict=True))

    monkeypatch.setattr(flocking_comparison, "fly", fly)
    finding = flocking_comparison.measure(SEED)
    assert finding.supported == holds
    assert flown == [[3000 + number for number in range(20)]]
    assert finding.statistic["reached_by_ergodic"] == np.isfinite(ergodic).mean()
    assert finding.statistic["reached_by_density_to_flock"] == np.isfinite(adapter).mean()
    assert finding.statistic["median_seconds_two_attractors"] == np.median(sequence)
    assert [flight["commands"] for flight in finding.series["flights"].values()] == [1, 2, 1]
