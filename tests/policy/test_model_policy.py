from __future__ import annotations

import numpy as np
import pytest
from gymnasium import spaces
from stable_baselines3 import A2C, DQN, PPO

from swarm_pz import GameConfig, ObservationConfig
from swarm_pz.config import CHANNELS
from swarm_pz.envs.gymnasium_env import DuelEnv
from swarm_pz.envs.opponents import DuelBatch
from swarm_pz.errors import PolicyError
from swarm_pz.evaluation.rollout import play_games
from swarm_pz.policy import load
from swarm_pz.policy.model_policy import ModelPolicy
from swarm_pz.spaces.densities import named_commands
from swarm_pz.spaces.formats import Format

GAME = GameConfig(drones_per_team=2, time_limit=3.0)
IMAGES = spaces.Box(0, 255, (9, 50, 50), np.uint8)
LOG = spaces.Box(-1.0, 1.0, (5, 5), np.float32)
LISTS = ObservationConfig(kind="entities")


class Model:
    """Answers everything with the same action, and keeps what it was shown."""

    def __init__(self, observation_space, action_space, action=None, state=None):
        self.observation_space, self.action_space = observation_space, action_space
        self.action, self.state = np.zeros(action_space.shape) if action is None else action, state
        self.shown, self.deterministic = [], []

    def predict(self, observation, deterministic=False):
        self.shown.append(observation)
        self.deterministic.append(deterministic)
        count = len(next(iter(observation.values()))) if isinstance(observation, dict) else len(observation)
        return np.stack([self.action] * count), self.state


@pytest.mark.parametrize(
    ("make", "options", "more"),
    [
        (PPO, {"action_cells": 5}, {"n_steps": 2, "batch_size": 2}),
        (A2C, {"action": "modes"}, {"n_steps": 2}),
        (DQN, {"action": "discrete"}, {"buffer_size": 10}),
    ],
)
def test_a_model_of_sb3_is_an_opponent_as_it_is_whatever_is_played_beside_it(make, options, more):
    observation = ObservationConfig(grid=10, channels=("own_positions", "opposing_positions", "time_left"))
    env = DuelEnv(GAME, observation=observation, **options)
    model = make("MlpPolicy", env, policy_kwargs={"net_arch": [8]}, device="cpu", seed=0, **more)
    game = GAME.replace(observation=observation)
    many = play_games(model, "uniform", range(11), seed=1, config=game)
    assert play_games(model, "uniform", [9], seed=1, config=game) == [many[9]]


def against(model, game=GAME):
    """Play one step against a model; return its target."""
    env = DuelEnv(game, opponent=model)
    env.reset(seed=0)
    env.step(np.zeros((10, 10)))
    return env.duel.batch.simulator.targets[0, 1 - env.duel.sides[0]]


def test_a_model_is_shown_what_it_was_trained_on_and_understood_as_it_was():
    env = DuelEnv(GAME, observation=ObservationConfig(grid=10))
    action = np.random.default_rng(0).uniform(-1, 1, (10, 10)).astype(np.float32)
    model = Model(env.observation_space, env.action_space, action)
    target = against(model)
    assert env.observation_space.contains(model.shown[0][0])
    np.testing.assert_allclose(target / target.max(), np.exp(4 * (action - action.max())), rtol=1e-5)
    lists = DuelEnv(GAME, observation=LISTS)
    model = Model(lists.observation_space, lists.action_space)
    against(model)
    assert set(model.shown[0]) == set(lists.observation_space)


def test_a_model_plays_its_best_action_unless_it_is_to_draw_one_and_may_not_remember():
    model = Model(IMAGES, LOG)
    for policy in (load(model, GAME), ModelPolicy(model, GAME, deterministic=False)):
        policy.act(np.zeros((1, 9, 50, 50), np.uint8), np.arange(1))
    assert model.deterministic == [True, False]
    with pytest.raises(PolicyError, match="has a memory"):
        against(Model(IMAGES, LOG, state=("h", "c")))


@pytest.mark.parametrize(
    ("action_space", "options"),
    [
        (spaces.Box(-1.0, 1.0, (10, 10), np.float32), {}),
        (spaces.Box(-1.0, 1.0, (5, 5), np.float32), {"action_cells": 5}),
        (spaces.Box(0.0, 1.0, (2, 2), np.float32), {"action": "command", "action_cells": 2}),
        (spaces.Box(-2.0, 2.0, (5,), np.float32), {"action": "modes"}),
    ],
)
def test_an_action_is_understood_as_its_space_says(action_space, options):
    action = np.tanh(action_space.sample() ** 2)
    answer = load(Model(IMAGES, action_space, action), GAME).act(np.zeros((1, 9, 50, 50), np.uint8), np.arange(1))
    expected = Format(GAME, ObservationConfig(), **({"action": "normalised"} | options)).read([action], 1)
    np.testing.assert_allclose(answer, expected)


class Counter(Model):
    """Asks for the named density whose number it sees in the first pixel."""

    def predict(self, observation, deterministic=False):
        self.shown.append(observation)
        return observation[:, 0, 0, 0].astype(np.int64), None


@pytest.mark.parametrize("count", [1, 8, 17])
def test_a_model_is_shown_eight_boards_at_once_and_each_gets_its_own_answer(count):
    model = Counter(IMAGES, spaces.Discrete(57))
    boards = np.zeros((count, 9, 50, 50), np.uint8)
    boards[:, 0, 0, 0] = numbers = np.arange(57)[::3][:count]
    answers = load(model, GAME).act(boards, np.arange(count) + 5)
    np.testing.assert_array_equal(answers, named_commands(10)[numbers])
    assert [len(shown) for shown in model.shown] == [8] * -(-count // 8)


def test_what_it_sees_follows_from_what_either_side_of_the_game_sees_or_is_said():
    red = ObservationConfig(grid=25, channels=("own_target",))
    blue = ObservationConfig(channels=("time_left", "own_share"))
    game = GAME.replace(observation=(red, blue))
    for channels, grid in ((("own_target",), 5), (("time_left", "own_share"), 25), (CHANNELS, 10)):
        policy = load(Model(spaces.Box(0, 255, (len(channels), grid, grid), np.uint8), LOG), game)
        assert policy.observation == ObservationConfig(grid=grid, channels=channels)
    assert ModelPolicy(Model(DuelEnv(GAME, observation=LISTS).observation_space, LOG), GAME).observation == LISTS
    one = spaces.Box(0, 255, (1, 50, 50), np.uint8)
    views = tuple(ObservationConfig(channels=(channel,)) for channel in ("own_target", "time_left"))
    duel = DuelBatch(GAME.replace(observation=views), 1, opponent=Model(one, LOG))
    assert duel._dealt[0].player.observation == views[1], "of two sides with as many channels its own"
    with pytest.raises(PolicyError, match=r"ModelPolicy\(model, config, observation\)"):
        load(Model(one, LOG), GAME)
    observation = ObservationConfig(grid=10, channels=("own_share", "time_left"))
    model = Model(spaces.Box(0, 255, (2, 10, 10), np.uint8), LOG)
    ModelPolicy(model, GAME, observation).act(np.full((1, 2, 10, 10), 51, np.uint8), np.arange(1))
    np.testing.assert_array_equal(model.shown[0], np.full((8, 2, 10, 10), 51))


@pytest.mark.parametrize(
    ("observes", "acts", "message"),
    [
        (IMAGES, spaces.Discrete(4), r"got Discrete\(4\)"),
        (IMAGES, spaces.Box(-2, 2, (5, 5)), "actions must be"),
        (IMAGES, spaces.Box(-1, 1, (1, 1)), "with a from 2 to 10"),
        (spaces.Box(0, 255, (9, 10, 10), np.int16), LOG, "must observe images"),
        (spaces.Box(0, 255, (36, 50, 50), np.uint8), LOG, "of 9 channels"),
        (spaces.Box(0, 255, (9, 7, 7), np.uint8), LOG, "divides 50"),
        (spaces.Box(0, 255, (10, 10, 9), np.uint8), LOG, "behind wrappers"),
        (spaces.Box(0, 127, (9, 10, 10), np.uint8), LOG, "would be shown"),
    ],
)
def test_what_does_not_fit_is_named(observes, acts, message):
    with pytest.raises(PolicyError, match=message):
        load(Model(observes, acts), GAME)
