"""Small runs, and functions that compare them."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import Stopped
from swarm_pz.training.config import LeagueConfig, TrainConfig

TINY = TrainConfig(
    game=GameConfig(observation=ObservationConfig(grid=10), drones_per_team=2, time_limit=5.0),
    total_steps=64,
    num_envs=4,
    rollout=8,
    batch_size=16,
    epochs=1,
    learning_rate=5e-4,
    width=8,
    evaluate_every=32,
    evaluation_games=2,
    checkpoint_every=32,
    threads=1,
)
LEARNER = TINY.replace(total_steps=128, evaluate_every=10_000)
LEAGUE = LeagueConfig(
    learner=LEARNER,
    scripts=("uniform", "ring"),
    seats=4,
    cycle=32,
    snapshot_every=64,
    exploiter_every=64,
    exploiter_steps=32,
    pattern_share=0.0,
)


def quiet(line: str) -> None:
    """Drop a line of progress."""


def assert_same_weights(one, other):
    ours, theirs = one.weights(), other.weights()
    assert ours.keys() == theirs.keys()
    for name, values in ours.items():
        np.testing.assert_array_equal(values, theirs[name], err_msg=name)


def have_same_weights(one, other):
    return all(bool((values == other.weights()[name]).all()) for name, values in one.weights().items())


def stop(run, questions):
    """Run, and stop when the run asks for the `questions`-th time whether to stop."""
    count = itertools.count(1)
    with pytest.raises(Stopped):
        run.run(lambda: next(count) >= questions)
