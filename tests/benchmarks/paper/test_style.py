"""What is drawn is what was found: intervals reach from their low end to their high one."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure as Canvas

from benchmarks.paper import style


def reaches(axes):
    """Return the ends [[x, y], [x, y]] of every interval that was drawn into axes."""
    return [segment.tolist() for bars in axes.containers if hasattr(bars, "has_yerr") for segment in
            bars.lines[2][0].get_segments()]  # fmt: skip


@pytest.mark.parametrize("sideways", [False, True])
def test_whiskers_reach_from_low_to_high(sideways):
    axes = Canvas().subplots()
    style.whisker(axes, [1.0, 2.0], [5.0, 7.0], [4.0, 7.5], [8.0, 9.0], sideways=sideways, fmt="o")
    expected = np.array([[[1.0, 4.0], [1.0, 8.0]], [[2.0, 7.0], [2.0, 9.0]]])  # none beside its value
    np.testing.assert_allclose(reaches(axes), expected[..., ::-1] if sideways else expected)


def test_bars_are_the_shares_won_drawn_and_lost_from_the_top_down():
    rows = [
        {"policy": "a", "games": 10, "win": 2, "draw": 3, "loss": 5, "win_ci95": (0.1, 0.45)},
        {"policy": "b", "games": 4, "win": 4, "draw": 0, "loss": 0, "win_ci95": (0.6, 1.0)},
    ]
    axes = Canvas().subplots()
    style.bars(axes, rows)
    drawn = {bars.get_label(): [(bar.get_x(), bar.get_width()) for bar in bars] for bars in axes.containers[:3]}
    expected = {"won": [(0, 0.2), (0, 1)], "drawn": [(0.2, 0.3), (1, 0)], "lost": [(0.5, 0.5), (1, 0)]}
    assert {label: pytest.approx(np.array(bars)) for label, bars in expected.items()} == drawn
    names = [label.get_text() for label in axes.get_yticklabels()]
    assert dict(zip(axes.get_yticks(), names, strict=True)) == {1: "a", 0: "b"}
    np.testing.assert_allclose(reaches(axes), [[[0.1, 1], [0.45, 1]], [[0.6, 0], [1.0, 0]]])


def test_a_band_reaches_from_low_to_high_around_the_mean():
    axes = Canvas().subplots()
    style.band(axes, np.array([0.0, 1.0]), {"mean": [2.0, 3.0], "low": [1.0, 2.5], "high": [4.0, 5.0]}, "k", "-", "")
    assert axes.lines[0].get_ydata().tolist() == [2.0, 3.0]
    (path,) = axes.collections[0].get_paths()
    assert {tuple(point) for point in path.vertices} == {(0, 1), (0, 4), (1, 2.5), (1, 5)}
