"""One learner, in one game or in many at once: what Gymnasium, its wrappers and Stable-Baselines3 require."""

from __future__ import annotations

import threading

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import DictInfoToList, RecordEpisodeStatistics
from stable_baselines3.common.env_checker import check_env

from swarm_pz.config import ObservationConfig
from swarm_pz.envs.gymnasium_env import DuelEnv
from swarm_pz.envs.gymnasium_vector_env import DuelVectorEnv
from swarm_pz.envs.parallel_env import parallel_env
from swarm_pz.errors import CommandError, ConfigError, GameOverError
from tests.games import assert_same

ID = "swarm_pz/Capture-v0"
SHORT = {"opponent": "noise", "drones_per_team": 2, "max_cycles": 3, "observation": ObservationConfig(grid=10)}
"""Games of three steps, some of which end sooner."""


def zeros(count):
    return np.zeros((count, 10, 10), np.float32)


def test_sb3_checks_the_normalised_action():
    check_env(DuelEnv(drones_per_team=2, max_cycles=5))


# --- pictures ---------------------------------------------------------------------------------------------------------


def test_a_window_is_closed_and_threads_are_ended_with_their_environment(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    small = {"drones_per_team": 2, "render_mode": "human"}
    environments = [parallel_env(**small), DuelEnv(**small), DuelVectorEnv(2, **small, threads=2)]
    threads, closed = set(), []
    for environment in environments:
        environment.reset(seed=0)
        batch = environment.batch if hasattr(environment, "batch") else environment.duel.batch
        batch.simulator.for_rows(np.arange(batch.num_games), lambda rows: threads.add(threading.current_thread()))
    threads.remove(threading.current_thread())
    assert [thread.is_alive() for thread in threads] == [True]
    monkeypatch.setattr("swarm_pz.rendering.window.Window.close", lambda window: closed.append(window))
    for environment in environments:
        environment.close()
    assert not any(thread.is_alive() for thread in threads)
    assert len(set(map(id, closed))) == 3


def test_rendering_returns_a_frame_for_each_game_on_a_screen_of_its_own():
    quick = {"command_period": 0.2, "max_cycles": 1, "drones_per_team": 2}
    images, single = DuelVectorEnv(3, render_mode="rgb_array", **quick), DuelEnv(render_mode="rgb_array", **quick)
    images.reset(seed=5)
    frames = images.render()
    assert isinstance(frames, tuple)
    for number, frame in enumerate(frames):
        single.reset(seed=5 + number)
        np.testing.assert_array_equal(frame, single.render())
    lists = DuelVectorEnv(3, render_mode="rgb_array_list", **quick)
    lists.reset(seed=5)
    lists.step(zeros(3))
    lists.reset(options={"reset_mask": np.array([False, True, False])})
    assert [len(game) for game in lists.render()] == [3, 1, 3]  # a start and two control periods, or a start
    lists.step(zeros(3))
    assert [len(game) for game in lists.render()] == [1, 2, 1]
    texts, none = DuelVectorEnv(3, render_mode="ansi", **quick), DuelVectorEnv(2)
    texts.reset(seed=0)
    assert [type(frame) for frame in texts.render()] == [str] * 3
    none.reset(seed=0)
    assert none.render() is None
    with pytest.raises(ConfigError, match="did you mean 'rgb_array'"):
        DuelVectorEnv(2, render_mode="rgb_aray")


# --- many at once -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", AutoresetMode)
def test_it_does_what_gymnasiums_own_vector_env_does_with_single_environments(mode):
    ours = DuelVectorEnv(3, **SHORT, autoreset_mode=mode)
    theirs = SyncVectorEnv([lambda: DuelEnv(**SHORT)] * 3, autoreset_mode=mode)
    assert ours.metadata["autoreset_mode"] == theirs.metadata["autoreset_mode"] == mode
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    generator, starts = np.random.default_rng(0), []
    for seed in (4, [7, None, 9], None):
        assert data_equivalence(ours.reset(seed=seed), theirs.reset(seed=seed), exact=True)
        assert ours.np_random_seed == theirs.np_random_seed
        over = np.zeros(3, np.bool_)
        for _ in range(9):
            if mode == AutoresetMode.DISABLED and over.any():
                with pytest.raises(GameOverError, match="reset_mask"):
                    ours.step(zeros(3))
                # Gymnasium's reset removes the mask from the options.
                one, other = (envs.reset(options={"reset_mask": over.copy()}) for envs in (ours, theirs))
                assert data_equivalence(one, other, exact=True)
            actions = generator.uniform(-1, 1, (3, 10, 10)).astype(np.float32)
            one, other = ours.step(actions), theirs.step(actions)
            assert data_equivalence(one, other, exact=True)
            over = one[2] | one[3]
            simulator = ours.duel.batch.simulator
            starts += [simulator.positions[row].tobytes() for row in np.flatnonzero(simulator.games.ticks == 0)]
    assert len(set(starts)) == len(starts), "no two games that began by themselves are the same"


def test_the_class_says_how_games_restart_and_so_does_what_is_made():
    assert DuelVectorEnv.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    for mode in ("SameStep", AutoresetMode.SAME_STEP):
        made = gymnasium.make_vec(ID, num_envs=2, autoreset_mode=mode)
        assert made.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP
        assert DuelVectorEnv.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    with pytest.raises(ConfigError, match="autoreset_mode must be 'NextStep' or"):
        DuelVectorEnv(2, autoreset_mode="never")


def test_a_mask_starts_some_games_and_leaves_the_others_as_they_are():
    envs = DuelVectorEnv(3, opponent="noise", drones_per_team=3)
    envs.reset(seed=0)
    envs.step(zeros(3))
    simulator = envs.duel.batch.simulator
    kept, streams = simulator.snapshot([0, 2]), [generator.bit_generator.state for generator in envs.np_random]
    options = {"reset_mask": np.array([False, True, False])}
    observations, infos = envs.reset(seed=11, options=options)
    assert "reset_mask" in options  # wrappers read it afterwards
    assert simulator.time_s.tolist() == [1.0, 0.0, 1.0]
    assert_same(simulator.snapshot([0, 2]), kept)
    assert envs.np_random_seed == (0, 12, 2)
    stayed = [old == new.bit_generator.state for old, new in zip(streams, envs.np_random, strict=True)]
    assert stayed == [True, False, True]
    assert (infos["_size"].tolist(), infos["size"].tolist()) == ([False, True, False], [0, 3, 0])
    np.testing.assert_array_equal(observations[1], DuelEnv(drones_per_team=3).reset(seed=12)[0])


def test_bad_masks_and_seeds_are_refused():
    envs = DuelVectorEnv(2)
    for mask in ([True, False], np.array([1, 0]), np.array([True]), np.zeros(2, np.bool_), "all", np.True_):
        with pytest.raises(CommandError, match="reset_mask must be a bool array"):
            envs.reset(options={"reset_mask": mask})
    for seed in (True, 1.0, "ab", [1], [1, -1], [1, True], -1):
        with pytest.raises(CommandError, match="seed must be"):
            envs.reset(seed=seed)


def test_gymnasiums_vector_wrappers_take_it():
    envs = RecordEpisodeStatistics(gymnasium.make_vec(ID, num_envs=2, max_cycles=2))
    envs.reset(seed=0)
    for _ in range(2):
        *_, infos = envs.step(zeros(2))
    assert infos["episode"]["l"].tolist() == [2, 2]
    # Wrappers that convert arrays, such as NumpyToTorch, take only numbers.
    assert {values.dtype.kind for name, values in infos.items() if name != "episode"} <= set("bif")
    _, infos = DictInfoToList(gymnasium.make_vec(ID, num_envs=2)).reset(seed=0)
    assert [info["size"] for info in infos] == [10, 10]
