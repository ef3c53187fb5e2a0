from __future__ import annotations

import pytest

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import ConfigError
from swarm_pz.training.config import RECIPES, LeagueConfig, TrainConfig

FRACTION = 1e-9


def test_the_recipe_of_the_benchmarks_exploiters_is_the_one_that_it_was_frozen_with():
    assert RECIPES["long"].hash == "0140694082d6cbb2"


@pytest.mark.parametrize(
    ("made", "names", "low", "high", "step"),
    [
        (TrainConfig, ("total_steps", "evaluate_every", "checkpoint_every"), 1, 10**12, 1),
        (TrainConfig, ("critic_steps",), 0, 10**12, 1),
        (TrainConfig, ("width",), 8, 512, 8),
        (TrainConfig, ("num_envs",), 1, 65536, 1),
        (TrainConfig, ("rollout",), 2, 65536, 1),
        (TrainConfig, ("batch_size",), 2, 10**7, 1),
        (TrainConfig, ("epochs",), 1, 1000, 1),
        (TrainConfig, ("evaluation_games",), 2, 10**6, 2),
        (TrainConfig, ("seed",), 0, 2**32 - 1, 1),
        (TrainConfig, ("threads",), 1, 1024, 1),
        (TrainConfig, ("learning_rate", "gamma", "gae_lambda", "clip_range"), 0.0, 1.0, FRACTION),
        (TrainConfig, ("entropy",), -1.0, 1.0, FRACTION),
        (TrainConfig, ("log_std", "final_log_std"), -10.0, 2.0, FRACTION),
        (LeagueConfig, ("seats",), 1, 65536, 1),
        (LeagueConfig, ("cycle", "snapshot_every", "exploiter_every"), 1, 10**12, 1),
        (LeagueConfig, ("exploiter_steps", "async_delay"), 0, 10**12, 1),
        (LeagueConfig, ("pfsp_exponent",), 0.0, 100.0, FRACTION * 100),
        (LeagueConfig, ("floor",), 1e-6, 1.0, FRACTION),
        (LeagueConfig, ("script_share", "snapshot_score"), 0.0, 1.0, FRACTION),
    ],
)
def test_settings_have_bounds(made, names, low, high, step):
    for name in names:
        for value in (low, high):
            assert getattr(made(**{name: value}), name) == value
        for value in (low - step, high + step, None):
            with pytest.raises(ConfigError, match=f"^{name} must be"):
                made(**{name: value})


@pytest.mark.parametrize(
    ("made", "changes", "message"),
    [
        (TrainConfig, {"opponents": ()}, "at least one policy's name"),
        (TrainConfig, {"opponents": "ring"}, "opponents must be a tuple of policies' names, got 'ring'"),
        (TrainConfig, {"opponents": (1,)}, "opponents must be a tuple"),
        (TrainConfig, {"game": 5}, "game must be"),
        (TrainConfig, {"game": GameConfig(observation=ObservationConfig(kind="entities"))}, "'grids'"),
        (TrainConfig, {"width": 12}, "a multiple of 8"),
        (TrainConfig, {"action_cells": 1}, "a divisor of .* grid of 10, at least 2, got 1"),
        (TrainConfig, {"action_cells": 2.5}, "action_cells must be"),
        (TrainConfig, {"action_cells": 4}, "a divisor of"),
        (TrainConfig, {"evaluation_games": 3}, "even"),
        (TrainConfig, {"sizes": 5}, "sizes must be a tuple"),
        (TrainConfig, {"sizes": (0,)}, "sizes must be a whole number"),
        (TrainConfig, {"sizes": (5, 10), "num_envs": 5}, "num_envs must be a multiple of 2"),
        (TrainConfig, {"learn_rate": 0.1}, "did you mean 'learning_rate'"),
        (LeagueConfig, {"scripts": "ring"}, "scripts must be"),
        (LeagueConfig, {"initial_opponents": "ring"}, "initial_opponents must be"),
        (LeagueConfig, {"learner": None}, "learner must be"),
    ],
)
def test_settings_that_do_not_go_together_are_refused(made, changes, message):
    with pytest.raises(ConfigError, match=message):
        made(**changes)


def test_who_commands_a_system_that_takes_no_densities_sees_drones_whatever_was_asked_for():
    config = TrainConfig(game=GameConfig(controllers="direct"))
    assert config.game.observation == ObservationConfig(kind="drones")
    assert TrainConfig.from_dict(config.to_dict()) == config
