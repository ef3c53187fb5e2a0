from __future__ import annotations

import numpy as np
import pytest

from swarm_pz import policies
from swarm_pz.config import BLUE, CaptureConfig, GameConfig, ObservationConfig
from swarm_pz.errors import CommandError
from swarm_pz.simulator import Simulator
from swarm_pz.training.vec_env import StackedVecEnv, SwarmVecEnv

COARSE = GameConfig(observation=ObservationConfig(grid=10), drones_per_team=3)
STILL = np.zeros((4, 10, 10), np.float32)
CALM = CaptureConfig(enabled=False)  # else a game may end with its first step


def stacked(*sizes, **options):
    return StackedVecEnv([SwarmVecEnv(COARSE.replace(drones_per_team=size), 2, **options) for size in sizes])


def test_seeds_decide_the_games_threads_decide_nothing_and_games_of_a_batch_differ():
    def play(seed, threads=1):
        env = SwarmVecEnv(COARSE, 4, opponent=["ring", "noise"], threads=threads, seed=9)
        assert env.seed(seed) == [seed] * 4
        generator = np.random.default_rng(0)
        images = np.stack([env.reset(), *(env.step(generator.uniform(-1, 1, (4, 10, 10)))[0] for _ in range(20))])
        env.close()
        return images

    one = play(3)
    np.testing.assert_array_equal(one, play(3, threads=2))
    assert not np.array_equal(one, play(4))
    assert not np.array_equal(one[:, 0], one[:, 2])
    with pytest.raises(CommandError, match="a seed must be"):
        SwarmVecEnv(num_envs=2, seed=-3)


@pytest.mark.parametrize("won", [True, False])
def test_a_decided_game_is_not_marked_as_a_time_out(won):
    env = SwarmVecEnv(COARSE, 4, seed=0)
    env.reset()
    env.duel.batch.simulator.games.teams[:] = (env.duel.sides if won else 1 - env.duel.sides)[:, None]
    _, rewards, dones, infos = env.step(STILL)
    assert dones.all()
    for reward, info in zip(rewards, infos, strict=True):
        ending = {name: info[name] for name in ("TimeLimit.truncated", "outcome", "size")}
        assert ending == {"TimeLimit.truncated": False, "outcome": 1 if won else -1, "size": 6 if won else 0}
        assert np.sign(reward) == (1 if won else -1)


def test_only_the_games_that_have_ended_start_anew_and_have_infos_each_its_own():
    def begun(**keywords):
        env = SwarmVecEnv(COARSE, 4, opponent=["uniform", "noise", "ring"], seed=0, **keywords)
        env.reset()
        return env

    env, endless = begun(), begun(max_cycles=10**6)
    simulator, sides = env.duel.batch.simulator, env.duel.sides.copy()
    for one in (env, endless):
        one.duel.batch.simulator.games.ticks[[1, 3]] = COARSE.limit_ticks - 30
    observations, _, dones, infos = env.step(STILL)
    last, *_ = endless.step(STILL)
    assert dones.tolist() == [False, True, False, True]
    assert infos[0] == infos[2] == {}
    assert simulator.time_s.tolist() == [1.0, 0.0, 1.0, 0.0]
    streams, alone = np.random.SeedSequence(0).spawn(4), Simulator(COARSE)
    for row, opponent in ((1, 1), (3, 0)):
        alone.reset(streams[row].spawn(2)[1:])  # the second game of its own stream
        np.testing.assert_array_equal(simulator.positions[row], alone.positions[0])
        assert (infos[row]["opponent"], infos[row]["side"], infos[row]["time_s"]) == (opponent, sides[row], 300.0)
        assert infos[row]["TimeLimit.truncated"]
        ended = infos[row]["terminal_observation"]
        np.testing.assert_array_equal(ended[:-1], last[row, :-1])
        assert (ended[-1].max(), observations[row, -1].min()) == (0, 255)
        assert ended[2].max() == 255 and not observations[row, 2].any()  # trails


def test_stacked_batches_play_as_they_would_alone():
    def parts():
        return [
            SwarmVecEnv(COARSE.replace(drones_per_team=n, time_limit=3.0), 2, opponent="noise", seed=n) for n in (2, 5)
        ]

    together, alone = StackedVecEnv(parts()), parts()
    np.testing.assert_array_equal(together.reset(), np.concatenate([part.reset() for part in alone]))
    assert [info["size"] for info in together.reset_infos] == [2, 2, 5, 5]
    assert [info["side"] for info in together.reset_infos] == [side for part in alone for side in part.duel.sides]
    generator = np.random.default_rng(0)
    for _ in range(4):
        actions = generator.uniform(-1, 1, (4, 10, 10)).astype(np.float32)
        *results, infos = together.step(actions)
        expected = [part.step(actions[rows]) for part, rows in zip(alone, (slice(0, 2), slice(2, 4)), strict=True)]
        for place, result in enumerate(results):
            np.testing.assert_array_equal(result, np.concatenate([one[place] for one in expected]))
        assert [info.get("size") for info in infos] == [info.get("size") for *_, part in expected for info in part]
    together.close()


def test_stacked_batches_are_dealt_by_the_names_that_are_said_and_share_no_opponent():
    def targets(deal):
        env = stacked(3, 4, side="red", seed=0)
        deal(env)
        assert (
            [part.opponent_names for part in env.parts] == [["uniform", "old friend"]] * 2 == 2 * [env.opponent_names]
        )
        env.reset()
        for _ in range(3):
            env.step(STILL)
        return np.stack([part.duel.batch.simulator.targets[:, BLUE] for part in env.parts])

    def apart(env):
        for part in env.parts:
            part.deal([policies.load("noise", GameConfig())], ["old friend"])

    one = policies.load("noise", GameConfig())
    np.testing.assert_array_equal(targets(lambda env: env.deal([one], ["old friend"])), targets(apart))
