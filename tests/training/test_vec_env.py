from __future__ import annotations

import numpy as np
import pytest
from stable_baselines3.common.vec_env import VecMonitor

from swarm_pz import policies
from swarm_pz.config import BLUE, CaptureConfig, GameConfig, ObservationConfig
from swarm_pz.envs.gymnasium_env import DuelEnv
from swarm_pz.errors import CommandError
from swarm_pz.simulator import Simulator
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


def test_only_the_games_that_have_ended_start_anew_and_have_infos_each_its_own():
    def begun(**keywords):
        env = SwarmVecEnv(COARSE, 4, opponent=["uniform", "noise", "ring"], seed=0, **keywords)
        env.reset()
        return env

    env, endless = begun(), begun(max_cycles=10**6)
    simulator, sides = env.duel.batch.simulator, env.duel.sides.copy()
    for one in (env, endless):
        one.duel.batch.simulator.games.ticks[[1, 3]] = COARSE.limit_ticks - 30
    seen, _, dones, infos = env.step(np.zeros((4, 10, 10)))
    last, *_ = endless.step(np.zeros((4, 10, 10)))
    assert dones.tolist() == [False, True, False, True]
    assert infos[0] == infos[2] == {}
    assert simulator.time_s.tolist() == [1.0, 0.0, 1.0, 0.0]
    streams, alone = np.random.SeedSequence(0).spawn(4), Simulator(COARSE)
    for row, opponent in ((1, 1), (3, 0)):
        alone.reset(streams[row].spawn(2)[1:])  # the second game of its own stream
        np.testing.assert_array_equal(simulator.positions[row], alone.positions[0])
        assert (infos[row]["opponent"], infos[row]["side"], infos[row]["time_s"]) == (opponent, sides[row], 300.0)
        assert infos[row]["TimeLimit.truncated"] is True
        ended = infos[row]["terminal_observation"]
        np.testing.assert_array_equal(ended[:-1], last[row, :-1])
        assert (ended[-1].max(), seen[row, -1].min()) == (0, 255)
        assert ended[2].max() == 255 and not seen[row, 2].any()  # trails


def test_games_follow_the_stream_of_their_seed_and_may_be_left_out():
    def starts(make, leave_out=(0, 0)):
        env = make()
        places = []
        for number in range(3):
            if number == 1:
                env.skip(np.array(leave_out))
            env.reset()
            places.append(env.duel.batch.simulator.positions.copy())
        return np.stack(places)

    def seeded():
        env = SwarmVecEnv(COARSE, 2)
        assert env.seed(7) == [7, 7]
        return env

    given = starts(lambda: SwarmVecEnv(COARSE, 2, seed=7))
    np.testing.assert_array_equal(given, starts(seeded))
    np.testing.assert_array_equal(starts(seeded, (1, 0))[1:, 1], given[1:, 1])
    np.testing.assert_array_equal(starts(seeded, (1, 0))[1, 0], given[2, 0])
    for row, stream in enumerate(np.random.SeedSequence(7).spawn(2)):
        alone = DuelEnv(COARSE)
        for number, seed in enumerate(stream.spawn(3)):
            alone.duel.reset([seed], np.zeros(1, np.int64))
            np.testing.assert_array_equal(alone.duel.batch.simulator.positions[0], given[number, row])


def test_all_keywords_at_once_are_kept(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 4)
    env = SwarmVecEnv(
        GameConfig(time_limit=20, capture=CaptureConfig(enabled=False)),  # else a game may end with its first step
        4,
        drones_per_team=(1, 3),
        observation=ObservationConfig(grid=10),
        command_cells=6,
        opponent=["ring", "noise"],
        side="blue",
        max_cycles=7,
        threads=3,
        action="command",
        action_cells=3,
        flatten_actions=True,
        observation_dtype="float32",
        channels_last=True,
    )
    seen, batch = env.reset(), env.duel.batch
    assert (batch.max_cycles, batch.simulator.threads, env.num_envs) == (7, 3, 4)
    assert (batch.config.time_limit, batch.config.team_sizes, batch.config.command_cells) == (20, (1, 3), 6)
    assert [(info["opponent"], info["side"], info["size"]) for info in env.reset_infos] == [(0, 1, 1), (1, 1, 1)] * 2
    assert env.opponent_names == ["ring", "noise"] and env.command_names == ()
    assert seen.shape == (4, 10, 10, 9) and seen.dtype == np.float32
    np.testing.assert_allclose(seen[..., 7], 0.25, atol=0.003)
    env.step(np.tile(np.eye(9, dtype=np.float32)[6], (4, 1)))
    assert batch.simulator.targets[:, 1].reshape(4, 36).argmax(axis=-1).tolist() == [30] * 4
    env.close()


def test_attributes_are_asked_of_some_games_or_of_all():
    parts = [SwarmVecEnv(COARSE, 2, seed=0), SwarmVecEnv(COARSE, 3, max_cycles=4, seed=0)]
    env = StackedVecEnv(parts)
    assert env.get_attr("num_envs") == [2, 2, 3, 3, 3]
    assert env.get_attr("num_envs", [4, 0]) == [3, 2]
    assert env.get_attr("num_envs", 1) == [2]
    assert parts[1].get_attr("num_envs", [0, 2]) == [3, 3]
    for one in (env, parts[0]):
        assert one.env_is_wrapped(VecMonitor, [0]) == [False]
        with pytest.raises(AttributeError, match="no method 'deal'"):
            one.env_method("deal", [])
    env.reset()
    assert len(parts[1].get_images()) == 3
    parts[1].duel.batch.simulator.restore(parts[1].duel.batch.simulator.snapshot([0]), [2])
    images = parts[1].get_images()
    assert np.array_equal(images[0], images[2]) and not np.array_equal(images[0], images[1])


def test_stacked_batches_are_dealt_by_the_names_that_are_said():
    env = StackedVecEnv([SwarmVecEnv(COARSE, 2) for _ in range(2)])
    env.deal([policies.load("ring", COARSE)], ["old friend"])
    assert [part.opponent_names for part in env.parts] == [["uniform", "old friend"]] * 2


def test_infos_of_stacked_starts_are_in_the_order_of_the_games():
    env = StackedVecEnv([SwarmVecEnv(COARSE.replace(drones_per_team=size), 2) for size in (4, 2)])
    assert env.seed(3) == [3] * 4
    env.reset()
    assert [info["size"] for info in env.reset_infos] == [4, 4, 2, 2]
    sides = [info["side"] for info in env.reset_infos]
    for number, part in enumerate(env.parts):
        assert part.duel.sides.tolist() == sides[2 * number : 2 * number + 2]


def test_stacked_batches_share_no_opponent():
    def targets(deal):
        parts = [SwarmVecEnv(COARSE.replace(drones_per_team=size), 2, side="red", seed=0) for size in (3, 4)]
        env = StackedVecEnv(parts)
        deal(env)
        env.reset()
        for _ in range(3):
            env.step(np.zeros((4, 10, 10), np.float32))
        return np.stack([part.duel.batch.simulator.targets[:, BLUE] for part in parts])

    def noise():
        return policies.load("noise", GameConfig())

    def apart(env):
        for part in env.parts:
            part.deal([noise()], ["noise"])

    one = noise()
    for given in ([one], [one, one]):
        np.testing.assert_array_equal(
            targets(lambda env, given=given: env.deal(given, ["noise"] * len(given))), targets(apart)
        )


def test_a_seed_below_zero_is_refused():
    with pytest.raises(CommandError, match="a seed must be"):
        SwarmVecEnv(num_envs=2, seed=-3)
