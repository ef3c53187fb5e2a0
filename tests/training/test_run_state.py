from __future__ import annotations

import math

import pytest

from swarm_pz.training.config import TrainConfig
from swarm_pz.training.run_state import History, RunState


def test_exploration_falls_with_the_steps_and_not_below_its_end():
    state = RunState(TrainConfig(total_steps=1000, log_std=-0.5, final_log_std=-2.5))
    for steps, log_std in ((0, -0.5), (500, -1.5), (1000, -2.5), (5000, -2.5)):
        assert state.exploration(steps) == pytest.approx(math.exp(log_std))


def test_running_figures_are_of_the_latest_256_games_and_nothing_before_the_first():
    state = RunState(TrainConfig())
    assert (state.training_win_rate(), state.training_share()) == (0.0, 0.0)
    state.recent.extend([(False, 0.0)] * 1000 + [(True, 0.75)] * 64 + [(False, 0.25)] * 192)
    assert state.training_win_rate() == pytest.approx(0.25)
    assert state.training_share() == pytest.approx((64 * 0.75 + 192 * 0.25) / 256)


def test_a_history_is_read_as_it_was_written():
    history = History(records=[{"step": 5, "share": 0.5}, {"step": 9, "share": 0.25}], seconds=1.5)
    assert History.from_json(history.to_json()) == history
