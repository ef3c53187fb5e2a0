"""What every control system keeps to: one that is registered is tried without a test of its own.

What must not matter does not matter, over one solve, up to rounding; what is decided by seed and commands is so bit for
bit; no state of a game is too odd; and every wrapper takes its commands.
"""

from __future__ import annotations

import dataclasses
import itertools
import math

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test, seed_test

from swarm_pz import env, parallel_env
from swarm_pz.config import ControllerConfig, GameConfig, ObservationConfig
from swarm_pz.config.registry import registered, system_class, system_of
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.evaluation import play_match
from swarm_pz.kernels.game import Games
from swarm_pz.simulator import Simulator
from swarm_pz.training.vec_env import SwarmVecEnv
from tests.systems.flights import SOFT, State, find_not_finite, game_of, put, random_states, sampled, solve

SYSTEMS = sorted(registered())


@pytest.fixture(params=SYSTEMS)
def name(request):
    return request.param


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


@pytest.mark.parametrize("bad", ["nan", "infinity", "above", "below", "shape", "words", None, 7.5], ids=str)
def test_what_is_no_command_is_refused_and_changes_nothing_even_if_only_one_of_several_is_none(name, bad):
    config = GameConfig(controllers=name)
    system, simulator = system_of(name), Simulator(config, num_games=3)
    simulator.reset(range(3))
    space = system.space(config)
    command = system.default(config)
    values = {"nan": np.nan, "infinity": np.inf, "above": space.high.max() + 1.0, "below": space.low.min() - 1.0}
    if bad in values:
        command = command.copy()
        command.flat[0] = values[bad]
    elif bad == "shape":
        command = np.zeros((*space.shape, 2, 1))
    else:
        command = bad
    before = simulator.snapshot()
    good = sampled(name, config, np.random.default_rng(0), 2)
    with pytest.raises(CommandError):
        system.parse(command, config)
    with pytest.raises(CommandError, match="red's command"):
        simulator.command(0, [good[0], command, good[1]])
    with pytest.raises(CommandError):
        system.parse_all([command], 1, config, "commands")
    for field, array, then in zip(Games._fields, simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, then, err_msg=field)


def test_commands_of_another_kind_are_refused_by_names(name):
    simulator = Simulator(GameConfig(controllers=name))
    with pytest.raises(CommandError, match=f"'thoughts' cannot fly {name}, which takes those of kind"):
        simulator.control.read(np.zeros((1, 2)), simulator.games, np.zeros(1, int), 0, "thoughts", "the answer")


def numbers_of(system) -> dict[str, float]:
    """Return other values than the usual ones for those of a system's numbers that are real."""
    found = {}
    for field in dataclasses.fields(system):
        value = getattr(system, field.name)
        if isinstance(value, float) and value > 0.0:
            found[field.name] = 0.9 * value
    return found


def test_a_configuration_keeps_a_system_with_numbers_of_its_own(name):
    usual = GameConfig(controllers=name)
    assert GameConfig.from_dict(usual.to_dict()) == usual and usual.controllers == name
    assert GameConfig(controllers=system_class(name)()).hash == usual.hash
    for field, value in numbers_of(system_of(name)).items():
        config = GameConfig(controllers=system_class(name)(**{field: value}))
        again = GameConfig.from_dict(config.to_dict())
        assert again == config and again.hash == config.hash != usual.hash
        assert getattr(again.team_systems[0], field) == value
    with pytest.raises(ConfigError, match="has no field 'gravity'"):
        GameConfig(controllers={"name": name, "gravity": 9.81})


# --- flight -----------------------------------------------------------------------------------------------------------


def test_its_first_command_and_others_fly(name):
    config = GameConfig(controllers=name, time_limit=10.0)
    simulator = Simulator(config, num_games=2)
    simulator.reset(range(2))
    generator = np.random.default_rng(0)
    for second in range(4):
        if second:
            simulator.command(second % 2, sampled(name, config, generator, 2))
        simulator.advance(30)
        for field, array in zip(Games._fields, simulator.games, strict=True):
            assert np.isfinite(array).all(), field
        assert np.linalg.norm(simulator.games.accelerations, axis=-1).max() <= 1.0 + 1e-6
        assert simulator.targets.sum(axis=(2, 3)) == pytest.approx(1.0)
    assert simulator.positions.min() >= 0.0 and simulator.positions.max() <= 1.0


@pytest.fixture(params=[0.0, 3.0], ids=["new", "older"])
def scene(name, request):
    """States of three games of 12 drones, commands for both teams, and how to solve."""
    generator = np.random.default_rng(int(request.param))
    config = game_of(name, 12)
    commands = [sampled(name, config, generator, 3) for _ in range(2)]
    return random_states(generator, 3, 12), commands, lambda *scene, **how: solve(name, *scene, request.param, **how)


def test_it_knows_nothing_of_its_opponents(scene):
    state, commands, solve = scene
    one = solve(state, commands)
    moved = random_states(np.random.default_rng(9), 3, 12)
    theirs = (state.teams == 1)[..., None]
    other = solve(
        State(
            np.where(theirs, moved.positions, state.positions),
            np.where(theirs, moved.velocities, state.velocities),
            state.teams,
        ),
        [commands[0], commands[1][::-1]],
    )
    np.testing.assert_array_equal(one[state.teams == 0], other[state.teams == 0])


def test_a_drone_that_hears_nobody_depends_on_nobody(scene):
    state, commands, solve = scene
    deaf = ControllerConfig(communication_radius=0.0)
    one = solve(state, commands, controller=deaf)
    moved = random_states(np.random.default_rng(9), 3, 12)
    for array, other in zip(moved[:2], state[:2], strict=True):
        array[:, 4] = other[:, 4]
    np.testing.assert_array_equal(one[:, 4], solve(moved, commands, controller=deaf)[:, 4])


def test_who_loses_all_messages_flies_as_who_is_alone(scene):
    state, commands, solve = scene
    lost = solve(state, commands, controller=ControllerConfig(message_loss=1.0))
    far = solve(state, commands, controller=ControllerConfig(communication_radius=0.0))
    np.testing.assert_array_equal(lost, far)


def test_the_teams_can_be_exchanged(scene):
    state, commands, solve = scene
    one = solve(state, commands, controller=SOFT)
    other = solve(state._replace(teams=1 - state.teams), commands[::-1], controller=SOFT)
    np.testing.assert_allclose(one, other, atol=1e-4 * np.abs(one).max())


def test_drones_can_be_permuted(scene, name):
    state, commands, solve = scene
    order = np.random.default_rng(9).permutation(12)
    one = solve(state, commands, controller=SOFT)
    if system_of(name).takes == "accelerations":  # drone by drone
        commands = [command[:, order] for command in commands]
    other = solve(State(*(array[:, order] for array in state)), commands, controller=SOFT)
    np.testing.assert_allclose(one[:, order], other, atol=1e-4 * np.abs(one).max())


SYMMETRIES = pytest.mark.parametrize("symmetry", list(itertools.product((False, True), repeat=3)), ids=str)
"""Of the square: whether x is flipped, then y, and then both are exchanged."""


def turn_vectors(vectors, symmetry, about=0.0):
    """Turn vectors (..., 2) about 0, or places about the square's middle."""
    flip_x, flip_y, exchanged = symmetry
    turned = np.array(vectors)
    for axis, flipped in ((0, flip_x), (1, flip_y)):
        if flipped:
            turned[..., axis] = 2 * about - turned[..., axis]
    return turned[..., ::-1].copy() if exchanged else turned


def turn_images(images, symmetry):
    """Turn images (..., A, A), `[row = y, column = x]`."""
    flip_x, flip_y, exchanged = symmetry
    turned = images[..., ::-1] if flip_x else images
    turned = turned[..., ::-1, :] if flip_y else turned
    return np.swapaxes(turned, -1, -2) if exchanged else turned


def turn_commands(commands, turns, symmetry):
    """Turn a system's commands, as its `turns` says."""
    if turns == "images":
        return turn_images(commands, symmetry)
    middle = {"places": 0.5, "vectors": 0.0}[turns]
    return np.concatenate([turn_vectors(commands[..., :2], symmetry, middle), commands[..., 2:]], axis=-1)


# Of formations, whose commands need no mirror image, their own tests say which have one.
@pytest.mark.parametrize("name", [name for name in SYSTEMS if system_of(name).turns], indirect=True)
@SYMMETRIES
def test_symmetries_of_the_square(scene, name, symmetry):
    state, commands, solve = scene
    turns = system_of(name).turns
    turned = State(turn_vectors(state.positions, symmetry, 0.5), turn_vectors(state.velocities, symmetry), state.teams)
    one = turn_vectors(solve(state, commands, controller=SOFT), symmetry)
    other = solve(turned, [turn_commands(command, turns, symmetry) for command in commands], controller=SOFT)
    np.testing.assert_allclose(one, other, atol=1e-3 * np.abs(one).max())


def test_no_state_is_too_odd(name):
    assert find_not_finite(name, 1000, seed=1) == 0


COORDINATES = st.floats(0.0, 1.0, width=32) | st.sampled_from([0.0, 0.05, 0.5, 1.0])
SPEEDS = st.floats(-10.0, 10.0, width=32) | st.just(0.0)


@pytest.mark.parametrize("name", SYSTEMS)
@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_accelerations_are_finite_in_any_state(name, data):
    state = State(
        data.draw(arrays.arrays(np.float32, (1, 4, 2), elements=COORDINATES)),
        data.draw(arrays.arrays(np.float32, (1, 4, 2), elements=SPEEDS)),
        data.draw(arrays.arrays(np.int8, (1, 4), elements=st.integers(0, 1))),
    )
    accelerations = solve(name, state)
    assert np.linalg.norm(accelerations, axis=2).max() <= 1.0 + 1e-5


# --- bit for bit ------------------------------------------------------------------------------------------------------


def play(simulator, streams, seconds=4):
    """Send random commands every second to every team, drawn per game, of the kind that its system takes."""
    generators, config = [np.random.default_rng(stream) for stream in streams], simulator.config
    for _ in range(seconds):
        for team, (row, generator) in itertools.product(range(2), enumerate(generators)):
            simulator.command(team, sampled(simulator.controller_of(row, team), config, generator, 1), rows=[row])
        simulator.advance(30)


def assert_same_game(one, row, other, other_row):
    for field, array, other_array in zip(Games._fields, one.games, other.games, strict=True):
        if field == "flown_by":  # numbers of the configuration, not of systems
            continue
        np.testing.assert_array_equal(array[row], other_array[other_row], err_msg=field)


@pytest.mark.parametrize("options", [{}, {"communication_radius": 0.3, "message_loss": 0.2}], ids=["all", "some"])
def test_a_game_is_the_same_alone_in_any_row_and_with_any_threads(name, options):
    config = GameConfig(controllers=name, controller=ControllerConfig(**options))
    batch = Simulator(config, num_games=6, threads=2)
    batch.reset(range(6))
    play(batch, range(6), 3)
    for row in (0, 5):
        alone = Simulator(config)
        alone.reset([row])
        play(alone, [row], 3)
        assert_same_game(batch, row, alone, 0)
    batch.close()


def test_a_game_goes_on_from_a_snapshot_bit_for_bit(name):
    simulator = Simulator(GameConfig(controllers=name), num_games=2)
    simulator.reset(range(2))
    play(simulator, range(2), 2)
    other = Simulator(simulator.config)
    other.restore(simulator.snapshot([1]))
    simulator.advance(47)
    other.advance(47)
    assert_same_game(simulator, 1, other, 0)


PAIRS = pytest.mark.parametrize(
    "pair",
    [pair for name in SYSTEMS if name != "ergodic" for pair in (("ergodic", name), (name, "ergodic"))],
    ids="-".join,
)


@PAIRS
def test_sides_that_are_swapped_swap_systems_and_a_batch_holds_both_games_of_a_pair(pair):
    both = Simulator(GameConfig(controllers=pair), num_games=2)
    both.reset([3, 3], swapped=[False, True])
    assert [[both.controller_of(row, team) for team in range(2)] for row in range(2)] == [list(pair), list(pair[::-1])]
    kept = Simulator(both.config)
    kept.restore(both.snapshot([1]))
    play(both, [3, 3], 2)
    for row, controllers in enumerate((pair, pair[::-1])):
        alone = Simulator(GameConfig(controllers=controllers))
        alone.reset([3])
        play(alone, [3], 2)
        assert_same_game(both, row, alone, 0)
    play(kept, [3], 2)
    assert_same_game(both, 1, kept, 0)


@PAIRS
def test_each_team_is_flown_by_its_own_system_and_by_no_other(pair):
    generator = np.random.default_rng(3)
    state, config = random_states(generator, 4, 16), game_of(pair, 16)
    commands = [sampled(one, config, generator, 4) for one in pair]

    def fly(systems):
        simulator = Simulator(game_of(systems, 16, controller=SOFT), 4)
        put(simulator, state)
        for team, one in enumerate(pair):
            if systems in (pair, one):
                simulator.command(team, commands[team])
        simulator.advance(1)
        return simulator.games.accelerations.copy()

    mixed = fly(pair)
    for team, one in enumerate(pair):
        own = state.teams == team
        # Sums may take another order beside another system.
        np.testing.assert_allclose(mixed[own], fly(one)[own], atol=1e-4 * max(1.0, np.abs(mixed[own]).max()))
        assert (np.abs(mixed[own] - fly(pair[1 - team])[own]).max(axis=1) > 1e-3).any()


# --- wrappers --------------------------------------------------------------------------------------------------------


def test_pettingzoos_own_tests_hold(name):
    quick = {"controllers": name, "drones_per_team": 3, "max_cycles": 10}
    parallel_api_test(parallel_env(**quick), num_cycles=20)
    parallel_seed_test(lambda: parallel_env(**quick), num_cycles=5)
    # It sends zeros, which not all commands may be.
    holds_zeros = not system_of(name).space(GameConfig(drones_per_team=3)).low.max() > 0.0
    api_test(env(**quick, action="command" if holds_zeros else "normalised"), num_cycles=20)
    seed_test(lambda: env(**quick), num_cycles=5)


# Commands in their own units need not be symmetric; who learns takes them normalised.
@pytest.mark.filterwarnings("ignore:.*we recommend using a symmetric and normalized space:UserWarning")
@pytest.mark.parametrize("action", ["command", "normalised", "discrete"])
def test_gymnasiums_own_test_holds(name, action):
    if action == "discrete" and not system_of(name).named(GameConfig()):
        with pytest.raises(ConfigError, match=f"the control system {name} has none"):
            gymnasium.make("swarm_pz/Capture-v0", action=action, controllers=(name, "ergodic"))
        return
    quick = {"controllers": (name, "ergodic"), "drones_per_team": 3, "max_cycles": 5, "action": action}
    made = gymnasium.make("swarm_pz/Capture-v0", **quick)
    check_env(made.unwrapped, skip_render_check=True)


def test_a_learner_of_stable_baselines3_learns_unwrapped(name):
    from stable_baselines3 import PPO

    observation = ObservationConfig(grid=10, channels=("own_positions", "opposing_positions"))
    config = GameConfig(controllers=(name, "ergodic"), drones_per_team=3, time_limit=5.0, observation=observation)
    envs = SwarmVecEnv(config, 4, seed=0)
    assert (envs.action_space.low == -1.0).all() and (envs.action_space.high == 1.0).all()
    learner = PPO("MlpPolicy", envs, n_steps=8, batch_size=16, n_epochs=1, seed=0, device="cpu")
    before = [parameter.detach().clone() for parameter in learner.policy.parameters()]
    learner.learn(32)
    assert learner._n_updates == 1
    assert any((one != other).any() for one, other in zip(before, learner.policy.parameters(), strict=True))
    assert math.isfinite(float(np.asarray(envs.reset()).sum()))
    result = play_match(learner, "uniform", games=2, config=config)
    assert {game.side for game in result.games} == {"red", "blue"} and not result.forfeits
    envs.close()
