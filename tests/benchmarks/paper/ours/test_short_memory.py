from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper import talk
from benchmarks.paper.coverage import JUDGED
from benchmarks.paper.ours import short_memory
from tests.benchmarks.paper.given import SEED, flights

SMALL = {"SEEDS": 2, "RADII": (1.5, 0.4, 0.0), "REMEMBERED_S": (4.0, 8.0)}
"""What makes the figure quick."""

NOISE = np.linspace(-0.02, 0.02, short_memory.SEEDS)


@pytest.mark.parametrize(
    ("worst", "holds"),
    [
        ({2.0: 3.0, 4.0: 2.0, 8.0: 1.2}, True),
        ({2.0: 3.0, 4.0: 2.0, 8.0: 2.0}, False),
        ({2.0: 2.0, 4.0: 2.0, 8.0: 1.2}, False),
        ({2.0: 1.5, 4.0: 2.0, 8.0: 1.2}, False),
        ({2.0: 0.9, 4.0: 0.8, 8.0: 0.7}, True),
    ],
)
@pytest.mark.parametrize("target", short_memory.TARGETS)
def test_memory_is_why_where_each_longer_one_makes_the_worst_radius_better(monkeypatch, worst, holds, target):
    def values(config, command, seeds, seconds):
        assert (seeds, seconds) == (short_memory.SEEDS, JUDGED)
        tau, radius = config.memory.controller, config.controller.communication_radius
        here = command is short_memory.TARGETS[target]
        # Silence is not the same at every time constant.
        value = tau * (1.0 if radius == 0.0 else worst[tau] if here and radius == 0.2 else 0.5)
        return np.tile((value * (1 + NOISE))[:, None], (1, 3)) * [5.0, 7.0, 1.0]

    flown = flights(monkeypatch, talk, values)
    finding = short_memory.measure(SEED)
    assert finding.supported == holds
    assert len(flown) == 3 * 3 * len(talk.RADII) == len(finding.configs) * 3
    for tau, times in worst.items():
        drawn = finding.series[target][f"memory of {tau:g} s"]["mean"]
        assert drawn[short_memory.RADII.index(0.2)] == pytest.approx(tau * times, rel=0.01)
        assert finding.statistic[f"most_times_silence_at_{tau:g}_s"] == pytest.approx(times)
    assert finding.statistic["at_8_s_over_4_s"] == pytest.approx(worst[8.0] / worst[4.0])


def test_the_interval_of_the_change_decides(monkeypatch):
    def values(config, command, seeds, seconds):
        tau, radius = config.memory.controller, config.controller.communication_radius
        value = {2.0: 2.0, 4.0: 1.5, 8.0: 1.45}[tau] if radius == 0.2 else 1.0
        luck = 0.3 * np.sin(10 * np.arange(seeds)) if (tau, radius) == (8.0, 0.2) else 0.0
        return np.tile(np.broadcast_to(value + luck, seeds)[:, None], (1, seconds))

    flights(monkeypatch, talk, values)
    finding = short_memory.measure(SEED)
    low, high = finding.interval["at_8_s_over_4_s"]
    assert finding.statistic["at_8_s_over_4_s"] < 1.0 < high and low < 1.0
    assert not finding.supported
