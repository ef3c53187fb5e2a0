"""Every preset plays whole games, with both of the paper's controllers."""

from __future__ import annotations

import pytest

from swarm_pz import GameConfig, parallel_env
from swarm_pz.config import PRESETS


@pytest.fixture(params=["ergodic", "flocking", ("ergodic", "flocking")], ids=str)
def controllers(request):
    return request.param


@pytest.mark.parametrize("preset", sorted(PRESETS))
def test_a_game_is_played_to_its_end(preset, controllers):
    config = GameConfig.preset(preset).replace(controllers=controllers, time_limit=3.0, drones_per_team=4)
    environment, steps = parallel_env(config), 0
    assert environment.max_cycles == 3
    environment.reset(seed=0)
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
    assert infos["red_0"]["outcome"] in (1, -1, 0) and 1 <= steps <= 3
