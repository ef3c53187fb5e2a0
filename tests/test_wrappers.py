"""Tests that hold in every wrapper."""

from __future__ import annotations

import pickle

import gymnasium
import numpy as np
import pettingzoo
import pytest
from gymnasium.utils.env_checker import check_env

import swarm_pz
from swarm_pz.config import GameConfig, ObservationConfig, SpawnConfig
from swarm_pz.envs.drones_env import DronesEnv
from swarm_pz.envs.gymnasium_env import DuelEnv
from swarm_pz.envs.gymnasium_vector_env import DuelVectorEnv
from swarm_pz.envs.parallel_env import CaptureEnv
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.policies.planner import Planner, PlannerConfig
from swarm_pz.spaces.densities import COMMAND_NAMES
from swarm_pz.training.drones_vec_env import DronesVecEnv
from swarm_pz.training.vec_env import SwarmVecEnv
from tests.games import assert_same

ID = "swarm_pz/Capture-v0"
WRAPPERS = {
    "parallel": CaptureEnv,
    "aec": swarm_pz.env,
    "gymnasium": DuelEnv,
    "vector": lambda **keywords: DuelVectorEnv(2, **keywords),
    "sb3": lambda **keywords: SwarmVecEnv(num_envs=2, **keywords),
}
FORMATS = {
    "default": {},
    "coarse": {"action": "normalised", "action_cells": 5},
    "modes": {"action": "modes"},
    "density": {"action": "command"},
    "discrete": {"action": "discrete"},
}


@pytest.fixture(params=WRAPPERS)
def wrapper(request):
    return WRAPPERS[request.param]


@pytest.fixture(params=FORMATS)
def formats(request):
    return FORMATS[request.param]


def spaces_of(environment):
    """The spaces of one player."""
    if hasattr(environment, "possible_agents"):
        return environment.observation_space("red_0"), environment.action_space("red_0")
    single = isinstance(environment, DuelVectorEnv)
    names = [f"single_{name}" if single else name for name in ("observation_space", "action_space")]
    return tuple(getattr(environment, name) for name in names)


def test_every_wrapper_has_the_same_formats(wrapper, formats):
    seen, acts = spaces_of(wrapper(**formats))
    expected = DuelEnv(**({"action": "command"} | formats if wrapper in (CaptureEnv, swarm_pz.env) else formats))
    assert (seen, acts) == (expected.observation_space, expected.action_space)


def test_unknown_keywords_are_type_errors_in_the_words_of_python_and_name_the_nearest(wrapper):
    for kind in (TypeError, ConfigError):
        # TorchRL's GymEnv reads these words.
        with pytest.raises(kind, match="got an unexpected keyword argument 'max_cycle'; did you mean 'max_cycles'"):
            wrapper(max_cycle=3)
    with pytest.raises(ConfigError) as refused:
        wrapper(num_agents=3)
    assert "did you mean 'max_cycles'" not in str(refused.value)


def test_a_preset_is_taken_by_name(wrapper):
    made = wrapper(preset="released", drones_per_team=4)
    batch = getattr(made.unwrapped if hasattr(made, "unwrapped") else made, "batch", None)
    config = (batch or made.duel).config
    assert config == GameConfig.preset("released").replace(drones_per_team=4)
    with pytest.raises(ConfigError, match="did you mean 'released'"):
        wrapper(preset="releasd")
    with pytest.raises(ConfigError, match="not beside a config"):
        wrapper(preset="released", config=GameConfig())
    with pytest.raises(ConfigError, match="config must be a GameConfig, or its dict"):
        wrapper(config=0)


PAIR_OF_VIEWS = (ObservationConfig(grid=10, channels=("own_share", "time_left")), ObservationConfig(grid=25))


@pytest.mark.parametrize("make", [DuelEnv, DuelVectorEnv, SwarmVecEnv, DronesVecEnv])
def test_every_pair_is_the_learners_and_its_opponents_on_whichever_side_the_learner_sits(make):
    """Catches a learner on blue that gets red's view, or as many drones as its side instead of its own number."""
    keywords = {"drones_per_team": (1, 3), "controllers": ("direct", "flocking"), "observation": PAIR_OF_VIEWS}
    keywords |= {"spawn": SpawnConfig(layout="squares", speed=0.1), "side": "random"}
    count = 1 if make is DuelEnv else 8
    number = {DuelEnv: {}, DronesVecEnv: {"num_games": count}}.get(make, {"num_envs": count})
    environment = make(**number, **keywords)
    duel = environment.drones.duel if make is DronesVecEnv else environment.duel
    sides = set()
    for seed in range(8 // count):
        duel.reset(np.random.SeedSequence(seed).spawn(count), np.arange(count))
        simulator, learners, games = duel.batch.simulator, duel.sides, np.arange(count)
        sides |= set(learners.tolist())
        assert (simulator.sizes[games, learners] == 1).all() and (simulator.sizes[games, 1 - learners] == 3).all()
        for row, learner in enumerate(learners.tolist()):
            assert [simulator.controller_of(row, team) for team in (learner, 1 - learner)] == ["direct", "flocking"]
            assert ((simulator.positions[row] < 0.5).all(axis=1) == (simulator.teams[row] == 0)).all()
            assert ((simulator.velocities[row] > 0.0).all(axis=1) == (simulator.teams[row] == 0)).all()
        if make is not DronesVecEnv:
            assert duel.observe().shape == (count, 2, 10, 10) and (duel.observe()[:, 0] == 64).all()
        assert np.allclose(duel.infos()["share"], 0.25)
    assert sides == {0, 1}


@pytest.mark.parametrize(
    "make", [CaptureEnv, DronesEnv, DuelEnv, WRAPPERS["vector"]], ids=["parallel", "drones", "gymnasium", "vector"]
)
def test_a_reset_that_is_refused_leaves_game_and_seeds_as_they_were(make):
    """Catches refused options that reseed all the same, and misspelt ones that are silently ignored."""
    environment, other = make(drones_per_team=1), make(drones_per_team=1)
    for one in (environment, other):
        one.reset(seed=5)
    for options, message in (
        ({"positions": [[2.0, 0.5], [0.5, 0.5]]}, "scenario positions"),
        ({"position": [[0.2, 0.5], [0.5, 0.5]]}, "no option 'position': did you mean 'positions'"),
        ({"velocity": 0.0}, "did you mean 'velocities'"),
    ):
        with pytest.raises(CommandError, match=message):
            environment.reset(seed=9, options=options)
    environment.reset(options={"curriculum": 3})
    other.reset()
    assert_same(*(batch_of(one).simulator.games for one in (environment, other)))
    assert environment.np_random_seed == other.np_random_seed


def batch_of(environment):
    return environment.batch if hasattr(environment, "batch") else environment.duel.batch


def test_registries_take_the_keywords():
    for made in (
        gymnasium.make(ID, preset="released", action="discrete"),
        gymnasium.make_vec(ID, num_envs=2, preset="released", action="discrete"),
        gymnasium.make_vec(ID, num_envs=2, vectorization_mode="sync", preset="released", action="discrete"),
        pettingzoo.make("parallel", ID, preset="released", action="discrete"),
        pettingzoo.make("aec", ID, preset="released", action="discrete"),
    ):
        made.reset(seed=0)
        made.close()
    named = gymnasium.make(ID, action="discrete").unwrapped
    assert named.command_names == COMMAND_NAMES
    assert named.opponent_names == ["uniform"]


@pytest.mark.parametrize("keywords", [{}, {"max_cycles": 400}, {"time_limit": 20.0}], ids=str)
def test_the_spec_says_after_how_many_steps_a_game_is_a_draw(keywords):
    """Catches a limit of None, and one limit for all games, which would cut long ones short."""
    expected = keywords.get("max_cycles", int(keywords.get("time_limit", 300)))
    for made in (gymnasium.make(ID, **keywords), gymnasium.make_vec(ID, num_envs=2, **keywords)):
        assert made.spec.max_episode_steps == expected
        made.close()
    assert gymnasium.make(made.spec.id, **keywords).unwrapped.duel.batch.max_cycles == expected


@pytest.mark.filterwarnings("ignore:.*we recommend using a symmetric and normalized space:UserWarning")  # of modes
def test_gymnasiums_checker_has_nothing_to_say(formats):
    check_env(gymnasium.make(ID, **formats).unwrapped)


def test_infos_are_numbers_by_the_same_names_at_every_step():
    parallel, single = CaptureEnv(max_cycles=2), DuelEnv(max_cycles=3, opponent="ring")
    started, stepped = (
        parallel.reset(seed=0)[1],
        parallel.step({agent: np.ones((10, 10)) for agent in ("red_0", "blue_0")}),
    )
    infos = [single.reset(seed=0)[1], *(single.step(single.action_space.sample())[-1] for _ in range(3))]
    for group in (infos, [*started.values(), *stepped[-1].values()]):
        for info in group:
            assert list(info) == list(group[0])
            assert all(type(value) in (int, float) for value in info.values())
    assert [info["outcome"] for info in infos] == [0] * 4


def play_on(environment, steps=5):
    """Play on past the ends of games, and return the observations."""
    observations, generator = [], np.random.default_rng(1)
    for _ in range(steps):
        actions = generator.random((2, 10, 10))
        if isinstance(environment, CaptureEnv):
            actions = dict(zip(environment.possible_agents, actions, strict=True))
        observation, *_ = environment.step(actions[0] if isinstance(environment, DuelEnv) else actions)
        observations.append(observation["red_0"] if isinstance(environment, CaptureEnv) else observation)
        if not isinstance(environment, DuelVectorEnv) and not batch_of(environment).running[0]:
            environment.reset()
    return np.stack(observations)


SMALL = {"max_cycles": 3, "drones_per_team": 2}
PICKLED = {
    "parallel": lambda _: CaptureEnv(**SMALL),
    "window": lambda _: CaptureEnv(**SMALL, render_mode="human", command_period=0.2),
    "gymnasium": lambda opponent: DuelEnv(opponent=opponent, **SMALL),
    "vector": lambda opponent: DuelVectorEnv(2, threads=2, opponent=opponent, **SMALL),
}


@pytest.mark.parametrize(
    ("make", "opponent"),
    [("parallel", ""), ("window", ""), ("gymnasium", "noise"), ("vector", "champion"), ("gymnasium", "planner")],
)
def test_an_environment_pickled_in_mid_game_goes_on_as_the_one_that_was_not(make, opponent):
    if opponent == "planner":  # with a small budget
        opponent = Planner(GameConfig(drones_per_team=2), settings=PlannerConfig(drone_steps=500, horizon=0.5))
    environment = PICKLED[make](opponent)
    environment.reset(seed=3)
    play_on(environment, 2)
    other = pickle.loads(pickle.dumps(environment))  # noqa: S301
    np.testing.assert_array_equal(play_on(environment), play_on(other))
    if make == "window":
        other.render()
    environment.close()
    other.close()


@pytest.mark.parametrize("make", [DuelEnv, CaptureEnv])
def test_np_random_is_what_later_games_come_from(make):
    one, other = make(), make()

    def start(environment):
        environment.reset()
        return batch_of(environment).simulator.positions.copy()

    one.reset(seed=5)
    assert one.np_random_seed == 5
    other.np_random = np.random.default_rng(5)
    first = start(one)
    np.testing.assert_array_equal(first, start(other))
    assert not np.array_equal(first, start(one))
    for bad in (True, 1.0, -1, "x"):
        with pytest.raises(CommandError, match="a seed must be"):
            one.reset(seed=bad)
    assert isinstance(make().np_random, np.random.Generator)
