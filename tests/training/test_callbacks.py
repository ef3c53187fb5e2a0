from __future__ import annotations

import itertools
import math
from types import SimpleNamespace

import numpy as np
import pytest
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger

from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.evaluation.match import play_match
from swarm_pz.training import callbacks
from swarm_pz.training.callbacks import Account, RunState, _mean_reward
from swarm_pz.training.ppo import Training
from tests.training.runs import TINY, quiet


class Watch(BaseCallback):
    """Records the weights and the exploration as each rollout begins."""

    def __init__(self):
        super().__init__()
        self.actor, self.critic, self.explored = [], [], []

    def _on_rollout_start(self):
        policy = self.model.policy
        self.explored.append((self.num_timesteps, float(policy.log_std.mean())))
        for weights, network in ((self.actor, policy.actor), (self.critic, policy.mlp_extractor.critic)):
            weights.append(np.concatenate([values.detach().numpy().ravel() for values in network.parameters()]))

    def _on_step(self):
        return True


def moves(weights):
    return [not np.array_equal(before, after) for before, after in itertools.pairwise(weights)]


def test_exploration_fades_and_the_actor_is_held_while_the_critic_learns_first(tmp_path):
    config = TINY.replace(critic_steps=64, total_steps=160, log_std=-0.5, final_log_std=-2.5)
    run, watch = Training(config, tmp_path, say=quiet), Watch()
    run.learn(160, watch)
    assert [step for step, _ in watch.explored] == [0, 32, 64, 96, 128]
    assert [spread for _, spread in watch.explored] == pytest.approx([-0.5, -0.9, -1.3, -1.7, -2.1])
    assert run.state.exploration(160) == pytest.approx(math.exp(-2.5))
    assert moves(watch.actor) == [False, False, True, True] and moves(watch.critic) == [True] * 4


class Model(SimpleNamespace):
    """A fake learner with the attributes that callbacks use."""

    def __init__(self):
        super().__init__(num_timesteps=0, logger=Logger(None, []))


@pytest.fixture
def clock(monkeypatch):
    now = SimpleNamespace(seconds=1000.0, monotonic=lambda: now.seconds)
    monkeypatch.setattr(callbacks, "time", now)
    return now


def begin(callback, step=0):
    callback.init_callback(Model())
    callback.model.num_timesteps = step
    callback.on_training_start({}, {})
    return callback


def test_running_figures_are_of_the_latest_256_games_and_the_time_of_all_sittings(clock):
    state = RunState(TINY, seconds=100.0)
    assert state.training_means() == (0.0, 0.0)
    account = begin(Account(state))
    clock.seconds += 7.0
    games = [{"outcome": -1, "share": 0.0}] * 300 + [{"outcome": 0, "share": 0.75}] * 192
    account.locals = {"infos": [*games, {}, *[{"outcome": 1, "share": 1.0}] * 64]}
    assert account.on_step()
    assert state.seconds == 107.0
    assert state.training_means() == pytest.approx((0.25, (192 * 0.75 + 64) / 256))  # a draw is not won
    assert state.exploration(10**6) == pytest.approx(math.exp(TINY.final_log_std))


def test_the_mean_reward_of_an_evaluation_is_what_the_environment_has_paid(monkeypatch):
    """For the other side, or without the outcome, it could not be compared with rollout/ep_rew_mean."""
    paid, step = [], BatchEnv.step

    def noted(env, *given):
        paid.append((result := step(env, *given)).rewards.copy())
        return result

    monkeypatch.setattr(BatchEnv, "step", noted)
    game = TINY.game.replace(drones_per_team=(2, 3), time_limit=40.0)
    match = play_match("ring", "centre", games=6, config=game)
    total = sum(paid)
    expected = [total[row, row % 2] for row in range(6)]
    assert len({one.outcome for one in match.games}) > 1
    assert _mean_reward(match) == pytest.approx(sum(expected) / 6)
