from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.figures.claims import compactness
from tests.figures.given import SEED

SMALL = {"GAMES": 2, "PLAYERS": ("centre", "uniform", "ring")}
"""What makes the figure quick."""


@pytest.mark.parametrize(("high", "holds"), [(-0.001, True), (0.001, False)])
def test_bunching_up_is_a_risk_where_the_whole_interval_says_so(monkeypatch, high, holds):
    played = []

    class Unplayed(Rollout):
        def __init__(self, *given, **options):
            played.append((*given, options))
            super().__init__(*given, **options)

        def play(self, *, after_step):
            for _ in range(compactness.AHEAD):
                after_step(self)

    monkeypatch.setattr(compactness, "GAMES", 8)
    monkeypatch.setattr(compactness, "PLAYERS", ("uniform", "ring", "noise"))
    monkeypatch.setattr(compactness, "Rollout", Unplayed)
    monkeypatch.setattr(compactness, "rank_correlation", lambda games: (-0.1, (-0.2, high)))
    assert compactness.measure(SEED).supported == holds
    options = {"seed": SEED, "config": GameConfig()}
    numbers = [*range(0, 16, 2)]
    assert played == [
        (*pair, numbers, options) for pair in (("uniform", "ring"), ("uniform", "noise"), ("ring", "noise"))
    ]


def test_losses_are_counted_from_each_look_to_the_next_and_to_the_end(monkeypatch):
    config = GameConfig(drones_per_team=(6, 5))
    rollout = Rollout("uniform", "uniform", [0, 2], config=config)
    watcher = compactness.Watcher(2)
    games = rollout.simulator.games
    watcher(rollout)
    for step in range(1, 9):
        games.ticks[:] = 30 * step
        if step == 3:
            games.capture_ticks[0, :3] = 75
            games.teams[0, :3] = 1
        if step == 5:
            looked = games.positions[0].copy()
        if step == 7:  # ends between two looks: blue takes the others
            games.capture_ticks[0, 3:6] = 200
            games.teams[0, 3:6] = 1
            rollout.batch.running[0] = False
        watcher(rollout)
        rollout.rows = np.flatnonzero(rollout.batch.running)
    first, second = watcher.samples
    assert [share for _, share in first] == [0.5, 0.0, 0.0], "red's half; blue; what blue has grown to, at the end"
    assert first[-1][0] == pytest.approx(compactness.spread_of(looked, np.array([1, 1, 1, 0, 0, 0, 1, 1, 1, 1, 1]) > 0))
    assert [share for _, share in second] == [0.0, 0.0]


def test_spread_is_the_rms_distance_from_the_mean():
    positions = np.array([[0.0, 0.0], [0.6, 0.8], [9.0, 9.0]], np.float32)
    assert compactness.spread_of(positions, np.array([True, True, False])) == pytest.approx(0.5)


def test_bins_hold_equally_many_looks():
    spread = np.linspace(0.1, 0.5, 80)
    games = [np.stack([spread, spread > 0.3], axis=1)] * 3
    bins = compactness.binned(games)
    assert bins["lost"]["mean"] == bins["half"]["mean"] == [0, 0, 0, 0, 1, 1, 1, 1]
    assert bins["spread"] == sorted(bins["spread"])


def test_half_of_a_team_is_half():
    bins = compactness.binned([np.stack([np.linspace(0.1, 0.5, 80), np.full(80, 0.5)], axis=1)])
    assert bins["half"]["mean"] == [1.0] * 8 and bins["lost"]["mean"] == [0.5] * 8
