from __future__ import annotations

import itertools

import gymnasium
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import DictInfoToList, RecordEpisodeStatistics

from swarm_pz.config import ObservationConfig
from swarm_pz.envs.gymnasium_env import DuelEnv
from swarm_pz.envs.gymnasium_vector_env import DuelVectorEnv
from swarm_pz.errors import CommandError, ConfigError, GameOverError

SHORT = {"opponent": "noise", "drones_per_team": 2, "max_cycles": 3, "observation": ObservationConfig(grid=10)}
"""Games of three steps, some of which end sooner."""


def assert_same(ours, theirs):
    assert type(ours) is type(theirs)
    if isinstance(ours, dict):
        assert ours.keys() == theirs.keys()
        for name in ours:
            assert_same(ours[name], theirs[name])
    elif isinstance(ours, np.ndarray) and ours.dtype == object:
        for one, other in zip(ours, theirs, strict=True):
            assert_same(one, other)
    elif isinstance(ours, np.ndarray):
        assert ours.dtype == theirs.dtype
        np.testing.assert_array_equal(ours, theirs)
    else:
        assert ours == theirs


@pytest.mark.parametrize("mode", AutoresetMode)
def test_it_does_what_gymnasiums_own_vector_env_does_with_single_environments(mode):
    ours = DuelVectorEnv(3, **SHORT, autoreset_mode=mode)
    theirs = SyncVectorEnv([lambda: DuelEnv(**SHORT)] * 3, autoreset_mode=mode)
    assert ours.metadata["autoreset_mode"] == theirs.metadata["autoreset_mode"] == mode
    assert ours.observation_space == theirs.observation_space
    assert ours.action_space == theirs.action_space
    generator = np.random.default_rng(0)
    for seed in (4, [7, None, 9], None):
        for one, other in zip(ours.reset(seed=seed), theirs.reset(seed=seed), strict=True):
            assert_same(one, other)
        assert ours.np_random_seed == theirs.np_random_seed
        over = np.zeros(3, np.bool_)
        for _ in range(9):
            if mode == AutoresetMode.DISABLED and over.any():
                # Theirs takes the mask out of the options.
                one, other = (envs.reset(options={"reset_mask": over.copy()}) for envs in (ours, theirs))
                assert_same(one[0], other[0])
                assert_same(one[1], other[1])
            actions = generator.uniform(-1, 1, (3, 10, 10)).astype(np.float32)
            one, other = ours.step(actions), theirs.step(actions)
            for mine, its in zip(one, other, strict=True):
                assert_same(mine, its)
            over = one[2] | one[3]


def test_the_class_says_how_games_restart_and_so_does_what_is_made():
    assert DuelVectorEnv.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    for asked in ("SameStep", "same_step", AutoresetMode.SAME_STEP):
        made = gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=2, autoreset_mode=asked)
        assert made.metadata["autoreset_mode"] == AutoresetMode.SAME_STEP
        assert DuelVectorEnv.metadata["autoreset_mode"] == AutoresetMode.NEXT_STEP
    with pytest.raises(ConfigError, match="autoreset_mode must be 'NextStep' or"):
        DuelVectorEnv(2, autoreset_mode="never")


def test_without_autoreset_a_step_of_an_ended_game_is_refused():
    envs = DuelVectorEnv(2, max_cycles=1, autoreset_mode="Disabled")
    envs.reset(seed=0)
    envs.step(np.zeros((2, 10, 10)))
    with pytest.raises(GameOverError, match="reset_mask"):
        envs.step(np.zeros((2, 10, 10)))


def test_a_mask_starts_some_games_and_leaves_the_others_as_they_are():
    envs = DuelVectorEnv(3, opponent="noise", drones_per_team=3)
    envs.reset(seed=0)
    envs.step(np.zeros((3, 10, 10)))
    simulator = envs.duel.batch.simulator
    kept = simulator.snapshot([0, 2])
    streams = [generator.bit_generator.state for generator in envs.np_random]
    options = {"reset_mask": np.array([False, True, False])}
    observations, infos = envs.reset(seed=11, options=options)
    assert "reset_mask" in options  # wrappers read it afterwards
    assert simulator.time_s.tolist() == [1.0, 0.0, 1.0]
    for one, other in zip(kept, simulator.snapshot([0, 2]), strict=True):
        np.testing.assert_array_equal(one, other)
    assert envs.np_random_seed == (0, 12, 2)
    assert [old == new.bit_generator.state for old, new in zip(streams, envs.np_random, strict=True)] == [
        True,
        False,
        True,
    ]
    assert infos["_size"].tolist() == [False, True, False]
    assert infos["size"].tolist() == [0, 3, 0]
    np.testing.assert_array_equal(observations[1], DuelEnv(drones_per_team=3).reset(seed=12)[0])


@pytest.mark.parametrize(
    "mask", [[True, False], np.array([1, 0]), np.array([True]), np.zeros(2, np.bool_), "all", np.True_]
)
def test_bad_masks_are_refused(mask):
    envs = DuelVectorEnv(2)
    with pytest.raises(CommandError, match="reset_mask must be a bool array"):
        envs.reset(options={"reset_mask": mask})


@pytest.mark.parametrize("seed", [True, 1.0, "ab", [1], [1, -1], [1, True], -1])
def test_bad_seeds_are_refused(seed):
    with pytest.raises(CommandError, match="seed must be"):
        DuelVectorEnv(2).reset(seed=seed)


@pytest.mark.parametrize(("mode", "kind"), [("rgb_array", np.ndarray), ("rgb_array_list", list), ("ansi", str)])
def test_rendering_returns_a_frame_for_each_game(mode, kind):
    envs = DuelVectorEnv(3, render_mode=mode, command_period=0.2, max_cycles=1)
    envs.reset(seed=0)
    envs.step(np.zeros((3, 10, 10)))
    frames = envs.render()
    assert isinstance(frames, tuple)
    assert [type(frame) for frame in frames] == [kind] * 3
    if kind is list:
        assert [len(game) for game in frames] == [3] * 3  # a start and two control periods
    envs.step(np.zeros((3, 10, 10)))
    if kind is list:
        assert [len(game) for game in envs.render()] == [1] * 3  # a start
    envs.close()


def test_without_a_picture_nothing_is_returned():
    envs = DuelVectorEnv(2)
    envs.reset(seed=0)
    assert envs.render() is None
    with pytest.raises(ConfigError, match="did you mean 'rgb_array'"):
        DuelVectorEnv(2, render_mode="rgb_aray")


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_two_games_in_a_row_differ_in_every_place(mode):
    envs = DuelVectorEnv(3, opponent="uniform", max_cycles=2, autoreset_mode=mode)
    envs.reset(seed=0)
    starts = [envs.duel.batch.simulator.positions.copy()]
    for _ in range(9):
        *_, infos = envs.step(np.zeros((3, 10, 10)))
        if not infos["time_s"].any():
            starts.append(envs.duel.batch.simulator.positions.copy())
    assert len(starts) > 3
    for one, other in itertools.combinations(starts, 2):
        assert not any(np.array_equal(one[row], other[row]) for row in range(3))


def test_gymnasiums_vector_wrappers_take_it():
    envs = RecordEpisodeStatistics(gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=2, max_cycles=2))
    envs.reset(seed=0)
    for _ in range(2):
        *_, infos = envs.step(np.zeros((2, 10, 10), np.float32))
    assert infos["episode"]["l"].tolist() == [2, 2]
    # Conversions to other libraries' arrays, as NumpyToTorch, take numbers alone.
    assert {values.dtype.kind for name, values in infos.items() if name != "episode"} <= set("bif")
    listed = DictInfoToList(gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=2))
    _, infos = listed.reset(seed=0)
    assert [info["size"] for info in infos] == [10, 10]


def test_in_the_step_in_which_one_game_ends_the_others_tell_what_they_took():
    ring = [(row, col) for row in range(18, 23) for col in range(28, 33) if max(abs(row - 20), abs(col - 30)) == 2]
    cells = np.array([*ring, (20, 30), (45, 5), (45, 5)])
    envs = DuelVectorEnv(
        2, drones_per_team=(16, 3), command_period=0.1, max_cycles=100, side="red", autoreset_mode="SameStep"
    )
    envs.reset(seed=0, options={"positions": (cells[:, ::-1] + 0.5) / 50})
    envs.duel.batch.simulator.games.ticks[1] = 297
    *_, truncated, infos = envs.step(np.zeros((2, 10, 10)))
    assert truncated.tolist() == [False, True]
    assert (infos["captured"].tolist(), infos["lost"].tolist()) == ([1, 0], [0, 0])
    assert (infos["final_info"]["captured"].tolist(), infos["final_info"]["time_s"].tolist()) == ([0, 1], [0.0, 10.0])
    assert (infos["size"].tolist(), infos["final_info"]["size"].tolist()) == ([17, 16], [0, 17])


def test_every_game_has_a_screen_of_its_own():
    envs, single = DuelVectorEnv(3, render_mode="rgb_array"), DuelEnv(render_mode="rgb_array")
    envs.reset(seed=5)
    for number, frame in enumerate(envs.render()):
        single.reset(seed=5 + number)
        np.testing.assert_array_equal(frame, single.render())
    listing = DuelVectorEnv(3, render_mode="rgb_array_list", command_period=0.2)
    listing.reset(seed=5)
    listing.step(np.zeros((3, 10, 10)))
    listing.reset(options={"reset_mask": np.array([False, True, False])})
    assert [len(frames) for frames in listing.render()] == [3, 1, 3]
