"""The held-out suite; what its tactics ask for is held by the digests of their source in the protocol."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.match import play_match
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


def test_matches_are_those_that_were_asked_for_whoever_plays_them_and_scores_are_means_over_the_suites(
    tmp_path, monkeypatch
):
    monkeypatch.setattr(held_out, "_TRIALS", (*held_out._TRIALS[:13], held_out._TRIALS[-1]))  # two are enough
    (tmp_path / "there").mkdir()
    shutil.copytree(Path(zoo.__file__).parent / "champion", tmp_path / "mine")
    config, shown, many = GameConfig(drones_per_team=2, time_limit=2.0), [], len(SCRIPTS) + 2
    suites = play_suites("mine", config, games=2, seed=7, progress=lambda *told: shown.append(told))
    assert shown == [(2 * number, 2 * many) for number in range(1, many + 1)]
    last = suites.held_out[-1]
    assert last.config == config.replace(drones_per_team=15) and suites.known[0].config == config
    alone = play_match(policies.load("mine"), "halo", games=2, seed=7, config=last.config)
    assert [game.fingerprint for game in last.games] == [game.fingerprint for game in alone.games]
    there = Elsewhere(tmp_path / "there")
    again = play_suites("mine", config, games=2, seed=7, pool=there)
    for matches, others in zip(suites, again, strict=True):
        for one, other in zip(matches, others, strict=True):
            assert (one.policy, one.opponent, one.config) == (other.policy, other.opponent, other.config)
            assert [game.fingerprint for game in one.games] == [game.fingerprint for game in other.games]
    assert there.given == ["play_trial"] * many
    figures = suites.to_dict()
    assert [entry["opponent"] for entry in figures["held_out"]] == ["drifting", "halo, 15 a team"]
    assert figures["generalisation"] == pytest.approx(figures["held_out_score"] - figures["in_suite_score"])
    for part in ("held_out", "in_suite"):
        scores = [(match["wins"] + match["draws"] / 2) / match["games"] for match in figures[part]]
        assert figures[f"{part}_score"] == pytest.approx(np.mean(scores))
