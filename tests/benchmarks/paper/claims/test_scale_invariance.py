from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from benchmarks.paper.claims import scale_invariance
from tests.benchmarks.paper.given import SEED, spread_around

SMALL = {"SEEDS": 2}
"""What makes the figure quick."""


def flights(monkeypatch, judged, elsewhere):
    """Let the metric at the judged second and the share of time elsewhere be what functions say; return what flew."""
    flown = []

    def fly(config, seeds, drawing):
        size, controller = config.drones_per_team[0], config.team_controllers[0]
        flown.append((size, controller, drawing, tuple(seeds)))
        metric = np.full((len(seeds), 60), 100.0)
        metric[:, scale_invariance.JUDGED - 1] = judged(size, controller, drawing)

        def maps(cells):
            found = np.zeros((len(seeds), cells, cells))
            found[:, 0, 0] = 1.0
            if size == 24:
                found[:, 0, 1] = elsewhere(controller, drawing)
                found[:, 0, 0] -= found[:, 0, 1]
            return found

        return SimpleNamespace(config=config, metric=metric, maps=maps)

    monkeypatch.setattr(scale_invariance, "fly", fly)
    return flown


@pytest.mark.parametrize(
    ("mean", "apart", "holds"), [(0.5, 0.1, True), (0.95, 0.5, False), (0.95, 0.01, True), (1.2, 0.1, False)]
)
@pytest.mark.parametrize("place", [(6, "ring"), (24, "keep_away"), (12, "two_spots")])
def test_all_sizes_must_surely_cover_all_drawings(monkeypatch, mean, apart, holds, place):
    def judged(size, controller, drawing):
        if controller == "flocking":
            return 0.4
        return scale_invariance.COVERED * (spread_around(mean, apart, 20) if (size, drawing) == place else 0.3)

    flown = flights(monkeypatch, judged, lambda controller, drawing: 0.1)
    finding = scale_invariance.measure(SEED)
    assert finding.supported == holds
    assert len(set(flown)) == 18 and {seeds for *_, seeds in flown} == {tuple(range(3000, 3020))}
    assert finding.statistic["worst_metric_at_30_s_ergodic"] == pytest.approx(scale_invariance.COVERED * mean)
    assert finding.statistic["worst_metric_at_30_s_flocking"] == pytest.approx(0.4)


@pytest.mark.parametrize(
    ("drawing", "controller"), [("ring", "ergodic"), ("keep_away", "ergodic"), ("ring", "flocking")]
)
def test_where_small_and_large_teams_are_is_told_and_decides_nothing(monkeypatch, drawing, controller):
    def elsewhere(*place):
        return spread_around(0.5, 0.1, 20) if place == (controller, drawing) else 0.1

    flights(monkeypatch, lambda *where: 0.5 * scale_invariance.COVERED, elsewhere)
    finding = scale_invariance.measure(SEED)
    assert finding.supported
    assert finding.statistic[f"6_and_24_apart_{drawing}_{controller}"] == pytest.approx(0.5)


def test_the_worst_mean_is_of_means_over_seeds():
    values = np.array([[[1.0, 2.0], [5.0, 0.0]], [[3.0, 2.0], [5.0, 4.0]]])  # means: [[2, 2], [5, 2]]
    assert scale_invariance.worst_mean(values) == 5.0


def test_maps_are_apart_by_the_share_of_time_that_is_elsewhere():
    one, other = np.zeros((2, 2, 2)), np.zeros((2, 2, 2))
    one[:, 0, 0] = 1.0
    other[0, 1, 1] = 1.0
    other[1] = 0.25
    assert scale_invariance.apart(one, other).tolist() == [1.0, 0.75]


def test_drones_fly_for_what_was_drawn():
    config = scale_invariance.lone_team(6)
    found = scale_invariance.fly(config, [0], "two_spots").maps(10)[0]
    assert found[:5, :5].sum() + found[5:, 5:].sum() > 0.8 and found[5:, :5].sum() < 0.15
