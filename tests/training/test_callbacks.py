from __future__ import annotations

import itertools
from types import SimpleNamespace

import numpy as np
import pytest
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.logger import Logger

from swarm_pz.errors import Stopped
from swarm_pz.training import callbacks
from swarm_pz.training.callbacks import Account, Checkpoint, PeriodicEvaluation, Progress
from swarm_pz.training.ppo import Training
from swarm_pz.training.run_state import RunState
from tests.training.test_ppo import TINY, quiet


class Weights(BaseCallback):
    """Keeps the weights of the actor and of the critic as each rollout begins."""

    def __init__(self):
        super().__init__()
        self.steps, self.actor, self.critic = [], [], []

    def _on_rollout_start(self):
        policy = self.model.policy
        self.steps.append(self.num_timesteps)
        for seen, network in ((self.actor, policy.actor), (self.critic, policy.mlp_extractor.critic)):
            seen.append(np.concatenate([values.detach().numpy().ravel() for values in network.parameters()]))

    def _on_step(self):
        return True


def moves(seen):
    return [not np.array_equal(before, after) for before, after in itertools.pairwise(seen)]


def test_while_the_critic_learns_first_the_actor_is_held_and_then_it_learns_too(tmp_path):
    run = Training(TINY.replace(critic_steps=64, total_steps=160), tmp_path, say=quiet)
    weights = Weights()
    run.learn(160, weights)
    assert weights.steps == [0, 32, 64, 96, 128]
    assert moves(weights.actor) == [False, False, True, True]
    assert moves(weights.critic) == [True] * 4


class Log(Logger):
    """Keeps what is written down, by step."""

    def __init__(self):
        super().__init__(None, [])
        self.written = {}

    def dump(self, step=0):
        self.written[step] = dict(self.name_to_value)
        super().dump(step)


class Model(SimpleNamespace):
    """Stands in for a learner, so far as callbacks ask it."""

    def __init__(self):
        super().__init__(num_timesteps=0, logger=Log())


@pytest.fixture
def clock(monkeypatch):
    now = SimpleNamespace(seconds=1000.0, monotonic=lambda: now.seconds)
    monkeypatch.setattr(callbacks, "time", now)
    return now


def begin(callback, step=0):
    callback.init_callback(Model())
    return go_to(callback, step)


def go_to(callback, step):
    callback.model.num_timesteps = step
    callback.on_training_start({}, {})
    return callback


def test_the_account_goes_on_with_the_time_spent_and_counts_a_draw_as_not_won(clock):
    state = RunState(TINY)
    state.history.seconds = 100.0
    account = begin(Account(state))
    clock.seconds += 7.0
    account.locals = {
        "infos": [{"outcome": 1, "share": 1.0}, {}, {"outcome": 0, "share": 0.75}, {"outcome": -1, "share": 0.0}]
    }
    assert account.on_step()
    assert state.history.seconds == 107.0
    assert list(state.recent) == [(True, 1.0), (False, 0.75), (False, 0.0)]
    assert state.training_win_rate() == pytest.approx(1 / 3)
    assert state.training_share() == pytest.approx(1.75 / 3)


def test_an_evaluation_is_a_match_of_its_own_against_the_first_opponent_and_is_written_down(monkeypatch):
    played = []
    summary = {
        "win_rate": 0.25, "win_rate_ci95": [0.125, 0.5], "wins": 2, "losses": 3, "games": 8, "mean_share": 0.4375,
    }  # fmt: skip

    def play_match(policy, opponent, **given):
        played.append((policy, opponent.name, given))
        return SimpleNamespace(summary=lambda: summary)

    monkeypatch.setattr(callbacks, "play_match", play_match)
    config = TINY.replace(opponents=("halo", "noise"), evaluation_games=8, seed=5, threads=3, evaluate_every=100)
    state = RunState(config)
    state.history.seconds = 12.34
    state.recent.extend([(True, 0.5), (False, 0.25), (False, 0.0)])
    evaluation = begin(PeriodicEvaluation(state, lambda: "the tactic as it stands"))
    for step in (0, 40, 99, 100, 199, 230, 329, 330):
        go_to(evaluation, step).on_rollout_start()
    settings = {"games": 8, "seed": 1_000_005, "config": config.game, "threads": 3}
    assert played == 4 * [("the tactic as it stands", "halo", settings)]
    assert state.history.records == [
        {
            "step": step,
            "seconds": 12.3,
            "win_rate": 0.25,
            "win_rate_low": 0.125,
            "win_rate_high": 0.5,
            "loss_rate": 3 / 8,
            "share": 0.4375,
            "training_share": 0.25,
        }
        for step in (0, 100, 230, 330)
    ]
    assert evaluation.logger.written[330] == {
        "evaluation/win_rate": 0.25,
        "evaluation/loss_rate": 3 / 8,
        "evaluation/share": 0.4375,
        "train/win_rate": pytest.approx(1 / 3),
        "train/share": 0.25,
    }


def test_a_checkpoint_is_written_every_so_often_and_where_the_run_is_to_stop():
    saved, stops = [], []
    checkpoint = Checkpoint(
        RunState(TINY.replace(checkpoint_every=100)),
        lambda: saved.append(checkpoint.num_timesteps),
        lambda: bool(stops),
        lambda: "so far",
    )
    begin(checkpoint, 50)
    for step in (50, 149, 150, 249, 260, 359, 360):
        checkpoint.model.num_timesteps = step
        checkpoint.on_step()
        checkpoint.on_rollout_start()
    assert saved == [150, 260, 360]
    stops.append("now")
    with pytest.raises(Stopped, match="so far"):
        checkpoint.on_rollout_start()
    assert saved == [150, 260, 360, 360]


def test_progress_tells_every_tenth_how_far_how_fast_and_how_long_it_still_takes(clock):
    state, said = RunState(TINY.replace(total_steps=10_000)), []
    state.recent.extend([(True, 0.5), (False, 0.25)])
    state.history.records.append({"step": 1500, "win_rate": 0.75, "share": 0.625})
    progress = begin(Progress(state, said.append), 2000)
    for step in (2400, 2800, 3200, 3900, 5200, 11_000):
        clock.seconds += 40.0
        progress.model.num_timesteps = step
        progress.on_step()
        progress.on_rollout_end()
    assert [line.split("steps")[0].split() for line in said] == [
        ["24%", "2,400"], ["32%", "3,200"], ["52%", "5,200"], ["100%", "11,000"],
    ]  # fmt: skip
    assert [line.split("steps")[1].split()[:2] for line in said] == [
        ["10/s", "12:40"], ["10/s", "11:20"], ["16/s", "5:00"], ["38/s", "0:00"],
    ]  # fmt: skip
    assert said[0].endswith("exploring: won 50%, share 0.38  evaluated at 1,500: won 75%, share 0.62")


def test_on_a_terminal_progress_stays_in_its_line(clock, capsys, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    state, said = RunState(TINY.replace(total_steps=100)), []
    state.history.records.append({"step": 0, "win_rate": 0.0, "share": 0.0})
    progress = begin(Progress(state, said.append))
    for step in (25, 100):
        clock.seconds += 1.0
        progress.model.num_timesteps = step
        progress.on_step()
        progress.on_rollout_end()
    printed = capsys.readouterr().out
    assert not said
    assert printed.startswith("\r[#####...............]  25%") and "\n\r" not in printed
    assert "\r[####################] 100%" in printed and printed.count("\n") == 1 and printed.endswith("\n")
