from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.policies import held_out, zoo
from swarm_pz.policies.held_out import SUITE, play_suites
from swarm_pz.policies.scripted import SCRIPTS, TRAITS, View
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


def view_of(steps, drone=(20, 6)):
    """Return what is seen of one game a step, with opponents in one cell of 25 x 25, and streams and traits at hand."""
    images = np.zeros((len(steps), 1, 25, 25), np.uint8)
    images[:, 0, drone[1], drone[0]] = 64
    streams = [np.random.default_rng(step) for step in range(len(steps))]
    traits = np.random.default_rng(3).random((len(steps), TRAITS))
    return View(images, ("opposing_positions",), 10, np.array(steps), streams, traits)


def blob(view, game, number, speed, width, x, y):
    """Return a wandering Gaussian at a cell: its formula, written anew."""
    phase_x, phase_y, rate_x, rate_y = view.traits[game, 4 * number : 4 * number + 4]
    square = 0.0
    for at, phase, rate in ((x, phase_x, rate_x), (y, phase_y, rate_y)):
        angle = 2 * math.pi * phase + speed * (0.5 + 0.5 * rate) * view.steps[game]
        square += (at - 0.5 - 0.4 * math.sin(angle)) ** 2
    return math.exp(-square / width**2)


def test_what_moves_or_is_aimed_is_as_its_formula_says():
    view, px, py = view_of([0, 1, 40]), 20.5 / 25, 6.5 / 25
    formulas = {
        held_out.drifting: lambda game, x, y: sum(blob(view, game, one, 0.3, 0.15, x, y) for one in range(3)),
        held_out.clearing: lambda game, x, y: 1 - 0.95 * blob(view, game, 0, 0.2, 0.25, x, y),
        held_out.wide_ring: lambda game, x, y: math.exp(-(((math.hypot(x - px, y - py) - 0.35) / 0.1) ** 2)),
        held_out.crossing: lambda game, x, y: math.exp(-((min(abs(x - px), abs(y - py)) / 0.06) ** 2)),
    }
    cells = (np.arange(10) + 0.5) / 10
    for made, formula in formulas.items():
        expected = [[[formula(game, x, y) for x in cells] for y in cells] for game in range(3)]
        np.testing.assert_allclose(made.play(view), expected, atol=1e-9, err_msg=made.__name__)


@pytest.mark.parametrize(
    ("made", "period"),
    [(held_out.ring_or_halo, 15), (held_out.lasso_or_noise, 10), (held_out.uniform_or_wavefront, 20)],
)
def test_what_takes_turns_plays_the_first_for_a_while_and_then_the_second(made, period):
    scripts = {script.__name__: script for script in SCRIPTS}
    first, second = (scripts[name].play for name in made.__name__.split("_or_"))
    steps = list(range(2 * period + 1))
    is_first = (np.array(steps) % (2 * period) < period)[:, None, None]
    np.testing.assert_array_equal(
        made.play(view_of(steps)), np.where(is_first, first(view_of(steps)), second(view_of(steps)))
    )
