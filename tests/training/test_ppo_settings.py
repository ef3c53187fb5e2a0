"""What a run takes from its settings, and what it leaves of an earlier one."""

from __future__ import annotations

import json

import numpy as np
import pytest
import torch

from swarm_pz.errors import CheckpointError
from swarm_pz.training import ppo
from swarm_pz.training.checkpoint import CHECKPOINT
from swarm_pz.training.config import TrainConfig
from swarm_pz.training.ppo import Training, load_all
from swarm_pz.training.vec_env import SwarmVecEnv
from tests.training.test_ppo import TINY, quiet


def test_the_settings_reach_the_algorithm(tmp_path, monkeypatch):
    threads = []
    monkeypatch.setattr(torch, "set_num_threads", threads.append)
    config = TINY.replace(
        epochs=3, gamma=0.5, gae_lambda=0.6, clip_range=0.3, entropy=0.01, learning_rate=0.002, log_std=-0.25,
        threads=3, width=16, seed=7,
    )  # fmt: skip
    model = Training(config, tmp_path, say=quiet).model
    assert (model.n_steps, model.batch_size, model.n_epochs) == (config.rollout, config.batch_size, 3)
    assert (model.gamma, model.gae_lambda, model.clip_range(1.0), model.ent_coef) == (0.5, 0.6, 0.3, 0.01)
    assert (model.seed, model.n_envs, model.policy.width, threads) == (7, config.num_envs, 16, [3])
    assert model.policy.log_std.tolist() == [-0.25] * 25
    assert not model.policy.log_std.requires_grad  # it follows the schedule alone


def test_the_learning_rate_falls_with_the_steps_to_a_twentieth(tmp_path):
    model = Training(TINY.replace(total_steps=1000, learning_rate=0.5), tmp_path, say=quiet).model
    for steps, rate in ((0, 0.5), (250, 0.375), (900, 0.05), (960, 0.025), (5000, 0.025)):
        model.num_timesteps = steps
        assert model.lr_schedule(1.0) == pytest.approx(rate)


def test_a_minibatch_is_no_larger_than_what_a_rollout_gathers(tmp_path):
    model = Training(TINY.replace(batch_size=1000), tmp_path, say=quiet).model
    assert model.batch_size == TINY.rollout * TINY.num_envs == 32


def test_the_settings_reach_the_games_of_every_size(tmp_path, monkeypatch):
    made, loaded, load = [], [], ppo.load

    class Noted(SwarmVecEnv):
        def __init__(self, game, num_envs, *, opponent, **given):
            made.append((game, num_envs, given))
            self.met = opponent
            super().__init__(game, num_envs, opponent=opponent, **given)

    def noted(name, game, system):
        loaded.append((name, game))
        return load(name, game, system)

    monkeypatch.setattr(ppo, "SwarmVecEnv", Noted)
    monkeypatch.setattr(ppo, "load", noted)
    config = TINY.replace(sizes=(1, 3), action_cells=2, threads=2, opponents=("noise", "ring", "noise"), seed=5)
    run = Training(config, tmp_path, say=quiet)
    games = [config.game.replace(drones_per_team=size) for size in (1, 3)]
    assert made == [(game, 2, {"action_cells": 2, "threads": 2, "seed": 5}) for game in games]
    assert loaded[-4:] == [(name, game) for game in games for name in ("noise", "ring")]
    first, second = (part.met for part in run.env.venv.parts)
    for met in (first, second):
        assert [player.name for player in met] == ["noise", "ring", "noise"] and met[0] is met[2]
    assert first[0] is not second[0]
    run.env.close()


def test_policies_of_equal_names_are_one_object():
    one, other, again = load_all(("noise", "ring", "noise"), TINY.game)
    assert one is again and (one.name, other.name) == ("noise", "ring")


def test_a_fresh_run_replaces_all_that_an_earlier_one_left_and_nothing_else(tmp_path):
    old = (CHECKPOINT, "history.json", "policy.safetensors", "policy.json", "notes.txt", "config.json")
    (tmp_path / "tensorboard").mkdir()
    (tmp_path / "tensorboard" / "events").touch()
    for name in old:
        (tmp_path / name).write_text("old")
    with pytest.raises(CheckpointError, match="--overwrite"):
        Training(TINY, tmp_path, say=quiet)
    assert all((tmp_path / name).read_text() == "old" for name in old)
    Training(TINY.replace(seed=5), tmp_path, overwrite=True, say=quiet)
    assert {path.name for path in tmp_path.iterdir()} == {CHECKPOINT, "history.json", "config.json", "notes.txt"}
    assert (tmp_path / "notes.txt").read_text() == "old"
    assert TrainConfig.from_dict(json.loads((tmp_path / "config.json").read_text())) == TINY.replace(seed=5)
    assert json.loads((tmp_path / "history.json").read_text())["records"] == []


def test_a_run_may_go_on_longer_with_other_threads_and_told_of_more_or_less_often(tmp_path):
    Training(TINY, tmp_path, say=quiet)
    told = {"evaluate_every": 7, "checkpoint_every": 9}
    Training(TINY.replace(total_steps=96, threads=2, **told), tmp_path, resume=True, say=quiet)
    for changes in ({"seed": 1}, {"opponents": ("ring",)}, {"evaluation_games": 4}):
        with pytest.raises(CheckpointError, match="belongs to another configuration"):
            Training(TINY.replace(**changes), tmp_path, resume=True, say=quiet)


def test_the_untrained_tactic_is_the_one_that_a_run_of_this_seed_began_with(tmp_path):
    run = Training(TINY, tmp_path / "run", say=quiet)
    began = run.policy().weights()
    run.learn(32)
    untrained = run.untrained()
    assert (untrained.name, run.policy().name) == ("untrained", "run")
    assert (untrained.card["steps"], untrained.card["width"]) == (32, TINY.width)
    for name, values in untrained.weights().items():
        np.testing.assert_array_equal(values, began[name])
    other = Training(TINY.replace(seed=1), tmp_path / "other", say=quiet).untrained().weights()
    for found in (other, run.policy().weights()):
        assert any(not np.array_equal(values, began[name]) for name, values in found.items())
