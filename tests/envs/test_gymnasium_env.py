from __future__ import annotations

import threading

import gymnasium
import numpy as np
import pytest
from stable_baselines3.common.env_checker import check_env

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.envs.gymnasium_env import DuelEnv
from swarm_pz.envs.gymnasium_vector_env import DuelVectorEnv
from swarm_pz.envs.opponents import DuelBatch
from swarm_pz.envs.parallel_env import parallel_env
from swarm_pz.errors import CommandError, GameOverError, PolicyError
from swarm_pz.simulator.spawn import random_start


class Nonsense:
    """An opponent that answers what it is told to."""

    observation = ObservationConfig(grid=10)

    def __init__(self, answer):
        self.answer = answer

    def reset(self, seeds, rows):
        pass

    def act(self, observations, rows):
        return self.answer


def test_sb3_checks_the_normalised_action():
    check_env(DuelEnv())


def test_gymnasium_makes_it_by_name_and_checks_it():
    environment = gymnasium.make("swarm_pz/Capture-v0", opponent="noise", max_cycles=5)
    environment.action_space.seed(0)
    environment.reset(seed=0)
    steps, truncated = 0, False
    while not truncated:
        _, _, _, truncated, info = environment.step(environment.action_space.sample())
        steps += 1
    assert steps == 5
    assert info["outcome"] == 0


class Seeded:
    """An opponent that keeps the seeds of its games."""

    observation = ObservationConfig(grid=10)

    def __init__(self):
        self.seeds = {}

    def reset(self, seeds, rows):
        self.seeds |= dict(zip(rows.tolist(), seeds, strict=True))

    def act(self, observations, rows):
        return np.ones((len(rows), 10, 10))


def test_the_start_the_side_and_the_opponent_have_streams_of_their_own():
    count, opponent = 64, Seeded()
    duel = DuelBatch(GameConfig(), count, opponent=opponent)
    seeds = np.random.SeedSequence(0).spawn(count)
    duel.reset(seeds, np.arange(count))

    def draws(streams):
        return np.array([np.random.default_rng(stream).integers(2) for stream in streams])

    theirs = [opponent.seeds[row] for row in range(count)]
    # Each of two coins that are the same coin would agree in every game; of two of their own in half of them.
    for one, other in ((duel.sides, draws(seeds)), (duel.sides, draws(theirs)), (draws(seeds), draws(theirs))):
        assert 8 < (one == other).sum() < count - 8
    states = {tuple(stream.generate_state(4)) for stream in [*seeds, *theirs]}
    assert len(states) == 2 * count
    positions, _ = random_start(duel.config, np.random.default_rng(seeds[0]))
    np.testing.assert_allclose(duel.batch.simulator.positions[0], positions, rtol=1e-6)


class Constant:
    """An opponent that asks for one cell, and keeps the rows that it began and answered."""

    observation = ObservationConfig(grid=10)

    def __init__(self, cell):
        self.cell, self.began, self.answered = cell, [], []

    def reset(self, seeds, rows):
        self.began += rows.tolist()

    def act(self, observations, rows):
        self.answered += rows.tolist()
        return np.broadcast_to(np.arange(100).reshape(10, 10) == self.cell, (len(rows), 10, 10)).astype(float)


def test_a_deal_is_for_the_games_that_begin_and_running_ones_keep_their_opponents():
    first, second, third = (Constant(cell) for cell in range(3))
    duel, rows = DuelBatch(GameConfig(), 4, opponent=[first, second]), np.arange(4)
    duel.reset(np.random.SeedSequence(0).spawn(4), rows)
    duel.deal(third, ["third"])
    duel.reset(np.random.SeedSequence(1).spawn(1), rows[2:3])
    duel.step(np.zeros((4, 10, 10)))
    assert (first.answered, second.answered, third.began, third.answered) == ([0], [1, 3], [2], [2])
    assert duel.batch.simulator.targets[rows, 1 - duel.sides].reshape(4, -1).argmax(axis=1).tolist() == [0, 1, 2, 1]
    assert [duel.opponent_names[number] for number in duel.infos()["opponent"]] == [
        *["Constant"] * 2,
        "third",
        "Constant",
    ]


@pytest.mark.parametrize("bad", [np.full((10, 10), np.nan), np.full((10, 10), 1.5), np.zeros((5, 5)), None])
def test_bad_actions_are_refused_and_leave_the_game_as_it_was(bad):
    environment = DuelEnv()
    environment.reset(seed=0)
    before = environment.duel.batch.simulator.snapshot()
    with pytest.raises(CommandError, match=r"actions must be numbers in \[-1, 1\]"):
        environment.step(bad)
    for array, copied in zip(environment.duel.batch.simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, copied)


@pytest.mark.parametrize("answer", [None, np.full((1, 10, 10), np.nan), np.ones((10, 10)), -np.ones((1, 10, 10))])
def test_an_opponent_that_answers_nonsense_is_named_and_the_game_stays_as_it_was(answer):
    environment = DuelEnv(opponent=Nonsense(answer))
    environment.reset(seed=0)
    before = environment.duel.batch.simulator.snapshot()
    with pytest.raises(PolicyError, match="policy Nonsense's answer must be numbers"):
        environment.step(np.zeros((10, 10)))
    for array, copied in zip(environment.duel.batch.simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, copied)


def test_a_step_after_the_end_is_refused():
    environment = DuelEnv(max_cycles=1)
    environment.reset(seed=0)
    environment.step(np.zeros((10, 10)))
    with pytest.raises(GameOverError, match="call reset"):
        environment.step(np.zeros((10, 10)))


SEATS = (ObservationConfig(grid=10, channels=("time_left", "own_share")), ObservationConfig(grid=25))


@pytest.mark.parametrize("many", [False, True])
def test_all_keywords_at_once_are_kept(many):
    keywords = {
        "drones_per_team": (1, 3),
        "observation": SEATS,
        "command_cells": 6,
        "opponent": "ring",
        "side": "blue",
        "max_cycles": 7,
        "action": "command",
        "action_cells": 3,
        "flatten_actions": True,
        "observation_dtype": "float32",
        "channels_last": True,
        "render_mode": "ansi",
    }
    config = GameConfig(time_limit=20)
    environment = DuelVectorEnv(2, config, **keywords) if many else DuelEnv(config, **keywords)
    duel = environment.duel
    assert duel.config == config.replace(**{name: keywords[name] for name in list(keywords)[:3]})
    assert (duel.batch.max_cycles, duel.opponent_names, environment.render_mode) == (7, ["ring"], "ansi")
    observation, info = environment.reset(seed=0, options={"velocities": np.full((4, 2), 0.5)})
    assert (duel.batch.simulator.velocities == 0.5).all() and (duel.sides == 1).all()
    assert np.all(info["side"] == 1) and np.all(info["size"] == 1)
    assert observation.shape[-3:] == (10, 10, 2) and observation.dtype == np.float32
    np.testing.assert_allclose(observation[..., 1], 0.25, atol=0.003)
    action = np.zeros(9, np.float32)
    action[6] = 1.0
    assert environment.action_space.contains(np.stack([action] * 2) if many else action)
    environment.step(np.stack([action] * 2) if many else action)
    assert (duel.batch.simulator.targets[:, 1].reshape(-1, 36).argmax(axis=-1) == 30).all()
    frames = environment.render()
    assert all(isinstance(frame, str) for frame in (frames if many else [frames]))
    environment.close()


def test_a_window_is_closed_and_threads_are_ended_with_their_environment(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    environments = [
        parallel_env(render_mode="human"),
        DuelEnv(render_mode="human"),
        DuelVectorEnv(2, render_mode="human", threads=2),
        DuelVectorEnv(2, threads=2),
    ]
    threads, closed = set(), []
    for environment in environments:
        environment.reset(seed=0)
        batch = environment.batch if hasattr(environment, "batch") else environment.duel.batch
        batch.simulator.for_rows(np.arange(batch.num_games), lambda rows: threads.add(threading.current_thread()))
    threads.remove(threading.current_thread())
    assert [thread.is_alive() for thread in threads] == [True] * 2
    monkeypatch.setattr("swarm_pz.rendering.window.Window.close", lambda window: closed.append(window))
    for environment in environments:
        environment.close()
    assert not any(thread.is_alive() for thread in threads)
    assert len(set(map(id, closed))) == 3


@pytest.mark.parametrize("make", [DuelEnv, parallel_env])
def test_frames_are_of_one_game_from_its_start_on(make):
    environment = make(render_mode="rgb_array_list", command_period=0.2, drones_per_team=2)
    assert environment.metadata["render_fps"] == 10
    action = np.zeros((10, 10)) if make is DuelEnv else {"red_0": np.ones((10, 10)), "blue_0": np.ones((10, 10))}
    for _ in range(2):
        environment.reset(seed=0)
        environment.step(action)
        assert len(environment.render()) == 3  # the start and two control periods
        environment.step(action)
    assert make(render_mode="rgb_array", command_period=0.5).metadata["render_fps"] == 2
