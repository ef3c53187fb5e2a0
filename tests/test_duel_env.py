from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from stable_baselines3.common.env_checker import check_env

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.duel_batch import DuelBatch
from swarm_pz.duel_env import DuelEnv
from swarm_pz.errors import CommandError, ConfigError, GameOverError, PolicyError
from swarm_pz.formats import command_from_action


class Nonsense:
    """An opponent that answers what it is told to."""

    observation = ObservationConfig(grid=10)

    def __init__(self, answer):
        self.answer = answer

    def reset(self, seeds, rows):
        pass

    def act(self, observations, rows):
        return self.answer


def test_sb3_checks_the_log_density_action():
    check_env(DuelEnv())


def test_sb3_checks_the_density_action_with_its_one_recommendation():
    with pytest.warns(UserWarning, match="symmetric"):
        check_env(DuelEnv(action="density"))


def test_gymnasium_makes_it_by_name_and_checks_it():
    environment = gymnasium.make("swarm_pz/Capture-v0", opponent="noise", max_cycles=5)
    environment.reset(seed=0)
    steps, truncated = 0, False
    while not truncated:
        _, _, _, truncated, info = environment.step(environment.action_space.sample())
        steps += 1
    assert steps == 5
    assert info["outcome"] == 0


def test_whole_episodes_are_deterministic():
    def play():
        environment = DuelEnv(opponent="blind_ring", max_cycles=20, observation=ObservationConfig(grid=10))
        seen = [environment.reset(seed=3)[0]]
        generator = np.random.default_rng(0)
        for _ in range(2):
            done = False
            while not done:
                action = generator.uniform(-1, 1, (10, 10)).astype(np.float32)
                observation, _, terminated, truncated, _ = environment.step(action)
                seen.append(observation)
                done = terminated or truncated
            seen.append(environment.reset()[0])
        return np.stack(seen)

    np.testing.assert_array_equal(play(), play())


def test_the_learner_sits_on_either_side():
    duel = DuelBatch(GameConfig(), 32)
    duel.reset(np.random.SeedSequence(0).spawn(32), np.arange(32))
    assert {0, 1} == set(duel.sides.tolist())
    assert DuelEnv(side="blue").reset(seed=0)[1]["side"] == 1


def test_the_learners_reward_is_that_of_its_side():
    duel = DuelBatch(GameConfig(drones_per_team=3), 16)
    duel.reset(np.random.SeedSequence(1).spawn(16), np.arange(16))
    for _ in range(20):
        sizes = duel.batch.simulator.sizes[np.arange(16), duel.sides]
        result = duel.step(np.zeros((16, 10, 10)))
        change = duel.batch.simulator.sizes[np.arange(16), duel.sides] - sizes
        outcome = np.where(result.terminated, np.sign(duel.batch.simulator.sizes[np.arange(16), duel.sides] - 0.5), 0)
        np.testing.assert_allclose(result.rewards, change / 3 + outcome)
        if not duel.batch.running.any():
            break


def test_opponents_are_dealt_in_turn_and_see_their_own_grids():
    duel = DuelBatch(GameConfig(), 5, opponent=["uniform", "ring"])
    duel.reset(np.random.SeedSequence(0).spawn(5), np.arange(5))
    duel.step(np.zeros((5, 10, 10)))
    targets = duel.batch.simulator.targets[np.arange(5), 1 - duel.sides]
    assert [bool(np.ptp(target) < 1e-12) for target in targets] == [True, False, True, False, True]


def test_log_densities_become_a_softmax_and_coarse_actions_are_interpolated():
    np.testing.assert_allclose(command_from_action(np.zeros((2, 5, 5)), 10, is_log=True), 1.0)
    actions = np.random.default_rng(0).uniform(-1, 1, (3, 10, 10))
    commands = command_from_action(actions, 10, is_log=True)
    np.testing.assert_allclose(np.log(commands[0, 0, 0] / commands[0, 5, 5]), 4 * (actions[0, 0, 0] - actions[0, 5, 5]))
    assert commands.max() == 1.0
    ramp = np.broadcast_to(np.linspace(0, 1, 5), (1, 5, 5))
    assert np.diff(command_from_action(ramp, 10, is_log=False)[0, 3]).min() >= 0


@pytest.mark.parametrize(
    "bad", [np.full((10, 10), np.nan), np.full((10, 10), 1.5), np.full((10, 10), -1.5), np.zeros((5, 5)), "up", None]
)
def test_bad_actions_are_refused_and_leave_the_game_as_it_was(bad):
    environment = DuelEnv()
    environment.reset(seed=0)
    before = environment.duel.batch.simulator.snapshot()
    with pytest.raises(CommandError, match=r"actions must be numbers in \[-1, 1\]"):
        environment.step(bad)
    for array, copied in zip(environment.duel.batch.simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, copied)


@pytest.mark.parametrize(
    "answer", [None, "attack", np.full((1, 10, 10), np.nan), np.ones((10, 10)), -np.ones((1, 10, 10))]
)
def test_an_opponent_that_answers_nonsense_is_named_and_the_game_stays_as_it_was(answer):
    environment = DuelEnv(opponent=Nonsense(answer))
    environment.reset(seed=0)
    before = environment.duel.batch.simulator.snapshot()
    with pytest.raises(PolicyError, match="policy Nonsense's answer must be numbers"):
        environment.step(np.zeros((10, 10)))
    for array, copied in zip(environment.duel.batch.simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, copied)


def test_unknown_options_are_refused():
    with pytest.raises(PolicyError, match="did you mean 'uniform'"):
        DuelEnv(opponent="unifrom")
    with pytest.raises(PolicyError, match="must have reset, and observation and act or else plan"):
        DuelEnv(opponent=42)
    with pytest.raises(ConfigError, match="side"):
        DuelEnv(side="green")
    with pytest.raises(ConfigError, match="action"):
        DuelEnv(action="logits")
    with pytest.raises(ConfigError, match="action_cells"):
        DuelEnv(action_cells=20)
    with pytest.raises(ConfigError, match="a sequence of these, got none"):
        DuelBatch(GameConfig(), 2, opponent=[])


def test_a_step_after_the_end_is_refused():
    environment = DuelEnv(max_cycles=1)
    environment.reset(seed=0)
    environment.step(np.zeros((10, 10)))
    with pytest.raises(GameOverError, match="call reset"):
        environment.step(np.zeros((10, 10)))


def test_the_vector_face_restarts_games_at_the_next_step():
    environments = gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=3, max_cycles=2, opponent=["noise", "ring"])
    observations, infos = environments.reset(seed=7)
    assert environments.observation_space.contains(observations)
    assert infos["_side"].all()
    action = np.zeros((3, 10, 10), np.float32)
    *_, truncated, _ = environments.step(action)
    assert not truncated.any()
    *_, truncated, infos = environments.step(action)
    assert truncated.all()
    assert infos["outcome"].tolist() == [0] * 3
    observations, rewards, terminated, truncated, infos = environments.step(action)
    assert not (rewards.any() or terminated.any() or truncated.any())
    assert environments.unwrapped.duel.batch.running.all()
    environments.close()


def test_the_vector_face_plays_the_same_games_as_the_single_one():
    environments = gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=3, opponent="noise", drones_per_team=3)
    single = DuelEnv(opponent="noise", drones_per_team=3)
    together, _ = environments.reset(seed=5)
    alone, _ = single.reset(seed=7)
    np.testing.assert_array_equal(together[2], alone)
    for _ in range(6):
        action = np.random.default_rng(0).uniform(-1, 1, (10, 10)).astype(np.float32)
        together, *_ = environments.step(np.stack([action] * 3))
        alone, _, terminated, *_ = single.step(action)
        np.testing.assert_array_equal(together[2], alone)
        if terminated:
            break
