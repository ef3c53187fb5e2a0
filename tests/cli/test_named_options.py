from __future__ import annotations

import inspect

import pytest

from swarm_pz.cli import learn, main, named_options
from swarm_pz.training.config import RECIPES, TrainConfig


def test_a_recipe_is_where_the_settings_of_a_training_begin(monkeypatch):
    class EnoughError(Exception):
        pass

    begun = []

    def begin(config, *args, **options):
        begun.append(config)
        raise EnoughError

    monkeypatch.setattr("swarm_pz.training.ppo.Training", begin)
    for arguments in (
        [],
        ["--recipe", "quick"],
        ["--recipe", "long", "--threads", "3"],
        ["--recipe=long", "--epochs=7"],
    ):
        with pytest.raises(EnoughError):
            main(["train", *arguments])
    long = RECIPES["long"]
    assert begun == [TrainConfig(), TrainConfig(), long.replace(threads=3), long.replace(epochs=7)]
    sweep = named_options.begin_with_recipe(long, learn.sweep)
    assert inspect.signature(sweep).parameters["config"].default == long.replace(threads=1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["evaluate", "ring", "--recipe", "long"], "trains by no recipe"),
        (["train", "--recipe"], "--recipe expects one of quick, long"),
        (["train", "--recipe", "lnog"], "--recipe must be 'quick' or 'long', got 'lnog'"),
    ],
)
def test_a_recipe_that_cannot_be_is_refused(arguments, message, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(arguments)
    assert message in capsys.readouterr().err
