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


def test_scores_are_means_over_the_suites_whoever_plays_them(tmp_path, monkeypatch):
    monkeypatch.setattr(held_out, "_TRIALS", (*held_out._TRIALS[:13], held_out._TRIALS[-1]))  # two are enough
    (tmp_path / "there").mkdir()
    shutil.copytree(Path(zoo.__file__).parent / "champion", tmp_path / "mine")
    config = GameConfig(drones_per_team=2, time_limit=2.0)
    suites, there = play_suites("mine", config, games=2), Elsewhere(tmp_path / "there")
    again = play_suites("mine", config, games=2, pool=there)
    for matches, others in zip(suites, again, strict=True):
        for one, other in zip(matches, others, strict=True):
            assert (one.policy, one.opponent, one.config) == (other.policy, other.opponent, other.config)
            assert [game.fingerprint for game in one.games] == [game.fingerprint for game in other.games]
    assert there.given == ["play_trial"] * (len(SCRIPTS) + 2)
    figures = suites.to_dict()
    assert [entry["opponent"] for entry in figures["held_out"]] == ["drifting", "halo, 15 a team"]
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
    sizes = {script.__name__: 3 for script in SCRIPTS} | {trial.name: trial.drones_per_team or 3 for trial in SUITE}
    how = {"games": 4, "seed": 7, "threads": 3}
    assert played == [("ring", name, how | {"config": config.replace(drones_per_team=sizes[name])}) for name in sizes]
    assert (suites.known, suites.held_out) == (list(sizes)[: len(SCRIPTS)], list(sizes)[len(SCRIPTS) :])
    assert shown == [(4 * number, 4 * len(sizes)) for number in range(1, len(sizes) + 1)]
