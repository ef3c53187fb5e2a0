from __future__ import annotations

import pytest

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import ConfigError
from swarm_pz.training.config import RECIPES, TrainConfig


def test_the_recipe_of_the_benchmarks_exploiters_is_the_one_that_it_was_frozen_with():
    assert RECIPES["long"].hash == "0140694082d6cbb2"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"opponents": ()}, "at least one policy's name"),
        ({"game": GameConfig(observation=ObservationConfig(kind="entities"))}, "'grids'"),
        ({"sizes": (5, 10), "num_envs": 5}, "num_envs must be a multiple of 2"),
        ({"learn_rate": 0.1}, "did you mean 'learning_rate'"),
    ],
)
def test_settings_that_do_not_go_together_are_refused(changes, message):
    with pytest.raises(ConfigError, match=message):
        TrainConfig(**changes)


def test_who_commands_a_system_that_takes_no_densities_sees_drones_whatever_was_asked_for():
    config = TrainConfig(game=GameConfig(controllers="direct"))
    assert config.game.observation == ObservationConfig(kind="drones")
    assert TrainConfig.from_dict(config.to_dict()) == config
