from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.ours import dropout
from tests.benchmarks.paper.given import SEED, flights, spread_around

SMALL = {"SEEDS": 2}
"""What makes the figure quick."""


COVERED = dropout.COVERED


@pytest.mark.parametrize(
    ("by_rate", "holds"),
    [
        ({}, True),
        ({0.0: (0.95, 0.5)}, False),  # below on average, not with the whole interval
        ({0.05: (0.95, 0.5)}, False),
        ({0.1: (0.95, 0.5)}, False),
        ({0.1: (1.5, 0.1)}, False),
        ({0.3: (9.0, 0.1)}, True),  # more than half out: not claimed
        ({"fewer": (9.0, 0.1)}, True),
    ],
)
def test_a_target_is_kept_where_the_whole_interval_is_low_with_up_to_half_of_the_drones_out(
    monkeypatch, by_rate, holds
):
    def values(config, command, seeds, seconds):
        rate = config.dynamics.failure_rate if config.drones_per_team == (12, 0) else "fewer"
        assert config.dynamics.repair_rate == (0.0 if rate == "fewer" else dropout.REPAIR_RATE)
        assert command is dropout.TARGETS["bimodal"]
        mean, apart = by_rate.get(rate, (0.5, 0.1))
        found = np.full((seeds, seconds), 100.0)
        found[:, dropout.JUDGED - 1] = COVERED * spread_around(mean, apart, seeds)
        return found

    asked = []

    def captured(seeds, rate):
        asked.append((tuple(seeds), rate))
        return np.full((len(seeds), 60), 0.25 * COVERED)

    flown = flights(monkeypatch, dropout, values)
    monkeypatch.setattr(dropout, "captured_and_back", captured)
    finding = dropout.measure(SEED)
    assert finding.supported == holds
    assert {seeds for _, seeds, _ in flown} == {tuple(range(3000, 3040))} == {tuple(finding.seeds)}
    assert len(flown) == len(dropout.FAILURE_RATES) + 1
    assert set(finding.statistic) == set(finding.interval) >= {"metric_at_30_s_50_percent_out"}
    assert asked == [(tuple(range(3000, 3040)), rate) for rate in dropout.FAILURE_RATES[1:]]
    half = by_rate.get(0.1, (0.5, 0.1))[0]
    assert finding.statistic["failing_over_captured_50_percent_out"] == pytest.approx(half / 0.25)


def test_drones_out_in_the_long_run():
    assert dropout.share_out(0.0, 0.1) == 0.0
    assert dropout.share_out(dropout.HALF_OUT, dropout.REPAIR_RATE) == 0.5


def test_drones_are_captured_and_come_back_at_the_rates_at_which_others_fail(monkeypatch):
    away, changed = [], []

    def watched(simulator, *, then):
        for number in range(1, 601):
            before = simulator.teams.copy()
            then(number)
            away.append(simulator.teams.mean())
            for team in (0, 1):
                changed.append((team, (before == team).sum(), ((before == team) & (simulator.teams != team)).sum()))
        return np.zeros((40, 60))

    monkeypatch.setattr(dropout, "metric_over_time", watched)
    dropout.captured_and_back(range(40), dropout.HALF_OUT)
    for team in (0, 1):
        drones, leaving = np.sum([counts for of, *counts in changed if of == team], axis=0)
        chance = 1 - np.exp(-0.01)  # of 0.1 a second, in a control period
        assert abs(leaving / drones - chance) < 4 * np.sqrt(chance * (1 - chance) / drones)
    assert away[0] < 0.05 and abs(np.mean(away[300:]) - 0.5) < 0.05
