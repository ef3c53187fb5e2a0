from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper import talk
from benchmarks.paper.ours import relays
from tests.benchmarks.paper.given import SEED, flights

SMALL = {"SEEDS": 2, "RADII": (1.5, 0.4, 0.0)}
"""What makes the figure quick."""


@pytest.mark.parametrize(
    ("times", "apart", "holds"), [(1.1, 0.02, True), (1.17, 0.2, False), (1.3, 0.02, False), (0.2, 0.02, True)]
)
@pytest.mark.parametrize("target", relays.TARGETS)
def test_relays_mend_it_where_no_radius_is_surely_worse_than_silence(monkeypatch, times, apart, holds, target):
    def values(config, command, seeds, seconds):
        assert (seeds, seconds) == (relays.SEEDS, relays.JUDGED)
        controller = config.controller
        here = command is relays.TARGETS[target] and controller.communication_radius == 0.1
        value, luck = 1.0, 0.0
        if controller.relay and here:
            value, luck = times, apart * np.where(np.arange(seeds) % 2, 1.0, -1.0)
        if not controller.relay and controller.communication_radius:
            value = 3.0
        return np.tile(np.broadcast_to(value + luck, seeds)[:, None], (1, 3)) * [5.0, 7.0, 1.0]

    flown = flights(monkeypatch, talk, values)
    finding = relays.measure(SEED)
    assert finding.supported == holds
    assert len(flown) == 2 * 3 * len(talk.RADII) == len(finding.configs) * 3
    drawn = {name: found["mean"] for name, found in finding.series[target].items()}
    place = relays.RADII.index(0.1)
    assert drawn["one hop"][place] == pytest.approx(3.0) and drawn["relays"][place] == pytest.approx(times)
    assert finding.statistic["most_times_silence_with_one_hop"] == pytest.approx(3.0)
    assert finding.statistic["most_times_silence_with_relays"] == pytest.approx(max(times, 1.0))
