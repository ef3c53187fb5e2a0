"""The held-out suite; what its tactics ask for is held by the digests of their source in the protocol."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.policies import held_out, zoo
from swarm_pz.policies.held_out import SUITE, play_suites
from swarm_pz.policies.scripted import SCRIPTS
from tests.elsewhere import Elsewhere


def test_the_suite_is_the_one_that_published_scores_are_of_and_nobody_finds_it_by_name():
    assert [trial.name for trial in SUITE] == [
        "drifting", "clearing", "wide_ring", "crossing", "ring_or_halo", "lasso_or_noise", "uniform_or_wavefront",
        "uniform, 5 a team", "uniform, 20 a team", "ring, 7 a team", "halo, 15 a team",
    ]  # fmt: skip
    for trial in SUITE:
        assert trial.opponent.__name__ not in policies.names() or trial.drones_per_team is not None


def results(suites):
    """Return what matches came to, without the times they took."""
    return [
        (match.policy, match.opponent, match.config, [(game.fingerprint, game.outcome) for game in match.games])
        for match in (*suites.known, *suites.held_out)
    ]


def test_scores_are_means_over_the_suites_whoever_plays_them(tmp_path):
    (tmp_path / "there").mkdir()
    shutil.copytree(Path(zoo.__file__).parent / "champion", tmp_path / "mine")
    config = GameConfig(drones_per_team=2, time_limit=2.0)
    suites = play_suites("mine", config, games=2)
    there = Elsewhere(tmp_path / "there")
    assert results(play_suites("mine", config, games=2, pool=there)) == results(suites)
    assert there.given == ["play_trial"] * (len(SCRIPTS) + len(SUITE))
    figures = suites.to_dict()
    assert [entry["opponent"] for entry in figures["in_suite"]] == [script.__name__ for script in SCRIPTS]
    assert [entry["opponent"] for entry in figures["held_out"]] == [trial.name for trial in SUITE]
    assert figures["generalisation"] == pytest.approx(figures["held_out_score"] - figures["in_suite_score"])
    for part in ("held_out", "in_suite"):
        scores = [(match["wins"] + match["draws"] / 2) / match["games"] for match in figures[part]]
        assert figures[f"{part}_score"] == pytest.approx(np.mean(scores))


def test_every_match_is_played_with_the_settings_that_were_asked_for(monkeypatch):
    played, shown = [], []

    def play_match(player, opponent, **given):
        played.append((player.name, opponent.name, given))
        return opponent.name

    monkeypatch.setattr(held_out, "play_match", play_match)
    config = GameConfig(drones_per_team=3, command_cells=6, time_limit=7.0)
    suites = play_suites("ring", config, games=4, seed=7, threads=3, progress=lambda *told: shown.append(told))
    trials = [*[held_out.Trial(script) for script in SCRIPTS], *SUITE]
    assert played == [
        (
            "ring", trial.name,
            {"games": 4, "seed": 7, "threads": 3, "config": config.replace(drones_per_team=trial.drones_per_team or 3)},
        )
        for trial in trials
    ]  # fmt: skip
    assert (suites.known, suites.held_out) == ([one.__name__ for one in SCRIPTS], [trial.name for trial in SUITE])
    assert shown == [(4 * number, 4 * len(trials)) for number in range(1, len(trials) + 1)]
