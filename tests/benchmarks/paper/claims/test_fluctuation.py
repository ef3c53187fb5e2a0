from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.claims import fluctuation
from benchmarks.paper.coverage import SECONDS, hand_over, start
from tests.benchmarks.paper.given import SEED, spread_around

SMALL = {"SEEDS": 2}
"""What makes the figure quick."""

WAYS = list(fluctuation.CHANGES)


@pytest.mark.parametrize(
    ("mean", "apart", "holds"), [(0.5, 0.1, True), (0.95, 0.5, False), (0.95, 0.01, True), (1.2, 0.1, False)]
)
@pytest.mark.parametrize(("way", "target"), [(1, "uniform"), (2, "bimodal"), (0, "centre")])
def test_all_targets_must_surely_be_covered_whoever_is_captured(monkeypatch, mean, apart, holds, way, target):
    flown = []

    def fly(config, seeds, name, changes):
        flown.append((config.drones_per_team, tuple(seeds), name, changes))
        here = (changes, name) == (WAYS[way], target)
        found = np.full((len(seeds), SECONDS), 100.0)
        found[:, fluctuation.JUDGED - 1] = fluctuation.COVERED * spread_around(
            mean if here else 0.3, apart if here else 0.0, len(seeds)
        )
        return found

    monkeypatch.setattr(fluctuation, "fly", fly)
    finding = fluctuation.measure(SEED)
    # A team that nobody leaves is there to compare with.
    assert finding.supported == (holds or way == 0)
    assert finding.parts == {changes: holds or changes != WAYS[way] for changes in WAYS[1:]}
    drawn = {changes: found["mean"][fluctuation.JUDGED - 1] for changes, found in finding.series[target].items()}
    expected = {changes: fluctuation.COVERED * (mean if changes == WAYS[way] else 0.3) for changes in WAYS}
    assert drawn == pytest.approx(expected, rel=0.01)
    assert (f"{target} ({WAYS[way]}: " in finding.seen) == (not finding.supported)
    seeds = tuple(range(3000, 3020))
    assert flown == [(12, seeds, name, changes) for changes in WAYS for name in fluctuation.TARGETS]


@pytest.mark.parametrize("changes", WAYS)
def test_drones_change_sides_when_it_is_said_and_as_many(monkeypatch, changes):
    sizes, moved = [], []

    def watched(simulator, *, then):
        for number in range(1, 10 * 12 + 1):
            before = simulator.teams.copy()
            then(number)
            sizes.append(simulator.sizes[:, 0].tolist())
            moved.append((simulator.teams != before).sum(axis=1).tolist())
        return np.zeros((2, 12))

    monkeypatch.setattr(fluctuation, "metric_over_time", watched)
    config = fluctuation.GameConfig(drones_per_team=12, capture=fluctuation.CaptureConfig(enabled=False))
    fluctuation.fly(config, [1, 2], "centre", changes)
    at_once = [0] * 99 + [4] + [0] * 20
    expected = {WAYS[0]: [0] * 120, WAYS[1]: at_once, WAYS[2]: ([0] * 9 + [1]) * 12}[changes]
    assert moved == [[number, number] for number in expected]
    if changes == WAYS[1]:
        assert sizes[-1] == [8, 8]


def test_a_drone_that_is_handed_over_has_a_new_team_and_no_past_and_nobody_else_has():
    simulator = start(fluctuation.GameConfig(drones_per_team=3), [4, 5], fluctuation.TARGETS["centre"])
    simulator.advance(30)
    before = simulator.snapshot()
    chosen = np.zeros((2, 6), bool)
    chosen[0, 1] = chosen[1, 4] = True
    hand_over(simulator, chosen)
    games = simulator.games
    np.testing.assert_array_equal(games.teams != before.teams, chosen)
    assert games.teams[0].tolist() == [0, 1, 0, 1, 1, 1] and games.teams[1].tolist() == [0, 0, 0, 1, 0, 1]
    for drones, memory in ((chosen, 0.0), (~chosen, 1.0)):
        for game in range(2):
            kept = games.memory[game][..., drones[game]], games.memory_weight[game, drones[game]]
            had = before.memory[game][..., drones[game]], before.memory_weight[game, drones[game]]
            for now, then in zip(kept, had, strict=True):
                np.testing.assert_array_equal(now, memory * then)
    for name in ("positions", "velocities", "targets", "coefficients", "ticks", "seeds"):
        np.testing.assert_array_equal(getattr(games, name), getattr(before, name))
    # What fields say is what trails add up to, now and later.
    simulator.advance(30)
    assert simulator.occupancy.sum() == 2 * 6 * 30
    cells = simulator.capture_field
    assert (cells >= 0).all() and cells.max() > 0
