"""A run that is stopped and resumed is bit-identical to one that never stopped."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from swarm_pz.training.checkpoint import CHECKPOINT, read, read_story, write
from swarm_pz.training.ppo import HISTORY, Training
from tests.training.runs import TINY, assert_same_run, assert_same_weights, quiet, stop

RUN = TINY.replace(
    game=TINY.game.replace(time_limit=11.0),
    opponents=("noise", "blind_ring", "ring", "uniform"),
    total_steps=160,
    epochs=2,
    evaluate_every=64,
    checkpoint_every=64,
)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    run = Training(RUN, tmp_path_factory.mktemp("runs") / "whole", say=quiet)
    run.run()
    return run


def test_a_resumed_run_is_the_uninterrupted_run(uninterrupted, tmp_path):
    lines = []
    run = Training(RUN, tmp_path, say=quiet)
    for questions in (3, 1):
        stop(run, questions)
        np.random.default_rng()
        torch.rand(3)  # what else the process draws changes nothing
        run = Training(RUN, tmp_path, resume=True, say=lines.append)
    run.untrained()
    run.run()
    assert_same_run(run, uninterrupted)
    assert not [line for line in lines if "differs" in line]


def test_a_killed_run_goes_on_from_its_last_checkpoint_as_if_it_had_not_been(uninterrupted, tmp_path):
    def kill():
        if run.model.num_timesteps == 96:
            raise KeyboardInterrupt
        return False

    run = Training(RUN, tmp_path, say=quiet)
    with pytest.raises(KeyboardInterrupt):
        run.run(kill)
    assert read_story(tmp_path / CHECKPOINT)["learner"]["steps"] == 64
    run = Training(RUN, tmp_path, resume=True, say=quiet)
    run.run()
    assert_same_run(run, uninterrupted)


def test_a_run_of_several_sizes_goes_on_as_if_it_had_not_stopped(tmp_path):
    config = RUN.replace(sizes=(1, 3), total_steps=96)
    whole = Training(config, tmp_path / "whole", say=quiet)
    whole.run()
    stop(Training(config, tmp_path / "stopped", say=quiet), 2)
    run = Training(config, tmp_path / "stopped", resume=True, say=quiet)
    run.run()
    assert_same_run(run, whole)


def test_evaluations_and_checkpoints_change_nothing_in_a_run(uninterrupted, tmp_path):
    run = Training(RUN.replace(evaluate_every=1000, checkpoint_every=16), tmp_path, say=quiet)
    assert_same_weights(run.run(), uninterrupted.policy())


def test_games_that_come_out_differently_are_told_of(tmp_path):
    stop(Training(RUN, tmp_path, say=quiet), 2)
    story, arrays = read(tmp_path / CHECKPOINT)
    arrays["games.actions"][-1] *= -1.0  # as another processor's rounding would
    write(tmp_path / CHECKPOINT, story, arrays)
    lines = []
    stop(Training(RUN, tmp_path, resume=True, say=lines.append), 1)
    assert any("differs" in line for line in lines)


def test_a_checkpoint_holds_no_code_and_everybody_may_read_what_is_written(uninterrupted):
    assert not list(uninterrupted.folder.rglob("*.p[tk]*"))
    written = [path for path in uninterrupted.folder.iterdir() if path.is_file()]
    assert {path.name for path in written} >= {CHECKPOINT, HISTORY, "config.json", "policy.safetensors", "policy.json"}
    plain = uninterrupted.folder / "plain"
    plain.touch()
    for path in written:
        assert path.stat().st_mode == plain.stat().st_mode, path
