"""Every preset plays whole games, with both of the paper's controllers."""

from __future__ import annotations

import numpy as np
import pytest
from pettingzoo.test import parallel_api_test

from swarm_pz import GameConfig, ObservationConfig, parallel_env
from swarm_pz.config import PRESETS
from swarm_pz.training.vec_env import SwarmVecEnv

FLOWN_BY = ["ergodic", "flocking", ("ergodic", "flocking")]


@pytest.fixture(params=sorted(PRESETS))
def preset(request):
    return GameConfig.preset(request.param)


@pytest.fixture(params=FLOWN_BY, ids=str)
def config(request, preset):
    return preset.replace(controllers=request.param, time_limit=5.0, drones_per_team=4)


def test_a_game_is_played_to_its_end(config):
    environment = parallel_env(config)
    assert environment.max_cycles == 5
    observations, _ = environment.reset(seed=0)
    steps = 0
    for number, agent in enumerate(environment.agents):
        environment.action_space(agent).seed(number)
    while environment.agents:
        actions = {agent: environment.action_space(agent).sample() for agent in environment.agents}
        observations, rewards, _, _, infos = environment.step(actions)
        steps += 1
        assert rewards["red_0"] == -rewards["blue_0"]
        for agent, observation in observations.items():
            assert environment.observation_space(agent).contains(observation)
        assert environment.state_space.contains(environment.state())
    assert infos["red_0"]["outcome"] in (1, -1, 0)
    assert 1 <= steps <= 5


@pytest.mark.parametrize("controllers", FLOWN_BY[1:], ids=str)
def test_conformance_of_the_released_variant(controllers):
    parallel_api_test(
        parallel_env(GameConfig.preset("released"), controllers=controllers, time_limit=30.0), num_cycles=100
    )


def test_learners_play_it(config):
    env = SwarmVecEnv(config.replace(observation=ObservationConfig(grid=10)), 4, opponent="ring", seed=0)
    env.reset()
    env.action_space.seed(0)
    ended = 0
    for _ in range(5):
        observations, rewards, dones, _ = env.step(np.stack([env.action_space.sample() for _ in range(4)]))
        assert env.observation_space.shape == observations.shape[1:]
        assert np.isfinite(rewards).all()
        ended += dones.sum()
    assert ended >= 4
    env.close()
