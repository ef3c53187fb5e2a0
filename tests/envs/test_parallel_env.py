"""PettingZoo's own conformance tests, and ours for what they let pass."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from pettingzoo.test import api_test, max_cycles_test, parallel_api_test, parallel_seed_test, render_test
from pettingzoo.utils import aec_to_parallel

import swarm_pz
from swarm_pz import GameConfig, ObservationConfig, capture_v0, env, parallel_env
from swarm_pz.config import CHANNELS, TEAM_NAMES, CaptureConfig
from swarm_pz.envs import STATE_CHANNELS
from swarm_pz.envs.drones_env import drones_env
from swarm_pz.errors import CommandError
from tests.games import assert_same, unchanged

VARIANTS = {
    "default": {},
    "entities": {"observation": ObservationConfig(kind="entities"), "action": "discrete"},
    "sides": {"observation": (ObservationConfig(grid=25), ObservationConfig(grid=10)), "action": "modes"},
    "handicap": {"drones_per_team": (1, 19), "command_cells": 5, "action": "normalised", "action_cells": 3},
    "released": {"preset": "released", "controllers": ("ergodic", "flocking"), "drones_per_team": 4},
    "fixed wing": {"preset": "fixed_wing", "controllers": ("ergodic", "flocking"), "drones_per_team": 4},
}
SMALL = ObservationConfig(grid=10)
GOOD = np.ones((10, 10), np.float32)
BOTH = {"red_0": GOOD, "blue_0": GOOD}


@pytest.mark.parametrize("variant", VARIANTS)
def test_pettingzoos_tests_pass(variant):
    options = VARIANTS[variant] | {"max_cycles": 4}
    parallel_api_test(parallel_env(**options), num_cycles=10)
    parallel_seed_test(lambda: parallel_env(**options), num_cycles=5)
    if "observation" not in options:  # it warns of lists, and of agents that see different images
        api_test(env(**options), num_cycles=10)


def test_max_cycles():
    max_cycles_test(swarm_pz)


@pytest.mark.parametrize(
    ("action", "kind", "controllers"),
    [
        ("command", "grids", "ergodic"),
        ("modes", "entities", "ergodic"),
        ("discrete", "grids", "ergodic"),
        ("command", "drones", "direct"),
        ("normalised", "drones", ("ergodic", "flocking")),
    ],
)
def test_what_pettingzoo_unwraps_plays_as_the_parallel_environment_and_refuses_as_it(action, kind, controllers):
    options = {"action": action, "observation": ObservationConfig(kind=kind), "controllers": controllers}
    options |= {"drones_per_team": 3, "max_cycles": 4}
    one, other = aec_to_parallel(env(**options)), parallel_env(**options)
    assert data_equivalence(one.reset(seed=1)[0], other.reset(seed=1)[0], exact=True)
    for agent in one.agents:
        one.action_space(agent).seed(2)
    if action != "discrete":
        bad = {agent: np.full(one.action_space(agent).shape, np.nan) for agent in one.agents}
        with pytest.raises(CommandError, match="got nan"):
            one.step(bad)
    while other.agents:
        actions = {agent: one.action_space(agent).sample() for agent in one.agents}
        assert data_equivalence(one.step(actions), other.step(actions), exact=True)
    assert not one.agents


def test_the_module_and_the_dictionaries_that_pettingzoo_users_expect():
    assert (capture_v0.parallel_env, capture_v0.env) == (parallel_env, env)
    raw = capture_v0.raw_env(max_cycles=1)
    raw.reset(seed=0)
    for agent in raw.agent_iter(2):
        raw.step(raw.action_space(agent).sample())
    assert raw.truncations == {"red_0": True, "blue_0": True}
    for environment in (parallel_env(), drones_env()):
        for spaces, of in (
            (environment.observation_spaces, environment.observation_space),
            (environment.action_spaces, environment.action_space),
        ):
            assert list(spaces) == environment.possible_agents
            assert all(spaces[agent] is of(agent) for agent in spaces)


def test_render():
    render_test(lambda render_mode: env(render_mode=render_mode, command_period=0.1, drones_per_team=2))


def begun(seed=0, **options):
    environment = parallel_env(**options)
    environment.reset(seed=seed)
    return environment


def test_observations_are_not_aliased_between_steps():
    environment = parallel_env(drones_per_team=2)
    first, _ = environment.reset(seed=0)
    kept = first["red_0"].copy()
    second, *_ = environment.step(BOTH)
    np.testing.assert_array_equal(first["red_0"], kept)
    assert not np.shares_memory(first["red_0"], second["red_0"])


def test_rendering_leaves_the_game_alone_and_a_seed_is_the_simulators_seed():
    games, simulator = [], swarm_pz.Simulator(GameConfig(drones_per_team=2))
    simulator.reset([3])
    for mode in (None, "human", "rgb_array", "rgb_array_list", "ansi"):
        environment = begun(3, render_mode=mode, command_period=0.2, drones_per_team=2)
        np.testing.assert_array_equal(environment.batch.simulator.positions, simulator.positions)
        for _ in range(2):
            environment.step(BOTH)
            environment.render()
        games.append(environment.batch.simulator.snapshot())
        environment.close()
    for shown in games[1:]:
        assert_same(shown, games[0])


def test_each_agent_sees_its_own_side_where_their_observations_differ():
    """Catches a blue agent that is shown red's view."""
    views = ObservationConfig(grid=25), SMALL
    environment = begun(3, drones_per_team=(6, 2), observation=views)
    observations = environment.step(BOTH)[0]
    for team, (agent, view) in enumerate(zip(environment.possible_agents, views, strict=True)):
        np.testing.assert_array_equal(observations[agent], environment.batch.observe(view, team)[0])


def test_the_state_shows_each_team_in_its_own_channels():
    environment = begun(3, drones_per_team=(6, 2), capture=CaptureConfig(enabled=False), observation=SMALL)
    environment.step({"red_0": np.eye(10), "blue_0": np.ones((10, 10))})
    seen = {name: environment.batch.observe(ObservationConfig(), team)[0] for team, name in enumerate(TEAM_NAMES)}
    for name, image in zip(STATE_CHANNELS, environment.state(), strict=True):
        side, _, shown = name.partition("_")
        of_side = ("red", name) if name == "time_left" else (side, f"own_{shown}")
        np.testing.assert_array_equal(image, seen[of_side[0]][CHANNELS.index(of_side[1])], err_msg=name)


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        ({"red_0": GOOD}, "one command for each of"),
        (BOTH | {"green_0": GOOD}, "green_0"),
        (BOTH | {"blue_0": None}, "blue_0's command must be numbers"),
        (BOTH | {"red_0": -GOOD}, "got values from -1"),
    ],
)
def test_bad_actions_are_refused_and_leave_the_game_as_it_was(actions, message):
    environment = begun(drones_per_team=2)
    with unchanged(environment.batch.simulator), pytest.raises(CommandError, match=message):
        environment.step(actions)
    environment.step(BOTH)


def test_in_the_aec_environment_a_bad_command_is_refused_in_its_own_turn():
    environment = env(drones_per_team=2, max_cycles=2)
    environment.reset(seed=0)
    with pytest.raises(CommandError, match="red_0's command"):
        environment.step(GOOD * np.nan)
    assert environment.agent_selection == "red_0"
    for _ in range(4):
        environment.step(GOOD)
    assert environment.infos["red_0"]["time_s"] == 2.0
    assert environment.truncations == {"red_0": True, "blue_0": True}
