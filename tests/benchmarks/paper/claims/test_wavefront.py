from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.claims import wavefront
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.rollout import Rollout
from tests.benchmarks.paper.given import SEED

SMALL = {"GAMES": 2, "OTHERS": ("chase", "ring")}
"""What makes the figure quick."""


@pytest.mark.parametrize(
    ("taken", "lost", "holds"),
    [
        (([30] * 40), ([30] * 40), (True, True)),
        (([30] * 40), ([21, 20] * 20), (True, True)),
        (([30] * 40), ([20] * 40), (True, False)),  # as many as others
        (([10] * 40), ([30] * 40), (False, True)),
        (([70, 1, 1, 10] * 10), ([30] * 40), (False, True)),  # more, not surely
    ],
)
def test_a_wave_captures_many_at_high_risk_where_both_are_surely_above_the_median(monkeypatch, taken, lost, holds):
    asked = []

    def counts(name, seed, config):
        asked.append((name, seed, config))
        rates = (taken, lost) if name == "wavefront" else ([20] * 40, [20] * 40)
        extra = {"ring": 100, "noise": -10}.get(name, 0)
        return np.stack([np.array(rates[0]) + extra, np.array(rates[1]) + extra, np.ones(40)], axis=1)

    monkeypatch.setattr(wavefront, "counts", counts)
    finding = wavefront.measure(SEED)
    assert tuple(finding.parts.values()) == holds
    assert finding.supported == all(holds)
    assert finding.statistic["taken_a_minute"] == pytest.approx(np.mean(taken))
    assert finding.statistic["lost_a_minute_above_the_median"] == pytest.approx(np.mean(lost) - 20)
    assert [name for name, *_ in asked] == ["wavefront", *wavefront.OTHERS]
    assert {(seed, config) for _, seed, config in asked} == {(SEED, GameConfig())}
    assert not {"uniform", "wavefront"} & set(wavefront.OTHERS)
    words = [
        "surely more" if above else "surely fewer" if np.mean(own) < 20 else "not surely more"
        for above, own in zip(holds, (taken, lost), strict=True)
    ]
    assert f"{words[0]} are taken than is usual, and {words[1]} lost" in finding.seen


def test_rates_are_of_all_minutes_together():
    games = np.array([[[10.0, 2.0, 1.0]], [[0.0, 4.0, 4.0]]])
    assert wavefront.rates(games).tolist() == [[2.0, 1.2]]


def test_drones_are_counted_from_the_attackers_side(monkeypatch):
    class Told(Rollout):
        def play(self):
            games = self.simulator.games
            games.captures[:] = [[7, 2], [1, 3]]
            games.ticks[:] = [1800, 900]

    monkeypatch.setattr(wavefront, "Rollout", Told)
    monkeypatch.setattr(wavefront, "GAMES", 2)
    assert wavefront.counts("wavefront", SEED, GameConfig()).tolist() == [[7, 2, 1.0], [1, 3, 0.5]]
