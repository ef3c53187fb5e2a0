from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.figures.claims import scale_invariance
from tests.figures.given import SEED, flights, spread_around

SMALL = {"SEEDS": 2}
"""What makes the figure quick."""


@pytest.mark.parametrize(
    ("mean", "apart", "holds"), [(0.5, 0.1, True), (0.95, 0.5, False), (0.95, 0.01, True), (1.2, 0.1, False)]
)
@pytest.mark.parametrize(("size", "target"), [(6, "uniform"), (24, "bimodal")])
def test_all_sizes_must_surely_cover_all_targets(monkeypatch, mean, apart, holds, size, target):
    def values(config, command, seeds, seconds):
        judged = config.drones_per_team[0] == size and command is scale_invariance.TARGETS[target]
        found = np.full((seeds, seconds), 100.0)
        found[:, scale_invariance.JUDGED - 1] = scale_invariance.COVERED * (
            spread_around(mean, apart, seeds) if judged else 0.3
        )
        return found

    flown = flights(monkeypatch, scale_invariance, values)
    finding = scale_invariance.measure(SEED)
    assert finding.supported == holds
    assert len(flown) == 9 and {seeds for _, seeds, _ in flown} == {tuple(range(3000, 3020))}
    assert finding.statistic["worst_metric_at_30_s"] == pytest.approx(scale_invariance.COVERED * mean)
    assert finding.statistic["largest_difference_at_30_s"] == pytest.approx(scale_invariance.COVERED * (mean - 0.3))


def test_the_worst_mean_and_the_largest_difference_are_of_means_over_seeds():
    values = np.array([[[1.0, 2.0], [5.0, 0.0]], [[3.0, 2.0], [5.0, 4.0]]])  # means: [[2, 2], [5, 2]]
    assert scale_invariance.worst_mean(values) == 5.0
    assert scale_invariance.largest_difference(values) == 3.0
