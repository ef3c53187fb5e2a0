"""A run that is stopped and taken up is the run that never stopped, bit for bit."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
import torch

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import Stopped
from swarm_pz.training.checkpoint import CHECKPOINT, read, read_story, write
from swarm_pz.training.config import LeagueConfig, TrainConfig
from swarm_pz.training.ppo import HISTORY, Training
from swarm_pz.training.selfplay import STATE, League

RUN = TrainConfig(
    game=GameConfig(observation=ObservationConfig(grid=10), drones_per_team=2, time_limit=11.0),
    opponents=("noise", "blind_ring", "ring", "uniform"),
    total_steps=160,
    num_envs=4,
    rollout=8,
    batch_size=16,
    epochs=2,
    width=8,
    evaluate_every=64,
    evaluation_games=2,
    checkpoint_every=64,
    threads=1,
)


def quiet(line: str) -> None:
    """Drop a line of progress."""


def after(questions):
    """Ask to stop when that has been asked so often."""
    count = itertools.count(1)
    return lambda: next(count) >= questions


def stop(run, questions):
    with pytest.raises(Stopped):
        run.run(after(questions))


def records(run):
    return [{name: value for name, value in record.items() if name != "seconds"} for record in run.history.records]


def assert_same_run(one, two):
    """Compare all that a checkpoint holds, but for what the clock said."""
    story, arrays = read(one.folder / CHECKPOINT)
    other_story, other_arrays = read(two.folder / CHECKPOINT)
    assert arrays.keys() == other_arrays.keys()
    for name, values in arrays.items():
        np.testing.assert_array_equal(values, other_arrays[name], err_msg=name)
    for told in (story, other_story):
        told.pop("history")
        told["learner"]["episodes"] = [[episode["r"], episode["l"]] for episode in told["learner"]["episodes"]]
    assert story == other_story
    assert records(one) == records(two)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    run = Training(RUN, tmp_path_factory.mktemp("runs") / "whole", say=quiet)
    run.run()
    return run


@pytest.mark.parametrize("stops", [[1], [2], [3, 1], [4]])
def test_a_resumed_run_is_the_uninterrupted_run(uninterrupted, tmp_path, stops):
    lines = []
    run = Training(RUN, tmp_path, say=quiet)
    for questions in stops:
        stop(run, questions)
        np.random.default_rng()
        torch.rand(3)  # what else the process draws is nobody's business
        run = Training(RUN, tmp_path, resume=True, say=lines.append)
    run.untrained()
    run.run()
    assert_same_run(run, uninterrupted)
    assert not [line for line in lines if "never stopped" in line]


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
    run = Training(config, tmp_path / "stopped", say=quiet)
    stop(run, 2)
    run = Training(config, tmp_path / "stopped", resume=True, say=quiet)
    run.run()
    assert_same_run(run, whole)


def test_evaluations_and_checkpoints_change_nothing_in_a_run(uninterrupted, tmp_path):
    run = Training(RUN.replace(evaluate_every=1000, checkpoint_every=16), tmp_path, say=quiet)
    run.run()
    for name, values in run.policy().weights().items():
        np.testing.assert_array_equal(values, uninterrupted.policy().weights()[name])


def test_games_that_come_out_differently_are_told_of(tmp_path):
    run = Training(RUN, tmp_path, say=quiet)
    stop(run, 2)
    story, arrays = read(tmp_path / CHECKPOINT)
    arrays["games.actions"][-1] *= -1.0  # as another processor's rounding would
    write(tmp_path / CHECKPOINT, story, arrays)
    lines = []
    Training(RUN, tmp_path, resume=True, say=lines.append).run()
    assert any("is not the one that never stopped" in line for line in lines)


def test_a_longer_run_is_said_to_be_another(uninterrupted, tmp_path):
    stop(Training(RUN, tmp_path, say=quiet), 2)
    lines = []
    Training(RUN.replace(total_steps=320), tmp_path, resume=True, say=lines.append)
    assert "was to have 160 steps" in lines[1]


def test_a_checkpoint_that_is_being_written_is_not_seen(tmp_path, monkeypatch):
    path, write_bytes = tmp_path / CHECKPOINT, Path.write_bytes
    write(path, {"told": 1}, {"numbers": np.zeros(2)})

    def killed(file, content):
        write_bytes(file, content[: len(content) // 2])
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "write_bytes", killed)
    with pytest.raises(KeyboardInterrupt):
        write(path, {"told": 2}, {"numbers": np.ones(2)})
    story, arrays = read(path)
    assert story["told"] == 1 and not arrays["numbers"].any()
    assert [file.name for file in tmp_path.iterdir()] == [CHECKPOINT]


def test_a_checkpoint_holds_no_code_and_everybody_may_read_what_is_written(uninterrupted):
    assert not list(uninterrupted.folder.rglob("*.p[tk]*"))
    written = [path for path in uninterrupted.folder.iterdir() if path.is_file()]
    assert {path.name for path in written} >= {CHECKPOINT, HISTORY, "config.json", "policy.safetensors", "policy.json"}
    plain = uninterrupted.folder / "plain"
    plain.touch()
    for path in written:
        assert path.stat().st_mode == plain.stat().st_mode, path


LEAGUE = LeagueConfig(
    learner=RUN.replace(total_steps=256, evaluate_every=10_000),
    scripts=("noise", "blind_ring"),
    seats=3,
    cycle=64,
    snapshot_every=64,
    exploiter_every=128,
    exploiter_steps=64,
)


@pytest.fixture(scope="module")
def whole_league(tmp_path_factory):
    league = League(LEAGUE, tmp_path_factory.mktemp("leagues") / "whole", say=quiet)
    league.run()
    return league


@pytest.mark.parametrize("stops", [[2, 7], [9, 2]])
def test_a_resumed_league_is_the_uninterrupted_league(whole_league, tmp_path, stops):
    league = League(LEAGUE, tmp_path, say=quiet)
    early = (tmp_path / STATE).read_text()
    for questions in stops:
        stop(league, questions)
        (tmp_path / STATE).write_text(early)  # as if it had been killed between writing the one file and the other
        league = League(LEAGUE, tmp_path, resume=True, say=quiet)
    league.run()
    assert league.pool == whole_league.pool
    assert_same_run(league.main, whole_league.main)
