"""A stopped run continues from its checkpoint, with its weights, optimiser and history, on new games."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from swarm_pz.training.checkpoint import CHECKPOINT, read
from swarm_pz.training.ppo import Training
from swarm_pz.training.vec_env import SwarmVecEnv
from tests.training.runs import TINY, assert_same_weights, have_same_weights, quiet, stop

RUN = TINY.replace(opponents=("noise", "blind_ring"), total_steps=160, epochs=2, evaluate_every=64, checkpoint_every=64)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    run = Training(RUN, tmp_path_factory.mktemp("runs") / "whole", say=quiet)
    run.run()
    return run


def optimizer_of(run):
    state = run.model.policy.optimizer.state_dict()["state"]
    return [state[number][name] for number in sorted(state) for name in sorted(state[number])]


def test_a_resumed_run_has_the_learner_and_the_history_of_its_checkpoint(tmp_path):
    run = Training(RUN, tmp_path, say=quiet)
    stop(run, 3)
    resumed = Training(RUN, tmp_path, say=quiet)
    assert_same_weights(resumed.policy(), run.policy())
    assert all(map(torch.equal, optimizer_of(resumed), optimizer_of(run))) and optimizer_of(run)
    assert (resumed.model.num_timesteps, resumed.model._n_updates) == (64, run.model._n_updates)
    assert (resumed.state.records, resumed.state.recent, resumed.state.seconds) == (
        run.state.records, run.state.recent, run.state.seconds
    )  # fmt: skip
    assert resumed.model.lr_schedule(1.0) == run.model.lr_schedule(1.0)
    resumed.run()
    assert [record["step"] for record in resumed.state.records] == [0, 64, 128, 160]
    assert not have_same_weights(resumed.policy(), run.policy()) and resumed.is_finished


def test_a_killed_run_goes_on_from_its_last_checkpoint(tmp_path):
    def kill():
        if run.model.num_timesteps == 96:
            raise KeyboardInterrupt
        return False

    run = Training(RUN, tmp_path, say=quiet)
    with pytest.raises(KeyboardInterrupt):
        run.run(kill)
    assert read(tmp_path / CHECKPOINT)[0]["learner"]["steps"] == 64
    run = Training(RUN, tmp_path, say=quiet)
    run.run()
    assert run.model.num_timesteps == 160


def test_a_resumed_run_plays_other_games_than_it_has_played_and_the_same_ones_whenever_it_is_resumed(
    tmp_path, monkeypatch
):
    begun, restart = [], SwarmVecEnv._restart

    def noted(env, rows):
        restart(env, rows)
        begun.append(env.duel.batch.simulator.positions[rows].tobytes())

    monkeypatch.setattr(SwarmVecEnv, "_restart", noted)
    stop(Training(RUN, tmp_path, say=quiet), 3)
    games = [begun.copy()]
    for _ in range(2):
        begun.clear()
        Training(RUN, tmp_path, say=quiet).learn(96)
        games.append(begun.copy())
    assert games[1] == games[2] and not set(games[0]) & set(games[1])


def test_evaluations_checkpoints_and_what_else_the_process_draws_change_nothing_in_a_run(uninterrupted, tmp_path):
    run = Training(RUN.replace(evaluate_every=1000, checkpoint_every=16), tmp_path, say=quiet)
    np.random.normal()  # noqa: NPY002
    torch.rand(3)
    assert_same_weights(run.run(), uninterrupted.policy())
