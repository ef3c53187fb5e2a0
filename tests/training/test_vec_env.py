from __future__ import annotations

import numpy as np
import pytest
from stable_baselines3.common.vec_env import VecMonitor

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.training.vec_env import StackedVecEnv, SwarmVecEnv

COARSE = GameConfig(observation=ObservationConfig(grid=10), drones_per_team=3)


def test_seeds_repeat_and_games_of_a_batch_differ():
    def play(seed):
        env = SwarmVecEnv(COARSE, 4, opponent="noise")
        env.seed(seed)
        seen = [env.reset()]
        generator = np.random.default_rng(0)
        for _ in range(40):
            seen.append(env.step(generator.uniform(-1, 1, (4, 10, 10)))[0])
        return np.stack(seen)

    one = play(3)
    np.testing.assert_array_equal(one, play(3))
    assert not np.array_equal(one, play(4))
    assert not np.array_equal(one[:, 0], one[:, 1])


def test_a_time_out_is_marked_and_its_last_observation_is_of_the_game_that_ended():
    env = VecMonitor(SwarmVecEnv(COARSE.replace(time_limit=2.0), 3, seed=0))
    env.reset()
    actions = np.zeros((3, 10, 10), np.float32)
    env.step(actions)
    observations, _, dones, infos = env.step(actions)
    assert dones.all()
    for row in range(3):
        assert infos[row]["TimeLimit.truncated"] is True
        assert infos[row]["outcome"] == 0
        assert infos[row]["episode"]["l"] == 2
        assert infos[row]["terminal_observation"][-1].max() == 0  # no time left
        assert observations[row][-1].min() == 255  # a fresh game
        assert env.observation_space.contains(infos[row]["terminal_observation"])


def test_a_decided_game_is_not_marked_as_a_time_out():
    env = SwarmVecEnv(COARSE.replace(drones_per_team=1), 32, seed=0)
    env.reset()
    for _ in range(200):
        _, rewards, dones, infos = env.step(np.random.default_rng(0).uniform(-1, 1, (32, 10, 10)))
        for row in np.flatnonzero(dones):
            assert infos[row]["TimeLimit.truncated"] is False
            assert rewards[row] == (2.0 if infos[row]["outcome"] == 1 else -2.0)
            assert infos[row]["size"] == (2 if infos[row]["outcome"] == 1 else 0)
        if dones.any():
            return
    raise AssertionError("no game was decided")


def test_the_interface_that_sb3_expects():
    env = SwarmVecEnv(COARSE, 2)
    assert env.get_attr("num_envs") == [2, 2]
    assert env.env_is_wrapped(object) == [False, False]
    assert env.get_images()[1].shape[-1] == 3
    assert env.render_mode == "rgb_array"
    with pytest.raises(AttributeError, match="share their attributes"):
        env.set_attr("seat", 1)
    with pytest.raises(AttributeError, match="no method"):
        env.env_method("reset")
    env.reset()
    assert env.reset_infos[0]["side"] in (0, 1)
    env.close()


def test_threads_change_nothing():
    seen = []
    for threads in (1, 2):
        env = SwarmVecEnv(COARSE, 8, opponent=["ring", "noise"], threads=threads, seed=1)
        env.reset()
        generator = np.random.default_rng(0)
        seen.append([env.step(generator.uniform(-1, 1, (8, 10, 10)))[0] for _ in range(20)])
        env.close()
    np.testing.assert_array_equal(seen[0], seen[1])


def test_stacked_batches_play_as_they_would_alone():
    def parts():
        return [
            SwarmVecEnv(COARSE.replace(drones_per_team=n, time_limit=3.0), 2, opponent="noise", seed=n) for n in (2, 5)
        ]

    stacked, alone = StackedVecEnv(parts()), parts()
    np.testing.assert_array_equal(stacked.reset(), np.concatenate([part.reset() for part in alone]))
    generator = np.random.default_rng(0)
    for _ in range(4):
        actions = generator.uniform(-1, 1, (4, 10, 10)).astype(np.float32)
        seen, rewards, dones, infos = stacked.step(actions)
        results = [part.step(actions[rows]) for part, rows in zip(alone, (slice(0, 2), slice(2, 4)), strict=True)]
        np.testing.assert_array_equal(seen, np.concatenate([result[0] for result in results]))
        np.testing.assert_array_equal(rewards, np.concatenate([result[1] for result in results]))
        np.testing.assert_array_equal(dones, np.concatenate([result[2] for result in results]))
        assert [info.get("size") for info in infos] == [info.get("size") for _, _, _, part in results for info in part]
    assert stacked.num_envs == 4
    assert stacked.get_attr("num_envs") == [2] * 4
    assert stacked.env_is_wrapped(VecMonitor) == [False] * 4
    stacked.deal(["ring"], ["ring"])
    assert stacked.opponent_names == ["noise", "ring"]
    assert [part.duel._dealt[0].number for part in stacked.parts] == [1, 1]
    with pytest.raises(AttributeError, match="share their attributes"):
        stacked.set_attr("x", 1)
    stacked.close()


def test_stacked_batches_are_seeded_apart():
    env = StackedVecEnv([SwarmVecEnv(COARSE, 2) for _ in range(2)])
    env.seed(3)
    first = env.reset()
    assert not np.array_equal(first[:2], first[2:])
    env.seed(3)
    np.testing.assert_array_equal(env.reset(), first)
