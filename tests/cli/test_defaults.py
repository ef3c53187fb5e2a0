"""Presets, recipes and resumed runs change the defaults of a command, and options still win."""

import inspect
import json
from pathlib import Path

import pytest

from swarm_pz.cli import defaults, learn, main
from swarm_pz.config import GameConfig
from swarm_pz.training.config import RECIPES, LeagueConfig, TrainConfig


class EnoughError(Exception):
    """A run has begun."""


@pytest.fixture
def begins(monkeypatch):
    """Return what a training or a league begins with."""

    def begins(words):
        given = []

        def begin(*args, **_):
            given.append(args)
            raise EnoughError

        monkeypatch.setattr("swarm_pz.training.ppo.Training", begin)
        monkeypatch.setattr("swarm_pz.training.selfplay.League", begin)
        with pytest.raises(EnoughError):
            main(words.split())
        return given[0]

    return begins


LONG, RELEASED = RECIPES["long"], GameConfig.preset("released")
SEEN = RELEASED.replace(observation=TrainConfig().game.observation)


@pytest.mark.parametrize(
    ("words", "config", "out"),
    [
        ("train", TrainConfig(), "runs/first"),
        ("train --recipe quick", TrainConfig(), "runs/first"),
        ("train --recipe long --threads 3", LONG.replace(threads=3), "runs/first"),
        ("train --recipe=long --epochs=7", LONG.replace(epochs=7), "runs/first"),
        ("train --preset released --out a", TrainConfig(game=SEEN), "a"),
        ("league", LeagueConfig(), "runs/league"),
    ],
)  # fmt: skip
def test_a_run_begins_with_the_defaults_a_recipe_or_a_preset(words, config, out, begins):
    assert begins(words) == (config, Path(out))


def test_a_preset_is_put_into_the_games_of_configurations_and_a_recipe_leaves_threads():
    league = inspect.signature(defaults.with_preset(learn.league, "released")).parameters["config"].default
    assert league.learner.game == RELEASED.replace(observation=LeagueConfig().learner.game.observation)
    sweep = inspect.signature(defaults.with_recipe(learn.sweep, "long")).parameters["config"].default
    assert sweep == LONG.replace(threads=1)
    assert defaults.take("--preset", ["released"], ["--preset=released", "--pre", "x"]) == ("released", ["--pre", "x"])


def test_a_match_begins_with_the_rules_of_a_preset(monkeypatch):
    played = []
    monkeypatch.setattr("swarm_pz.evaluation.match.play_match", lambda *_, config, **__: played.append(config) or 1 / 0)
    with pytest.raises(ZeroDivisionError):
        main(["evaluate", "ring", "--preset", "released", "--game.time-limit", "5"])
    assert played == [RELEASED.replace(time_limit=5.0)]


OUT = Path("runs/mine")
SHORT = LONG.replace(total_steps=200_000, seed=4, game=TrainConfig().game.replace(time_limit=5.0))


def put(kept):
    OUT.mkdir(parents=True)
    (OUT / "config.json").write_text(kept)


@pytest.mark.parametrize(
    ("words", "kept", "changed"),
    [
        ("train", SHORT, {}),
        ("train --seed 4 --recipe long", SHORT, {}),
        ("train --preset paper --total-steps 300000 --threads 1", SHORT, {"total_steps": 300_000, "threads": 1}),
        ("league --learner.seed 4", LeagueConfig(learner=SHORT, seats=8), {}),
    ],
)
def test_a_resumed_run_has_its_own_settings(words, kept, changed, begins):
    """Without them a run of 200,000 steps trained for 2,400,000 when it was resumed."""
    put(json.dumps(kept.to_dict()))
    assert begins(f"{words} --resume --out {OUT}") == (kept.replace(**changed), OUT)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("--seed 0", "was begun with seed 4, and this line says --seed 0: leave that out"),
        ("--game.time-limit 6", "begun with game.time_limit 5.0, and this line says --game.time-limit 6.0"),
        ("--recipe quick --rollout 8", "begun with rollout 64, and this line says --rollout 8"),
        ("--preset released", "begun with game.spawn.layout 'corners', and this line says --game.spawn.layout"),
    ],
)
def test_options_that_contradict_a_resumed_run_are_named(words, message, capsys):
    put(json.dumps(SHORT.to_dict()))
    with pytest.raises(SystemExit, match="2"):
        main(["train", *words.split(), "--resume", "--out", str(OUT)])
    assert message in capsys.readouterr().err


def test_settings_that_cannot_be_read_are_an_error(capsys):
    put("torn")
    with pytest.raises(SystemExit, match="2"):
        main(["train", "--resume", "--out", str(OUT)])
    assert "cannot be read" in capsys.readouterr().err
