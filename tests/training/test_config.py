from __future__ import annotations

import pytest

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import ConfigError
from swarm_pz.training.config import RECIPES, LeagueConfig, TrainConfig

FRACTION = 1e-9


def test_the_recipe_of_the_benchmarks_exploiters_is_the_one_that_it_was_frozen_with():
    assert RECIPES["long"].hash == "0140694082d6cbb2"


@pytest.mark.parametrize(
    ("name", "low", "high", "step"),
    [
        ("critic_steps", 0, 10**12, 1),
        ("width", 8, 512, 8),
        ("total_steps", 1, 10**12, 1),
        ("num_envs", 1, 65536, 1),
        ("rollout", 2, 65536, 1),
        ("batch_size", 2, 10**7, 1),
        ("epochs", 1, 1000, 1),
        ("learning_rate", 0.0, 1.0, FRACTION),
        ("gamma", 0.0, 1.0, FRACTION),
        ("gae_lambda", 0.0, 1.0, FRACTION),
        ("clip_range", 0.0, 1.0, FRACTION),
        ("entropy", -1.0, 1.0, FRACTION),
        ("log_std", -10.0, 2.0, FRACTION),
        ("final_log_std", -10.0, 2.0, FRACTION),
        ("evaluate_every", 1, 10**12, 1),
        ("evaluation_games", 2, 10**6, 2),
        ("checkpoint_every", 1, 10**12, 1),
        ("seed", 0, 2**32 - 1, 1),
        ("threads", 1, 1024, 1),
    ],
)
def test_settings_of_a_run_have_bounds(name, low, high, step):
    for value in (low, high):
        assert getattr(TrainConfig(**{name: value}), name) == value
    for value in (low - step, high + step, None, "5"):
        with pytest.raises(ConfigError, match=f"^{name} must be"):
            TrainConfig(**{name: value})


@pytest.mark.parametrize(
    ("name", "low", "high", "step"),
    [
        ("seats", 1, 65536, 1),
        ("cycle", 1, 10**12, 1),
        ("hardness", 0.0, 100.0, FRACTION * 100),
        ("floor", 1e-6, 1.0, FRACTION),
        ("script_share", 0.0, 1.0, FRACTION),
        ("snapshot_score", 0.0, 1.0, FRACTION),
        ("snapshot_every", 1, 10**12, 1),
        ("exploiter_every", 1, 10**12, 1),
        ("exploiter_steps", 0, 10**12, 1),
    ],
)
def test_settings_of_a_league_have_bounds(name, low, high, step):
    for value in (low, high):
        assert getattr(LeagueConfig(**{name: value}), name) == value
    for value in (low - step, high + step, None, "5"):
        with pytest.raises(ConfigError, match=f"^{name} must be"):
            LeagueConfig(**{name: value})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"opponents": ()}, "opponents must be at least one policy's name"),
        ({"width": 12}, "width must be a multiple of 8"),
        ({"action_cells": 1}, "action_cells must be a divisor of the observation's grid of 10, at least 2, got 1"),
        ({"action_cells": 2.5}, "action_cells must be a divisor"),
        ({"game": GameConfig(observation=ObservationConfig(grid=2))}, "a divisor of the observation's grid of 2"),
        ({"sizes": (0,)}, "sizes must be a whole number"),
        ({"sizes": (10_001,)}, "sizes must be a whole number"),
        ({"sizes": (5, 10), "num_envs": 5}, "num_envs must be a multiple of 2"),
    ],
)
def test_settings_that_do_not_go_together_are_refused(changes, message):
    with pytest.raises(ConfigError, match=message):
        TrainConfig(**changes)


@pytest.mark.parametrize("name", ["scripts", "rivals"])
def test_a_league_invites_by_names(name):
    with pytest.raises(ConfigError, match=f"{name} must be a tuple of policies' names, got 'ring'"):
        LeagueConfig(**{name: "ring"})
    with pytest.raises(ConfigError, match="learner must be a TrainConfig"):
        LeagueConfig(learner=None)
