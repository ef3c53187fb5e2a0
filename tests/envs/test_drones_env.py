"""Drones as agents: PettingZoo's tests, which agents are active, and how rewards add up."""

from __future__ import annotations

import numpy as np
import pytest
from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test
from pettingzoo.utils import parallel_to_aec

from swarm_pz import GameConfig, drones_env
from swarm_pz.config import CaptureConfig
from swarm_pz.envs.drones_batch import DronesBatch
from swarm_pz.errors import CommandError, ConfigError, GameOverError, PolicyError
from tests.envs.test_opponents import Diary

VARIANTS = {
    "discrete": {"drones_per_team": 2, "action": "discrete", "side": "blue"},
    "both": {"drones_per_team": 3, "side": "both"},
    "handicap": {"drones_per_team": (1, 4), "side": "blue", "opponent": "ring", "action_period": 0.1, "neighbours": 2},
}
PEACE = CaptureConfig(enabled=False)


@pytest.mark.parametrize("variant", VARIANTS)
def test_pettingzoos_tests_pass(variant):
    parallel_api_test(drones_env(**VARIANTS[variant]), num_cycles=30)
    parallel_seed_test(lambda: drones_env(**VARIANTS[variant], max_cycles=10))
    api_test(parallel_to_aec(drones_env(**VARIANTS[variant])), num_cycles=10)


def test_it_renders():
    environment = drones_env(render_mode="rgb_array_list", drones_per_team=2, action_period=0.5)
    environment.reset(seed=0)
    environment.render()
    environment.step(choose(environment, np.random.default_rng(0)))
    assert len(environment.render()) == 5
    assert environment.metadata["name"] == "swarm_pz_drones_v0"
    assert environment.state_space.contains(environment.state())


def choose(environment, generator):
    return {agent: generator.uniform(-1, 1, 2).astype(np.float32) for agent in environment.agents}


def test_agents_are_named_after_the_team_that_they_begin_with_and_stay():
    environment = drones_env(drones_per_team=(2, 1), side="blue")
    _, infos = environment.reset(seed=0)
    names = ["red_0_drone_0", "blue_0_drone_0", "blue_0_drone_1"]
    assert environment.possible_agents == environment.agents == names
    assert [infos[name]["flies"] for name in names] == [0, 1, 1]
    assert {infos[name]["side"] for name in names} == {1}
    with pytest.raises(ConfigError, match=r"give side='red' or side='blue', got side='random' .*\(2, 1\)"):
        drones_env(drones_per_team=(2, 1))


@pytest.mark.parametrize("side", ["blue", "both"])
def test_a_captured_drone_pays_for_the_defeat_like_its_team(side):
    """Catches rewards that only active agents get: a drone captured early would not pay for its team's defeat."""
    config = GameConfig(drones_per_team=3, capture=CaptureConfig(threshold=0.5))
    batch, generator = DronesBatch(config, 1, side=side, action_period=1.0), np.random.default_rng(1)
    captured = ends = 0
    for seed in range(4):
        batch.reset([np.random.SeedSequence(seed)], np.array([0]))
        for _ in range(300):
            if not batch.batch.running[0]:
                break
            sides, flew = batch.sides[0], batch.flies[0]
            result = batch.step(generator.uniform(-1, 1, (1, 6, 2)))
            (red, blue), won = result.captured[0], batch.batch.outcome(0, 0) if result.terminated[0] else "draw"
            expected = (red - blue) / 3 + {"win": 1, "draw": 0, "loss": -1}[won]
            assert result.rewards[0] == pytest.approx(np.where(sides == 0, expected, -expected))
            assert side == "both" or len(set(result.rewards[0].tolist())) == 1
            captured += int((flew & ~batch.flies[0]).sum() if side != "both" else (sides != batch.sides[0]).sum())
            ends += int(result.terminated[0])
    assert captured > 3 and ends > 0


def test_who_sits_out_sees_nothing_and_its_action_does_nothing():
    def play(pushes):
        environment = drones_env(drones_per_team=2, side="red")
        sitting = ("blue_0_drone_0", "blue_0_drone_1")
        environment.reset(seed=3)
        for _ in range(5):
            actions = choose(environment, np.random.default_rng(1)) | dict.fromkeys(sitting, pushes)
            observations, *_, infos = environment.step(actions)
            for agent in sitting:
                assert observations[agent][0] == -1 and not observations[agent][1:].any()
                assert infos[agent]["flies"] == 0
        return environment.batch.simulator.positions.copy()

    assert (play(np.ones(2)) == play(np.zeros(2))).all()


def test_an_agent_flies_its_drone_and_the_opponents_system_the_others():
    environment = drones_env(drones_per_team=2, side="blue", capture=PEACE)
    environment.reset(seed=0, options={"positions": np.full((4, 2), 0.5), "velocities": np.zeros((4, 2))})
    push = {"red_0_drone_0": [1, 1], "red_0_drone_1": [1, 1], "blue_0_drone_0": [0.5, 0], "blue_0_drone_1": [0, -1]}
    environment.step(push)
    velocities = environment.batch.simulator.velocities[0]
    assert velocities[2:] == pytest.approx(np.array([[0.1, 0], [0, -0.2]]), abs=1e-6)


def test_the_second_of_the_control_systems_flies_for_the_opponent_on_either_side():
    for side in ("red", "blue"):
        for controllers in ("flocking", ("direct", "flocking")):
            environment = drones_env(side=side, controllers=controllers, drones_per_team=2)
            assert environment.config.team_controllers == ("direct", "flocking")
    with pytest.raises(ConfigError, match=r"flown by 'direct': give controllers=\('direct', other\), got \('ergodic'"):
        drones_env(controllers=("ergodic", "flocking"))


def test_one_who_comes_over_coasts_until_its_agent_has_seen_something():
    batch = DronesBatch(GameConfig(drones_per_team=2), 1, side="red")
    batch.reset([np.random.SeedSequence(0)], np.array([0]))
    batch.step(np.ones((1, 4, 2)))
    assert batch.batch.simulator.games.commands[0, 0, :8].reshape(4, 2).tolist() == [[1, 1], [1, 1], [0, 0], [0, 0]]


def test_an_opponents_command_holds_for_the_command_period():
    diary = Diary()
    environment = drones_env(opponent=diary, drones_per_team=2, command_period=1.0, action_period=0.2)
    environment.reset(seed=0)
    counts = []
    for _ in range(11):
        environment.step(choose(environment, np.random.default_rng(0)))
        counts.append(len(diary.rows))
    assert counts == [1] * 5 + [2] * 5 + [3]


def test_mistakes_are_said_and_change_nothing():
    environment = drones_env(drones_per_team=1, side="red")
    with pytest.raises(GameOverError, match="call reset before step"):
        environment.step({})
    environment.reset(seed=0)
    good = choose(environment, np.random.default_rng(0))
    for actions, message in (
        ({"red_0_drone_0": [0, 0]}, "missing blue_0_drone_0"),
        (good | {"red_0_drone_7": [0, 0]}, "unknown red_0_drone_7"),
        ([[0, 0]], "got list in place of a mapping"),
        (good | {"blue_0_drone_0": [np.nan, 0]}, "blue_0_drone_0's action"),
        (good | {"red_0_drone_0": [1.5, 0]}, "red_0_drone_0's action"),
        (good | {"red_0_drone_0": 3}, "red_0_drone_0's action"),
    ):
        with pytest.raises(CommandError, match=message):
            environment.step(actions)
    assert environment.batch.simulator.time_s[0] == 0.0
    environment.step(good)


def test_options_that_make_no_sense_are_refused():
    for options, message in (
        ({"side": "green"}, "side must be 'random' or 'red' or 'blue' or 'both'"),
        ({"action_period": 0.3}, "a whole part of command_period"),
        ({"action_period": 0.05}, "action_period must be a number in"),
        ({"action_period": 0.15}, "whole number of control periods"),
        ({"side": "both", "opponent": "ring"}, "no opponent"),
        ({"neighbour": 3}, "did you mean 'neighbours'"),
        ({"render_mode": "3d"}, "there is no render mode"),
    ):
        with pytest.raises(ConfigError, match=message):
            drones_env(**options)
    with pytest.raises(PolicyError, match="there is no policy 'rin'"):
        drones_env(opponent="rin")
    drones_env(side="both", action_period=0.3).close()
