"""Tests of every registered control system; a new one needs no test of its own.

What should not matter changes nothing in a solve, up to rounding. Seed and commands determine a game bit for bit.
Accelerations are finite in every state. Every wrapper takes the commands.
"""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from pettingzoo.test import parallel_api_test

from swarm_pz import parallel_env
from swarm_pz.config import ControllerConfig, GameConfig
from swarm_pz.config.registry import registered, system_class, system_of
from swarm_pz.envs.gymnasium_env import DuelEnv
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.simulator import Simulator
from swarm_pz.training.vec_env import SwarmVecEnv
from tests.games import assert_same, unchanged
from tests.systems import golden
from tests.systems.flights import State, find_not_finite, game_of, random_states, sampled, solve

SYSTEMS = sorted(registered())
SOFT = ControllerConfig(control_weight=20.0, max_acceleration=100.0)
"""Saturation, which would hide differences, is rare."""


@pytest.fixture(params=SYSTEMS)
def name(request):
    return request.param


@pytest.mark.parametrize("system", golden.SYSTEMS)
def test_its_solves_are_those_that_were_stored(system):
    decided = 0
    for (variant, flight, config), expected in zip(golden.cases(system), golden.stored(system), strict=True):
        known = np.isfinite(expected).all(axis=1)
        assert (golden.difference(variant.solve(flight, config)[0], expected)[known] < golden.SAME).all()
        decided += known.sum()
    assert decided > 200


def test_direct_commands_are_accelerations_up_to_the_largest():
    generator = np.random.default_rng(0)
    state, commands = random_states(generator, 1, 12), generator.uniform(-1, 1, (2, 1, 12, 2))
    rows = commands[state.teams[0], 0, np.arange(12)]
    expected = 0.3 * rows / np.maximum(1.0, np.linalg.norm(rows, axis=1, keepdims=True))
    config = game_of("direct", 12, controller=ControllerConfig(max_acceleration=0.3))
    np.testing.assert_allclose(solve(config, state, list(commands))[0], expected, atol=1e-6)


# --- commands ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("config", [GameConfig(drones_per_team=3), GameConfig(command_cells=5)], ids=["few", "coarse"])
def test_space_default_and_what_is_read_agree(name, config):
    system = system_of(name)
    space, default = system.space(config), system.default(config)
    assert space.contains(default.astype(np.float32))
    np.testing.assert_array_equal(system.parse(default, config), default)
    commands = sampled(name, config, np.random.default_rng(0), 4)
    alone = [system.parse(command, config) for command in commands]
    assert all(one.shape == space.shape and one.dtype == np.float64 for one in alone)
    together = system.parse_all(commands, 4, config, "commands")
    np.testing.assert_array_equal(together, alone)
    assert not np.shares_memory(together, commands)
    for command in system.named(config).values():
        assert system.parse(command, config).shape == space.shape


def test_commands_and_densities_stand_for_each_other(name):
    config, generator = GameConfig(command_cells=7), np.random.default_rng(0)
    system = system_of(name)
    commands = np.stack([system.parse(one, config) for one in sampled(name, config, generator, 4)])
    for shown in (system.to_densities(commands, config), system.to_densities(system.default(config)[None], config)):
        assert shown.shape[1:] == (7, 7) and shown.min() >= 0.0 and 0.0 < shown.max() <= 1.0
    densities = generator.random((4, 7, 7)) ** 3
    densities[0], densities[1] = 0.0, 1.0
    served = densities if system.takes == "density" else system.from_densities(densities, config)
    if served is not None:
        np.testing.assert_allclose(system.parse_all(served, 4, config, "served"), served)


def test_what_is_no_command_is_refused_and_changes_nothing_even_if_only_one_of_several_is_none(name):
    config = GameConfig(controllers=name)
    system, simulator = system_of(name), Simulator(config, num_games=3)
    space, bad = system.space(config), []
    for value in (np.nan, np.inf, space.high.max() + 1.0, space.low.min() - 1.0):
        bad.append(system.default(config).copy())
        bad[-1].flat[0] = value
    good = sampled(name, config, np.random.default_rng(0), 2)
    for command in (*bad, np.zeros((*space.shape, 2, 1)), "words", None, 7.5):
        with pytest.raises(CommandError):
            system.parse(command, config)
        with unchanged(simulator), pytest.raises(CommandError, match="red's command"):
            simulator.command(0, [good[0], command, good[1]])
        with pytest.raises(CommandError):
            system.parse_all([command], 1, config, "commands")


def test_a_configuration_keeps_a_system_with_numbers_of_its_own(name):
    usual, system = GameConfig(controllers=name), system_of(name)
    assert GameConfig.from_dict(usual.to_dict()) == usual and usual.controllers == name
    assert GameConfig(controllers=system_class(name)()).hash == usual.hash
    numbers = {one.name: getattr(system, one.name) for one in dataclasses.fields(system)}
    for field in (name for name, number in numbers.items() if isinstance(number, float) and number):
        config = GameConfig(controllers=system.replace(**{field: 0.9 * getattr(system, field)}))
        again = GameConfig.from_dict(config.to_dict())
        assert again == config and again.hash == config.hash != usual.hash
        assert getattr(again.team_systems[0], field) == 0.9 * getattr(system, field)
    with pytest.raises(ConfigError, match="has no field 'gravity'"):
        GameConfig(controllers={"name": name, "gravity": 9.81})


# --- flight -----------------------------------------------------------------------------------------------------------


@pytest.fixture
def scene(name):
    """Return states of three games of 12 drones, both teams' commands, and a function that solves 0.5 s into them."""
    generator = np.random.default_rng(0)
    commands = [sampled(name, game_of(name, 12), generator, 3) for _ in range(2)]

    def solved(state, commands, **controller):
        return solve(game_of(name, 12, controller=ControllerConfig(**controller)), state, commands, 0.5)

    return random_states(generator, 3, 12), commands, solved


def test_it_knows_nothing_of_its_opponents(scene):
    state, commands, solve = scene
    moved, theirs = random_states(np.random.default_rng(9), 3, 12), (state.teams == 1)[..., None]
    places, speeds = (np.where(theirs, *both) for both in zip(moved[:2], state[:2], strict=True))
    one, other = solve(state, commands), solve(State(places, speeds, state.teams), [commands[0], commands[1][::-1]])
    np.testing.assert_array_equal(one[state.teams == 0], other[state.teams == 0])


def test_a_drone_that_hears_nobody_depends_on_nobody(scene):
    state, commands, solve = scene
    one = solve(state, commands, communication_radius=0.0)
    moved = random_states(np.random.default_rng(9), 3, 12)
    for array, other in zip(moved[:2], state[:2], strict=True):
        array[:, 4] = other[:, 4]
    np.testing.assert_array_equal(one[:, 4], solve(moved, commands, communication_radius=0.0)[:, 4])


def test_the_teams_can_be_exchanged_and_drones_be_permuted(scene, name):
    state, commands, solve = scene
    order, soft = np.random.default_rng(9).permutation(12), {"control_weight": 20.0, "max_acceleration": 100.0}
    one = solve(state, commands, **soft)
    other = solve(state._replace(teams=1 - state.teams), commands[::-1], **soft)
    np.testing.assert_allclose(one, other, atol=1e-4 * np.abs(one).max())
    if system_of(name).takes == "accelerations":  # drone by drone
        commands = [command[:, order] for command in commands]
    other = solve(State(*(array[:, order] for array in state)), commands, **soft)
    np.testing.assert_allclose(one[:, order], other, atol=1e-4 * np.abs(one).max())


def turn_vectors(vectors, symmetry, about=0.0):
    """Turn vectors (..., 2) about 0, or places about the square's middle."""
    turned = np.array(vectors)[..., ::-1] if symmetry == "exchanged" else np.array(vectors)
    if symmetry == "flipped":
        turned[..., 0] = 2 * about - turned[..., 0]
    return turned


def turn_commands(commands, turns, symmetry):
    """Turn a system's commands, as its `turns` says."""
    if turns == "images":  # (..., A, A), [row = y, column = x]
        return commands[..., ::-1] if symmetry == "flipped" else np.swapaxes(commands, -1, -2)
    middle = {"places": 0.5, "vectors": 0.0}[turns]
    return np.concatenate([turn_vectors(commands[..., :2], symmetry, middle), commands[..., 2:]], axis=-1)


# Not formations: the mirror image of a command need not be a command.
@pytest.mark.parametrize("name", [name for name in SYSTEMS if system_of(name).turns], indirect=True)
@pytest.mark.parametrize("symmetry", ["flipped", "exchanged"])  # x flipped, or x and y exchanged: these generate all
def test_symmetries_of_the_square(scene, name, symmetry):
    state, commands, solve = scene
    turns, soft = system_of(name).turns, {"control_weight": 20.0, "max_acceleration": 100.0}
    turned = State(turn_vectors(state.positions, symmetry, 0.5), turn_vectors(state.velocities, symmetry), state.teams)
    one = turn_vectors(solve(state, commands, **soft), symmetry)
    other = solve(turned, [turn_commands(command, turns, symmetry) for command in commands], **soft)
    np.testing.assert_allclose(one, other, atol=1e-3 * np.abs(one).max())


def test_no_state_is_too_odd(name):
    assert find_not_finite(name, 200, seed=1) == 0


# --- bit for bit ------------------------------------------------------------------------------------------------------


def play(simulator, streams, seconds=2):
    """Fly the first command, then send random ones every second, drawn per game, of the kind that a system takes."""
    generators, config = [np.random.default_rng(stream) for stream in streams], simulator.config
    simulator.advance(7)
    for _ in range(seconds):
        for team, (row, generator) in itertools.product(range(2), enumerate(generators)):
            simulator.command(team, sampled(simulator.controller_of(row, team), config, generator, 1), rows=[row])
        simulator.advance(30)


def test_a_game_is_the_same_alone_in_any_row_with_any_threads_and_from_a_snapshot(name):
    config = GameConfig(controllers=name, controller=ControllerConfig(communication_radius=0.3))
    batch, alone, copy = Simulator(config, num_games=4, threads=2), Simulator(config), Simulator(config)
    batch.reset(range(4))
    play(batch, range(4))
    alone.reset([3])
    play(alone, [3])
    assert_same(batch.snapshot([3]), alone.games)
    assert all(np.isfinite(array).all() for array in batch.games)
    assert batch.targets.sum(axis=(2, 3)) == pytest.approx(1.0)
    saved = batch.snapshot([3])
    for _ in range(2):  # the second time, it has already solved at that tick
        copy.restore(saved)
        copy.advance(1)
    copy.restore(saved)
    for one in (batch, copy):
        one.advance(47)
    assert_same(batch.snapshot([3]), copy.games)
    batch.close()


PAIRS = pytest.mark.parametrize(
    "pair", [("ergodic", "flocking"), ("direct", "potential_field"), ("formation", "coverage")], ids="-".join
)


@PAIRS
def test_sides_that_are_swapped_swap_systems_and_a_batch_holds_both_games_of_a_pair(pair):
    both = Simulator(GameConfig(controllers=pair), num_games=2)
    both.reset([3, 3], swapped=[False, True])
    assert [[both.controller_of(row, team) for team in range(2)] for row in range(2)] == [list(pair), list(pair[::-1])]
    play(both, [3, 3])
    for row, controllers in enumerate((pair, pair[::-1])):
        alone = Simulator(GameConfig(controllers=controllers))
        alone.reset([3])
        play(alone, [3])
        assert_same(both.snapshot([row]), alone.games, but="flown_by")  # its values depend on the configuration


@PAIRS
def test_each_team_is_flown_by_its_own_system_and_by_no_other(pair):
    generator = np.random.default_rng(3)
    state, config = random_states(generator, 4, 16), game_of(pair, 16, controller=SOFT)
    commands = [sampled(one, config, generator, 4) for one in pair]
    mixed = solve(config, state, commands)
    for team, one in enumerate(pair):
        own, alone = state.teams == team, [None, None]
        alone[team] = commands[team]
        single, other = (solve(config.replace(controllers=system), state, mine)
                         for system, mine in ((one, alone), (pair[1 - team], [None, None])))  # fmt: skip
        # Another system beside it may change the order of sums.
        np.testing.assert_allclose(mixed[own], single[own], atol=1e-4 * max(1.0, np.abs(mixed[own]).max()))
        assert (np.abs(mixed[own] - other[own]).max(axis=1) > 1e-3).any()


# --- wrappers --------------------------------------------------------------------------------------------------------


def test_every_wrapper_takes_its_commands(name):
    parallel_api_test(parallel_env(drones_per_team=3, max_cycles=2, controllers=name), num_cycles=4)
    options = {"drones_per_team": 3, "max_cycles": 2, "controllers": (name, "ergodic")}
    if system_of(name).named(GameConfig()):
        check_env(DuelEnv(**options, action="discrete"), skip_render_check=True)
    else:
        with pytest.raises(ConfigError, match=f"the control system {name} has none"):
            DuelEnv(**options, action="discrete")
    learners = SwarmVecEnv(GameConfig(controllers=(name, "ergodic"), drones_per_team=3), 2, seed=0)
    assert (learners.action_space.low == -1.0).all() and (learners.action_space.high == 1.0).all()
    learners.reset()
    _, rewards, _, _ = learners.step(np.stack([learners.action_space.sample() for _ in range(2)]))
    assert np.isfinite(rewards).all()
    learners.close()
