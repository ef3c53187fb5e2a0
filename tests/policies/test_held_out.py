from __future__ import annotations

import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.policies import held_out, zoo
from swarm_pz.policies.held_out import SUITE, play_suites
from swarm_pz.policies.scripted import SCRIPTS, TRAITS, View
from tests.elsewhere import Elsewhere


@pytest.mark.parametrize("trial", SUITE, ids=lambda trial: trial.name)
def test_every_opponent_of_the_suite_plays_and_moves_on(trial):
    assert trial.opponent.__name__ not in policies.names() or trial.drones_per_team is not None
    config = GameConfig(drones_per_team=trial.drones_per_team or 10)
    batch = BatchEnv(config, 2)
    batch.reset([0, 1])
    player = trial.opponent(config)
    player.reset([3, 4], np.arange(2))
    answers = []
    for _ in range(25):
        rows = np.flatnonzero(batch.running)
        commands = np.ones((2, 2, 10, 10))
        commands[rows, 0] = batch.ask(player, np.zeros_like(rows), rows)
        batch.step(commands)
        answers.append(commands[0, 0])
    if trial.opponent.__name__ not in ("uniform", "halo"):
        assert not np.array_equal(answers[0], answers[-1])


def test_scores_are_means_over_the_suites_whoever_plays_them(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    shutil.copytree(Path(zoo.__file__).parent / "champion", tmp_path / "mine")
    config = GameConfig(drones_per_team=2, time_limit=2.0)
    suites = play_suites("mine", config, games=2)
    there = Elsewhere(tmp_path / "there")
    assert _without_times(play_suites("mine", config, games=2, pool=there)) == _without_times(suites)
    assert there.given == ["play_trial"] * (len(SCRIPTS) + len(SUITE))
    figures = suites.to_dict()
    assert len(figures["in_suite"]) == len(SCRIPTS)
    assert [entry["opponent"] for entry in figures["held_out"]] == [trial.name for trial in SUITE]
    assert figures["generalisation"] == pytest.approx(figures["held_out_score"] - figures["in_suite_score"])
    scores = [(m["wins"] + m["draws"] / 2) / m["games"] for m in figures["held_out"]]
    assert figures["held_out_score"] == pytest.approx(np.mean(scores))
    known = [(m["wins"] + m["draws"] / 2) / m["games"] for m in figures["in_suite"]]
    assert figures["in_suite_score"] == pytest.approx(np.mean(known))


def test_the_suite_is_the_one_that_published_scores_are_of():
    assert [trial.name for trial in SUITE] == [
        "drifting", "clearing", "wide_ring", "crossing", "ring_or_halo", "lasso_or_noise", "uniform_or_wavefront",
        "uniform, 5 a team", "uniform, 20 a team", "ring, 7 a team", "halo, 15 a team",
    ]  # fmt: skip


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
    answers = {
        made: made.play(view) for made in (held_out.drifting, held_out.clearing, held_out.wide_ring, held_out.crossing)
    }
    for game in range(3):
        for row in range(10):
            for column in range(10):
                x, y = (column + 0.5) / 10, (row + 0.5) / 10
                expected = {
                    held_out.drifting: sum(blob(view, game, number, 0.3, 0.15, x, y) for number in range(3)),
                    held_out.clearing: 1 - 0.95 * blob(view, game, 0, 0.2, 0.25, x, y),
                    held_out.wide_ring: math.exp(-(((math.hypot(x - px, y - py) - 0.35) / 0.1) ** 2)),
                    held_out.crossing: math.exp(-((min(abs(x - px), abs(y - py)) / 0.06) ** 2)),
                }
                for made, value in expected.items():
                    assert answers[made][game, row, column] == pytest.approx(value, abs=1e-9), made.__name__


@pytest.mark.parametrize(
    ("made", "period"),
    [(held_out.ring_or_halo, 15), (held_out.lasso_or_noise, 10), (held_out.uniform_or_wavefront, 20)],
)
def test_what_takes_turns_plays_the_first_for_a_while_and_then_the_second(made, period):
    scripts = {script.__name__: script for script in SCRIPTS}
    first, second = (scripts[name] for name in made.__name__.split("_or_"))
    steps = list(range(2 * period + 1))
    expected = np.where(
        (np.array(steps) % (2 * period) < period)[:, None, None],
        first.play(view_of(steps)),
        second.play(view_of(steps)),
    )
    np.testing.assert_array_equal(made.play(view_of(steps)), expected)


def _without_times(suites):
    return [
        (match.policy, match.opponent, match.config, [(game.fingerprint, game.outcome) for game in match.games])
        for match in (*suites.known, *suites.held_out)
    ]


def test_every_match_is_played_with_the_settings_that_were_asked_for(monkeypatch):
    loaded, played, shown = [], [], []
    load = policies.load

    def noted(name, config):
        loaded.append((name, config))
        return load(name, config)

    def play_match(player, opponent, **given):
        played.append((player.name, opponent.name, given))
        return opponent.name

    monkeypatch.setattr(policies, "load", noted)
    monkeypatch.setattr(held_out, "play_match", play_match)
    config = GameConfig(drones_per_team=3, command_cells=6, time_limit=7.0)
    suites = play_suites("ring", config, games=4, seed=7, threads=3, progress=lambda *told: shown.append(told))
    trials = [*[held_out.Trial(script) for script in SCRIPTS], *SUITE]
    rules = [config.replace(drones_per_team=trial.drones_per_team or 3) for trial in trials]
    assert loaded == [("ring", of_match) for of_match in rules]
    assert played == [
        ("ring", trial.name, {"games": 4, "seed": 7, "threads": 3, "config": of_match})
        for trial, of_match in zip(trials, rules, strict=True)
    ]
    assert suites.known == [script.__name__ for script in SCRIPTS]
    assert suites.held_out == [trial.name for trial in SUITE]
    assert shown == [(4 * number, 4 * len(trials)) for number in range(1, len(trials) + 1)]
