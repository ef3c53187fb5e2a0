from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from swarm_pz.config import GameConfig
from swarm_pz.training import report

SHARES = {
    "centre": 0.1, "corners": 0.4, "halo": 0.3, "uniform": 0.2, "noise": 0.9, "trained": 0.5, "untrained": 0.0,
    "hold": 0.0,
}  # fmt: skip


@pytest.mark.parametrize(
    ("controllers", "baselines"), [("ergodic", ["untrained", "noise", "corners"]), ("direct", ["untrained", "hold"])]
)
def test_a_tactic_is_compared_on_the_same_games_with_its_baselines(monkeypatch, controllers, baselines):
    played = []

    def play_match(policy, opponent, **given):
        played.append((opponent, given))
        return SimpleNamespace(policy=policy, summary=lambda: {"mean_share": SHARES[policy]})

    def paired_difference(first, second):
        difference = SHARES[first.policy] - SHARES[second.policy]
        return difference, difference - 0.5, difference + 0.25

    monkeypatch.setattr(report, "play_match", play_match)
    monkeypatch.setattr(report, "paired_difference", paired_difference)
    config = GameConfig(drones_per_team=3, controllers=controllers)
    match, comparisons = report.compare("trained", "untrained", config, games=6, seed=4, threads=3)
    assert match.policy == "trained"
    assert [comparison.match.policy for comparison in comparisons] == baselines
    for found, name in zip(comparisons, baselines, strict=True):
        difference = 0.5 - SHARES[name]
        assert (found.difference, found.low, found.high) == (difference, difference - 0.5, difference + 0.25)
    assert all(how == ("uniform", {"games": 6, "seed": 4, "config": config, "threads": 3}) for how in played)


def test_a_learning_curve_shows_what_the_evaluations_found_over_thousands_of_steps(tmp_path, monkeypatch):
    figures, save = [], Figure.savefig
    monkeypatch.setattr(Figure, "savefig", lambda self, *a, **given: figures.append(self) or save(self, *a, **given))
    names = ("step", "win_rate", "win_rate_low", "win_rate_high", "loss_rate", "share", "training_share")
    rows = [(0, 0.25, 0.125, 0.375, 0.5, 0.3, 0.0), (5500, 0.75, 0.7, 0.9, 0.1, 0.8, 0.65)]
    report.plot_learning_curve([dict(zip(names, row, strict=True)) for row in rows], "ring", tmp_path / "curve.png")
    assert (tmp_path / "curve.png").stat().st_size > 1000
    (axes,) = figures[0].axes
    assert {line.get_label(): np.array(line.get_data()).T.tolist() for line in axes.lines[:4]} == {
        "games won": [[0, 0.25], [5.5, 0.75]],
        "games lost": [[0, 0.5], [5.5, 0.1]],
        "share of drones": [[0, 0.3], [5.5, 0.8]],
        "share while learning, all opponents": [[5.5, 0.65]],  # none before the first game
    }
    corners = {tuple(point) for point in axes.collections[0].get_paths()[0].vertices.round(6).tolist()}
    assert corners == {(0, 0.125), (0, 0.375), (5.5, 0.7), (5.5, 0.9)}
