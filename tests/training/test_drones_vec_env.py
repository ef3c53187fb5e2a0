"""Drones as rows of a VecEnv: the games are those of the PettingZoo API, and PPO learns without wrappers."""

from __future__ import annotations

import numpy as np
import pytest
from stable_baselines3 import PPO

from swarm_pz import drones_env
from swarm_pz.config import CaptureConfig
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.training.drones_vec_env import DronesVecEnv, PlayingRolloutBuffer

SMALL = {"drones_per_team": 2, "action_period": 0.5}
CALM = CaptureConfig(enabled=False)


def choose(environment, generator):
    return generator.uniform(-1, 1, (environment.num_envs, 2)).astype(np.float32)


def test_a_row_is_a_drone_of_the_pettingzoo_face():
    rows = DronesVecEnv(num_games=3, seed=4, opponent=["noise", "uniform"], **SMALL)
    observations, generator = rows.reset(), np.random.default_rng(0)
    assert rows.num_envs == 12 and observations.shape == (12, *rows.observation_space.shape)
    streams = np.random.SeedSequence(4).spawn(3)
    singles = [drones_env(opponent=name, **SMALL) for name in ("noise", "uniform", "noise")]
    for single, stream in zip(singles, streams, strict=True):
        spaces = single.observation_space("red_0_drone_0"), single.action_space("red_0_drone_0")
        assert (rows.observation_space, rows.action_space) == spaces
        single.np_random = np.random.default_rng(stream)
        single.reset()
    for _ in range(8):
        actions = choose(rows, generator)
        observations, rewards, dones, _ = rows.step(actions)
        for game, single in enumerate(singles):
            mine = slice(4 * game, 4 * game + 4)
            result = single.step(dict(zip(single.possible_agents, actions[mine], strict=True)))
            assert (observations[mine] == np.stack(list(result[0].values()))).all() and not dones[mine].any()
            assert rewards[mine] == pytest.approx(list(result[1].values()))


def test_games_that_end_before_others_tell_what_their_own_drones_saw_last(monkeypatch):
    rows = DronesVecEnv(num_games=3, seed=4, **SMALL)
    rows.reset()
    drones = rows.drones
    assert len(set(drones.duel.sides.tolist())) == 2
    drones.batch.simulator.games.teams[1:] = drones.duel.sides[1:, None]  # the other side has no drones left
    expected, reset = [], drones.reset
    monkeypatch.setattr(drones, "reset", lambda *given: (expected.append(drones.observe()), reset(*given)))
    _, _, dones, infos = rows.step(choose(rows, np.random.default_rng(0)))
    assert np.flatnonzero(dones).tolist() == list(range(4, 12))
    last = np.stack([infos[row]["terminal_observation"] for row in range(4, 12)])
    assert (last == expected[0][1:].reshape(8, -1)).all() and (last[:, 0] == 1).all()
    for info in infos[4:]:  # a won game is not truncated
        assert (info["outcome"], info["TimeLimit.truncated"], bool(info["flies"])) == (1, False, True)


def test_games_that_end_by_time_say_so_and_begin_anew():
    env = DronesVecEnv(num_games=2, seed=0, side="red", max_cycles=3, capture=CALM, **SMALL)
    env.reset()
    generator = np.random.default_rng(0)
    for _ in range(2):
        _, _, dones, infos = env.step(choose(env, generator))
        assert not dones.any() and infos == [{}] * 8
    observations, _, dones, infos = env.step(choose(env, generator))
    assert dones.all()
    for row, info in enumerate(infos):
        assert info["TimeLimit.truncated"] and info["time_s"] == 1.5 and info["outcome"] == 0
        assert info["flies"] == (row % 4 < 2) == (info["terminal_observation"][0] == 1)
        assert env.observation_space.contains(info["terminal_observation"])
    assert (observations[:, 3:5] == 0).all()  # drones rest
    assert env.reset_infos[0]["time_s"] == 0.0


@pytest.mark.parametrize("options", [{}, {"action": "discrete"}, {"side": "both"}])
def test_seeds_decide_the_games_and_threads_decide_nothing(options):
    def play(threads):
        env = DronesVecEnv(num_games=4, threads=threads, seed=3, max_cycles=12, **SMALL, **options)
        env.action_space.seed(0)
        arrays = [env.reset()]
        for _ in range(15):
            actions = np.stack([env.action_space.sample() for _ in range(env.num_envs)])
            arrays += env.step(actions)[:3]
        assert all(env.observation_space.contains(one) for one in arrays[-3])
        assert env.seed(3) == [3] * 16
        assert np.array_equal(env.reset(), arrays[0]) and not np.array_equal(env.reset(), arrays[0])
        env.close()
        return arrays

    np.testing.assert_equal(play(1), play(2))


def test_inactive_rows_are_not_learned_from_and_are_worth_what_their_team_is():
    env = DronesVecEnv(num_games=2, seed=0, side="red", max_cycles=6, **SMALL)
    buffers = {"rollout_buffer_class": PlayingRolloutBuffer, "rollout_buffer_kwargs": {"team": env.num_drones}}
    model = PPO("MlpPolicy", env, n_steps=8, batch_size=16, seed=0, device="cpu", **buffers)
    model.learn(64)
    buffer = model.rollout_buffer
    sits_out = buffer.observations[:, 0] == -1  # flattened by now: all steps of a row, then the next row
    assert 16 <= sits_out.sum() < 64
    values, out = (array.reshape(2, 4, 8) for array in (buffer.values, sits_out))  # [game, drone, step]
    for game, step in np.ndindex(2, 8):
        playing = values[game, ~out[game, :, step], step]
        assert (playing != 0).all()
        assert values[game, out[game, :, step], step] == pytest.approx(playing.mean())
    parts = list(buffer.get(16))
    assert sum(len(part.actions) for part in parts) == (~sits_out).sum()
    assert all((part.observations[:, 0] == 1).all() for part in parts)
    assert all(len(part.actions) > 1 for part in buffer.get(2)), "PPO cannot normalise the advantage of one alone"


def test_wrong_actions_and_options_are_refused_and_pictures_are_of_every_rows_game():
    env = DronesVecEnv(num_games=2, drones_per_team=1, action_period=0.5)
    env.reset()
    for actions in (np.full((4, 2), np.nan), np.zeros((2, 2)), np.full((4, 2), 1.5)):
        with pytest.raises(CommandError, match="actions"):
            env.step(actions)
    with pytest.raises(ConfigError, match="did you mean 'num_games'"):
        DronesVecEnv(num_game=2)
    pictures = env.get_images()
    assert len(pictures) == 4 and (pictures[0] == pictures[1]).all() and not (pictures[0] == pictures[2]).all()
