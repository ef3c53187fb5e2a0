from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from swarm_pz.config import GameConfig
from swarm_pz.training import report
from swarm_pz.training.run_state import History

SHARES = {"centre": 0.1, "corners": 0.4, "halo": 0.3, "uniform": 0.2, "noise": 0.9, "trained": 0.5, "untrained": 0.0}


def test_a_tactic_is_compared_on_the_same_games_with_its_untrained_network_noise_and_the_best_that_never_moves(
    monkeypatch,
):
    played, compared = [], []

    def play_match(policy, opponent, **given):
        name = getattr(policy, "name", policy)
        played.append((name, opponent, given))
        return SimpleNamespace(policy=name, summary=lambda: {"mean_share": SHARES[name]})

    def paired_difference(first, second):
        compared.append((first.policy, second.policy))
        return len(compared), len(compared) - 0.5, len(compared) + 0.25

    monkeypatch.setattr(report, "play_match", play_match)
    monkeypatch.setattr(report, "paired_difference", paired_difference)
    config = GameConfig(drones_per_team=3)
    match, comparisons = report.compare("trained", "untrained", config, games=6, seed=4, threads=3)
    assert match.policy == "trained"
    baselines = ["untrained", "noise", "corners"]
    assert [comparison.match.policy for comparison in comparisons] == baselines
    assert [(found.difference, found.low, found.high) for found in comparisons] == [
        (number, number - 0.5, number + 0.25) for number in (1, 2, 3)
    ]
    assert compared == [("trained", name) for name in baselines]
    assert {name for name, *_ in played} == set(SHARES)
    for _, *how in played:
        assert how == ["uniform", {"games": 6, "seed": 4, "config": config, "threads": 3}]


@pytest.fixture
def drawn(monkeypatch):
    """Keep the figures that are saved."""
    figures, save = [], Figure.savefig

    def keep(self, *args, **given):
        figures.append(self)
        save(self, *args, **given)

    monkeypatch.setattr(Figure, "savefig", keep)
    return figures


def curve(axes, label):
    (line,) = [line for line in axes.lines if line.get_label() == label]
    return list(zip(*(np.asarray(values).tolist() for values in line.get_data()), strict=True))


def test_a_learning_curve_shows_what_the_evaluations_found_over_thousands_of_steps(drawn, tmp_path):
    names = ("step", "win_rate", "win_rate_low", "win_rate_high", "loss_rate", "share", "training_share")
    rows = [
        (0, 0.25, 0.125, 0.375, 0.5, 0.3, 0.0),
        (2000, 0.5, 0.4, 0.6, 0.2, 0.55, 0.45),
        (5500, 0.75, 0.7, 0.9, 0.1, 0.8, 0.65),
    ]
    history = History(records=[dict(zip(names, row, strict=True)) for row in rows])
    report.plot_learning_curve(history, "ring", tmp_path / "curve.png")
    assert (tmp_path / "curve.png").stat().st_size > 1000
    (axes,) = drawn[0].axes
    assert curve(axes, "games won") == [(0, 0.25), (2, 0.5), (5.5, 0.75)]
    assert curve(axes, "games lost") == [(0, 0.5), (2, 0.2), (5.5, 0.1)]
    assert curve(axes, "share of drones") == [(0, 0.3), (2, 0.55), (5.5, 0.8)]
    assert curve(axes, "share while learning, all opponents") == [(2, 0.45), (5.5, 0.65)]  # none before the first game
    (band,) = axes.collections
    corners = {tuple(point) for point in band.get_paths()[0].vertices.round(6).tolist()}
    assert corners == {(0, 0.125), (0, 0.375), (2, 0.4), (2, 0.6), (5.5, 0.7), (5.5, 0.9)}
    assert axes.get_ylabel() == "against ring"
    assert [text.get_text() for text in axes.texts] == ["as good as ring "]


def test_team_sizes_are_drawn_as_reds_share_of_all_drones_for_every_game_that_counts(drawn, tmp_path):
    unique = [SimpleNamespace(sizes=[2, 5, 8]), SimpleNamespace(sizes=[2, 0])]
    match = SimpleNamespace(
        policy="ring", opponent="halo", unique=unique, games=[*unique, unique[0]],
        config=GameConfig(drones_per_team=(2, 6)),
    )  # fmt: skip
    report.plot_sizes(match, tmp_path / "sizes.png")
    (axes,) = drawn[0].axes
    lines = [line.get_ydata().tolist() for line in axes.lines if len(line.get_ydata()) > 2 or line.get_ydata()[0] < 0.5]
    assert lines == [[0.25, 0.625, 1.0], [0.25, 0.0]]
    assert axes.get_title() == "ring against halo, 2 games"
