"""What every controller keeps to: one that is added to the list is tried without a test of its own.

What must not matter does not matter, over one control period, up to rounding; what is decided by seed and commands is
so bit for bit; and no state of a game is too odd.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from swarm_pz.config import ControllerConfig, GameConfig
from swarm_pz.kernels.controllers import CONTROLLERS, NUMBERS
from swarm_pz.kernels.controllers.ergodic import ergodic, make_scratch
from swarm_pz.kernels.game import Games, swarm_of
from swarm_pz.kernels.profiling import solve
from swarm_pz.simulator import Simulator
from tests.kernels.controllers.mirrors import MIRRORS
from tests.kernels.states import PEACE, SOFT, put, random_state, solved


@pytest.fixture(params=list(CONTROLLERS))
def name(request):
    return request.param


PAIRS = pytest.mark.parametrize("pair", list(itertools.permutations(CONTROLLERS, 2)), ids="-".join)


def test_the_list_holds_what_a_configuration_can_name():
    assert tuple(CONTROLLERS) == tuple(NUMBERS)
    assert list(NUMBERS.values()) == list(range(len(CONTROLLERS)))
    assert {parts.target for parts in CONTROLLERS.values()} <= set(Games._fields)


@pytest.fixture
def one_period(name):
    simulator = Simulator(GameConfig(controllers=name))

    def advance(positions, velocities, teams, commands):
        """Return (positions, velocities, teams) after a control period."""
        simulator.reset([0], scenario={"positions": positions, "velocities": velocities, "teams": teams})
        simulator.command(0, commands[None, 0])
        simulator.command(1, commands[None, 1])
        simulator.advance(3)
        return simulator.positions[0].copy(), simulator.velocities[0].copy(), simulator.teams[0].copy()

    return advance


@pytest.fixture(params=range(5))
def state(request):
    generator = np.random.default_rng(request.param)
    return (
        generator.random((20, 2)) * 0.9 + 0.05,
        generator.normal(size=(20, 2)) * 0.2,
        np.arange(20) % 2,
        generator.random((2, 10, 10)),
    )


def test_team_swap(one_period, state):
    positions, velocities, teams, commands = state
    one = one_period(positions, velocities, teams, commands)
    other = one_period(positions, velocities, 1 - teams, commands[::-1])
    np.testing.assert_allclose(one[0], other[0], atol=1e-5)
    np.testing.assert_array_equal(one[2], 1 - other[2])


def test_drone_permutation(one_period, state):
    positions, velocities, teams, commands = state
    order = np.random.default_rng(9).permutation(20)
    one = one_period(positions, velocities, teams, commands)
    other = one_period(positions[order], velocities[order], teams[order], commands)
    np.testing.assert_allclose(one[0][order], other[0], atol=1e-5)
    np.testing.assert_array_equal(one[2][order], other[2])


@pytest.mark.parametrize("flip_x", [False, True])
@pytest.mark.parametrize("flip_y", [False, True])
@pytest.mark.parametrize("transpose", [False, True])
def test_symmetries_of_the_square(one_period, state, flip_x, flip_y, transpose):
    positions, velocities, teams, commands = state

    def turn_points(points, is_position):
        points = np.array(points, dtype=float)
        for axis, flip in ((0, flip_x), (1, flip_y)):
            if flip:
                points[:, axis] = (1.0 if is_position else 0.0) - points[:, axis]
        return points[:, ::-1] if transpose else points

    turned = commands[:, :, ::-1] if flip_x else commands
    turned = turned[:, ::-1] if flip_y else turned
    turned = turned.transpose(0, 2, 1) if transpose else turned
    one = one_period(positions, velocities, teams, commands)
    other = one_period(turn_points(positions, True), turn_points(velocities, False), teams, turned)
    np.testing.assert_allclose(turn_points(one[0], True), other[0], atol=1e-5)
    np.testing.assert_allclose(turn_points(one[1], False), other[1], atol=1e-4)
    np.testing.assert_array_equal(one[2], other[2])


# --- bit for bit ------------------------------------------------------------------------------------------------------


def play(simulator, streams, seconds=4):
    """Send random commands every second, drawn per game."""
    generators = [np.random.default_rng(stream) for stream in streams]
    for _ in range(seconds):
        simulator.advance(30, np.stack([generator.random((2, 10, 10)) ** 8 for generator in generators]))


def assert_same_game(one, row, other, other_row):
    for field, array, other_array in zip(Games._fields, one.games, other.games, strict=True):
        np.testing.assert_array_equal(array[row], other_array[other_row], err_msg=field)


def test_a_game_is_the_same_alone_in_any_row_and_with_any_threads(name):
    config = GameConfig(controllers=name)
    batch = Simulator(config, num_games=6, threads=2)
    batch.reset(range(6))
    play(batch, range(6))
    for row in (0, 2, 5):
        alone = Simulator(config)
        alone.reset([row])
        play(alone, [row])
        assert_same_game(batch, row, alone, 0)


@PAIRS
def test_sides_that_are_swapped_swap_controllers_and_a_batch_holds_both_games_of_a_pair(pair):
    both = Simulator(GameConfig(controllers=pair), num_games=2)
    both.reset([3, 3], swapped=[False, True])
    assert [[both.controller_of(row, team) for team in range(2)] for row in range(2)] == [list(pair), list(pair[::-1])]
    kept = Simulator(both.config)
    kept.restore(both.snapshot([1]))
    play(both, [3, 3])
    for row, controllers in enumerate((pair, pair[::-1])):
        alone = Simulator(GameConfig(controllers=controllers))
        alone.reset([3])
        play(alone, [3])
        assert_same_game(both, row, alone, 0)
    play(kept, [3])
    assert_same_game(both, 1, kept, 0)


# --- whom it moves, and how -------------------------------------------------------------------------------------------


@PAIRS
def test_each_team_is_flown_by_its_own_controller_and_by_no_other(pair):
    generator = np.random.default_rng(3)
    for _ in range(5):
        state = random_state(generator, 16)
        mixed = solved(state, controllers=pair, controller=SOFT).games.accelerations[0]
        for team, name in enumerate(pair):
            own = state.teams == team
            pure, other = (
                solved(state, controllers=one, controller=SOFT).games.accelerations[0] for one in (name, pair[1 - team])
            )
            # Sums may take another order beside another controller.
            np.testing.assert_allclose(mixed[own], pure[own], atol=1e-4)
            assert (np.abs(mixed[own] - other[own]).max(axis=1) > 1e-2).any()


def odd_states():
    """States that games come to seldom: crowds at a point or a wall, at rest or too fast, one drone, one team."""
    generator = np.random.default_rng(4)
    for drones, spread in itertools.product((1, 2, 12), (1.0, 0.01, 0.0)):
        state = random_state(generator, drones, spread)
        yield state
        state.velocities[:] = 0.0
        yield state
        state.velocities[:] = generator.normal(size=(drones, 2)) * 10
        state.positions[:] = np.round(state.positions)
        yield state
        state.memory[:], state.memory_weight[:] = 0.0, 0.0
        state.teams[:] = 1
        state.commands[:] = 0.0
        yield state


def test_no_state_is_too_odd(name):
    for state in odd_states():
        drones = len(state.teams)
        simulator = Simulator(GameConfig(drones_per_team=(drones, 0), capture=PEACE, controllers=name))
        put(simulator, state._replace(velocities=np.clip(state.velocities, -10.0, 10.0)))
        for ticks in (1, 30):
            simulator.advance(ticks)
            for field, array in zip(Games._fields, simulator.games, strict=True):
                assert np.isfinite(array).all(), field
            assert np.linalg.norm(simulator.games.accelerations, axis=-1).max() <= 1.0 + 1e-6


def test_its_kernel_alone_does_what_the_game_does_and_writes_but_memories_and_accelerations(name):
    parts, state = CONTROLLERS[name], random_state(np.random.default_rng(5), 12)
    flown = solved(state, controllers=name, controller=SOFT)
    start = Simulator(flown.config)
    put(start, state)
    games = start.snapshot()
    games.accelerations[:] = np.nan
    if parts.kernel is ergodic:  # which takes long to compile, and is kept so
        solve(games, start.controller)
    else:
        target, parameters = getattr(games, parts.target)[0], parts.parameters(start.config)
        parts.kernel(swarm_of(games, 0), target, parameters, make_scratch(12, start.controller))
    np.testing.assert_allclose(games.accelerations, flown.games.accelerations, rtol=1e-4, atol=1e-4)
    written = {"memory", "memory_weight", "accelerations"}
    for field, array, before in zip(Games._fields, games, start.games, strict=True):
        assert field in written or (array == before).all(), field


@pytest.mark.parametrize("name", [name for name in CONTROLLERS if name in MIRRORS])
@pytest.mark.parametrize("controller", [SOFT, ControllerConfig()], ids=["free", "saturated"])
def test_it_does_what_its_slow_mirror_does(name, controller):
    generator, compared, drones = np.random.default_rng(0), 0, 0
    for _ in range(40):
        state = random_state(generator, int(generator.integers(1, 31)), spread=float(generator.choice([0.05, 0.3, 1])))
        state.velocities[: generator.integers(3)] = 0.0
        simulator = solved(state, controllers=name, controller=controller)
        compared += MIRRORS[name](simulator, state)
        drones += len(state.teams)
    assert compared > 0.9 * drones
