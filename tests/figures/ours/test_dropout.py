from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.figures.ours import dropout
from tests.figures.given import SEED, flights, spread_around

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

    flown = flights(monkeypatch, dropout, values)
    finding = dropout.measure(SEED)
    assert finding.supported == holds
    assert {seeds for _, seeds, _ in flown} == {tuple(range(3000, 3040))} == {tuple(finding.seeds)}
    assert len(flown) == len(dropout.FAILURE_RATES) + 1
    assert set(finding.statistic) == set(finding.interval) >= {"metric_at_30_s_50_percent_out"}


def test_drones_out_in_the_long_run():
    assert dropout.share_out(0.0, 0.1) == 0.0
    assert dropout.share_out(dropout.HALF_OUT, dropout.REPAIR_RATE) == 0.5
