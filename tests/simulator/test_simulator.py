from __future__ import annotations

import concurrent.futures
import copy
import itertools
import os
import pickle
import threading
from collections import deque

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm_pz.config import BLUE, RED, CaptureConfig, ControllerConfig, DynamicsConfig, GameConfig, MemoryConfig
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.kernels.game import advance_games
from swarm_pz.simulator import Simulator
from swarm_pz.systems import FlockingCommand
from tests.reference import cell_of


def play(simulator: Simulator, seconds: int, streams: list[int]) -> None:
    """Send random commands every second, drawn per game, so that batches cannot share them."""
    generators = [np.random.default_rng(stream) for stream in streams]
    for _ in range(seconds):
        commands = np.stack([generator.random((2, 10, 10)) ** 8 for generator in generators])
        simulator.command(0, commands[:, 0])
        simulator.command(1, commands[:, 1])
        simulator.advance(30)


def assert_same_game(one: Simulator, row: int, other: Simulator, other_row: int) -> None:
    for name, array, other_array in zip(one.games._fields, one.games, other.games, strict=True):
        np.testing.assert_array_equal(array[row], other_array[other_row], err_msg=name)


def test_a_row_of_a_batch_is_the_game_alone_and_threads_change_nothing():
    seeds = list(range(8))
    batch = Simulator(num_games=8, threads=2)
    batch.reset(seeds)
    play(batch, 30, seeds)
    for row in (0, 3, 7):
        alone = Simulator()
        alone.reset([row])
        play(alone, 30, [row])
        assert_same_game(batch, row, alone, 0)


def test_a_snapshot_continues_bit_for_bit_in_any_row():
    simulator = Simulator(num_games=3)
    simulator.reset([1, 2, 3])
    play(simulator, 5, [1, 2, 3])
    saved = simulator.snapshot(rows=[1])
    play(simulator, 5, [4, 5, 6])
    other = Simulator(num_games=2)
    other.restore(saved)
    play(other, 5, [5, 5])
    assert_same_game(simulator, 1, other, 0)
    assert_same_game(simulator, 1, other, 1)


def test_a_snapshot_of_another_game_is_refused_and_nothing_changes():
    simulator = Simulator(num_games=2)
    before = simulator.snapshot()
    with pytest.raises(CommandError, match="snapshot must hold 1 or 2 games"):
        simulator.restore(Simulator(GameConfig(drones_per_team=3), num_games=2).snapshot())
    with pytest.raises(CommandError, match="snapshot must hold 1 or 2 games"):
        simulator.restore(Simulator(num_games=3).snapshot())
    with pytest.raises(CommandError, match=r"snapshot must be what Simulator\.snapshot returned, got NoneType None"):
        simulator.restore(None)
    broken = [("teams", 2), ("teams", -1), ("trails", 2500), ("trails", -2), ("ticks", -1), ("positions", 1.5)]
    for name, value in (*broken, *itertools.product(("positions", "velocities"), (np.nan, np.inf, -1e30))):
        with pytest.raises(CommandError, match=rf"^snapshot's {name} must be in \["):
            simulator.restore(before._replace(**{name: np.full_like(getattr(before, name), value)}))
    with pytest.raises(CommandError, match="flown_by must be of"):
        simulator.restore(before._replace(flown_by=np.full((2, 2), 127, np.int8)))
    for array, copied in zip(simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, copied)


def test_drones_start_at_rest_near_corners_with_distinct_altitudes():
    simulator = Simulator(num_games=50)
    simulator.reset(range(50))
    corners = np.array([[x, y] for x in (0.1, 0.9) for y in (0.1, 0.9)])
    distance = np.linalg.norm(simulator.positions[:, :, None] - corners, axis=-1)
    assert distance.min(axis=-1).max() <= 0.08 + 1e-6
    assert {int(corner) for corner in distance.argmin(axis=-1).ravel()} == {0, 1, 2, 3}
    assert not simulator.velocities.any()
    assert all(len(set(row)) == 20 for row in simulator.altitudes.tolist())
    np.testing.assert_array_equal(simulator.sizes, 10)
    assert not simulator.occupancy.any()


def test_unequal_teams_start_as_asked():
    assert Simulator(GameConfig(drones_per_team=(1, 19))).sizes.tolist() == [[1, 19]]


def test_trails_hold_the_cells_of_the_last_ticks():
    config = GameConfig(drones_per_team=3, capture=CaptureConfig(enabled=False), memory=MemoryConfig(trail=1.0))
    simulator = Simulator(config)
    simulator.reset([5])
    trails = [deque(maxlen=30) for _ in range(6)]
    for _ in range(75):
        simulator.advance(1)
        for trail, position in zip(trails, simulator.positions[0], strict=True):
            trail.append(cell_of(position))
        occupancy = np.zeros((2, 50, 50), np.int64)
        for trail, team in zip(trails, simulator.teams[0], strict=True):
            for row, column in trail:
                occupancy[team, row, column] += 1
        np.testing.assert_array_equal(simulator.occupancy[0], occupancy)


def test_a_decided_game_stays_as_it_is():
    simulator = Simulator(GameConfig(drones_per_team=2), num_games=2)
    simulator.reset(
        [0, 1], scenario={"positions": [[0.5, 0.5], [0.1, 0.1], [0.9, 0.9], [0.9, 0.1]], "teams": [0, 0, 1, 1]}
    )
    simulator.games.teams[0] = 1  # all blue
    before = simulator.snapshot()
    simulator.advance(10)
    assert simulator.games.ticks.tolist() == [0, 10]
    for array, copied in zip(simulator.games, before, strict=True):
        np.testing.assert_array_equal(array[0], copied[0])


def test_advance_takes_ticks_for_each_game():
    simulator = Simulator(num_games=3)
    simulator.advance([0, 3, 7])
    assert simulator.games.ticks.tolist() == [0, 3, 7]


@pytest.mark.parametrize("ticks", [-1, 1.5, [1, 2], "three", None])
def test_bad_ticks_are_refused(ticks):
    simulator = Simulator(num_games=3)
    with pytest.raises(CommandError, match="ticks must be whole"):
        simulator.advance(ticks)


def test_bad_commands_leave_the_game_as_it_was():
    simulator = Simulator()
    before = simulator.snapshot()
    for team, command in ((0, np.full((1, 10, 10), np.nan)), (1, np.ones((10, 10))), (2, np.ones((1, 10, 10)))):
        with pytest.raises(CommandError):
            simulator.command(team, command)
    for array, copied in zip(simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, copied)


@pytest.mark.parametrize(
    ("scenario", "message"),
    [
        ({"positions": np.full((20, 2), 1.5)}, "scenario positions"),
        ({"positions": np.full((20, 2), np.nan)}, "scenario positions"),
        ({"positions": [[0.5, 0.5]]}, r"got shape \(1, 2\)"),
        ({"velocities": "fast"}, "scenario velocities"),
        ({"teams": [0] * 20}, "at least one of each"),
        ({"teams": [2] * 20}, "scenario teams"),
        ({"positions": np.ma.masked_all((20, 2))}, "scenario positions .* got a masked array"),
        ({"positions": np.zeros((20, 2), "datetime64[s]")}, "got numbers of type datetime64"),
        ({"positions": np.full((20, 2), 0.5 + 0j)}, "got numbers of type complex128"),
    ],
)
def test_bad_scenarios_are_refused_and_nothing_changes(scenario, message):
    simulator = Simulator()
    simulator.reset([7])
    before = simulator.snapshot()
    with pytest.raises(CommandError, match=message):
        simulator.reset([8], scenario=scenario)
    for array, copied in zip(simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, copied)


@pytest.mark.parametrize("seeds", [[-1], ["a"], [1, 2], [1.5]])
def test_bad_seeds_are_refused(seeds):
    with pytest.raises(CommandError, match="seed"):
        Simulator().reset(seeds)


def test_bad_sizes_of_the_simulator_are_refused():
    with pytest.raises(ConfigError, match=r"num_games must be a whole number in \[1, .*, got 0"):
        Simulator(num_games=0)
    with pytest.raises(ConfigError, match="threads"):
        Simulator(threads=0)
    with pytest.raises(CommandError, match="rows"):
        Simulator().reset([0], rows=[1])


@pytest.mark.parametrize("rows", [[False, True], [0.0], ["a"], [-1], [2]])
def test_rows_that_are_not_numbers_of_games_are_refused(rows):
    simulator = Simulator(num_games=2)
    with pytest.raises(CommandError, match=r"rows must be whole numbers in \[0, 2\)"):
        simulator.reset(rows=rows)


def test_a_command_is_the_same_in_any_memory_order():
    command = np.random.default_rng(0).random((1, 10, 10))
    simulators = [Simulator(), Simulator()]
    for simulator, order in zip(simulators, ("C", "F"), strict=True):
        simulator.reset([0])
        simulator.command(0, np.array(command, order=order))
    assert_same_game(simulators[0], 0, simulators[1], 0)


def test_views_cannot_be_written():
    with pytest.raises(ValueError, match="read-only"):
        Simulator().positions[0, 0, 0] = 0.5


@given(seed=st.integers(0, 2**32), red=st.integers(1, 12), blue=st.integers(1, 12))
def test_drones_are_conserved_stay_inside_and_push_no_harder_than_allowed(seed, red, blue):
    simulator = Simulator(GameConfig(drones_per_team=(red, blue)))
    simulator.reset([seed])
    play(simulator, 3, [seed])
    assert simulator.sizes.sum() == red + blue
    assert ((simulator.positions >= 0) & (simulator.positions <= 1)).all()
    assert np.linalg.norm(simulator.games.accelerations, axis=-1).max() <= 1.0 + 1e-6
    assert simulator.occupancy.sum() == (red + blue) * min(int(simulator.games.ticks[0]), 150)
    captured, time = simulator.games.captures[0], simulator.time_s[0]
    assert simulator.sizes[0, 0] == red + captured[0] - captured[1]
    assert time == pytest.approx(3.0) or simulator.decided[0]


def test_a_wall_stops_a_drone_and_takes_its_normal_velocity():
    config = GameConfig(drones_per_team=(1, 0), capture=CaptureConfig(enabled=False))
    simulator = Simulator(config)
    simulator.reset([0], scenario={"positions": [[0.001, 0.5]], "velocities": [[-1.0, 0.3]]})
    simulator.advance(1)
    assert simulator.positions[0, 0, 0] == 0.0
    assert simulator.velocities[0, 0, 0] == 0.0
    assert simulator.velocities[0, 0, 1] > 0.25


@pytest.mark.parametrize("swapped", [1, [True], [[True, False]], [0, 1], "red", None])
def test_who_is_swapped_must_be_said_for_every_game(swapped):
    simulator = Simulator(GameConfig(controllers=("ergodic", "flocking")), num_games=2)
    before = simulator.snapshot()
    with pytest.raises(CommandError, match="swapped must be True or False, once or for each of the 2 games"):
        simulator.reset([0, 1], swapped=swapped)
    for array, copied in zip(simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, copied)


def test_games_that_are_swapped_take_flocking_commands_for_the_other_team():
    simulator = Simulator(GameConfig(controllers=("ergodic", "flocking")), num_games=2)
    simulator.reset([0, 1], swapped=[False, True])
    command = FlockingCommand(position=(0.2, 0.3), weight=60.0)
    simulator.command(1, [command], rows=[0])
    simulator.command(0, [command], rows=[1])
    for team, row in ((0, [0]), (1, [1])):
        with pytest.raises(CommandError, match="for ergodic, which takes density"):
            simulator.command(team, [command], rows=row)
    with pytest.raises(CommandError, match=r"red's command .*for ergodic, which takes density"):
        simulator.command(0, [command] * 2)
    simulator.advance(3)
    np.testing.assert_allclose(simulator.games.commands[[0, 1], [1, 0], :3], [(0.2, 0.3, 60.0)] * 2)


def test_a_team_without_drones_flies_alone():
    config = GameConfig(drones_per_team=(4, 0), capture=CaptureConfig(enabled=False))
    simulator = Simulator(config)
    simulator.reset([0])
    simulator.advance(60)
    assert np.isfinite(simulator.positions).all()
    assert simulator.sizes.tolist() == [[4, 0]]


def test_batches_of_any_size_and_threads_run_the_same_machine_code():
    for games, threads in ((1, 1), (4, 1), (5, 2)):
        simulator = Simulator(num_games=games, threads=threads)
        simulator.reset(range(games))
        simulator.advance(3)
        simulator.advance(np.full(games, 3))
    for _, rows, ticks, *_ in advance_games.signatures:
        assert (rows.layout, rows.mutable, ticks.layout, ticks.mutable) == ("C", True, "C", True)


def test_commands_of_another_shape_do_not_reach_the_kernel():
    simulator = Simulator(num_games=2)
    with pytest.raises(CommandError, match="float64 of shape"):
        simulator.advance(3, np.ones((2, 2, 5, 5)))
    for densities in (np.ones((2, 5, 5)), np.ones((1, 10, 10)), np.ones((2, 10, 10), np.float32)):
        with pytest.raises(CommandError, match="float64 of shape"):
            simulator.command_checked(0, densities, np.arange(2))


def test_a_snapshot_stays_what_it_was_while_the_games_go_on():
    simulator = Simulator(GameConfig(drones_per_team=2), num_games=2)
    simulator.reset([0, 1])
    taken = [simulator.snapshot(), simulator.snapshot([0, 1])]
    simulator.advance(30)
    for snapshot in taken:
        assert (snapshot.ticks == 0).all() and (simulator.games.ticks == 30).all()
        assert not np.array_equal(snapshot.positions, simulator.positions)


EVERYTHING = GameConfig.preset("released").replace(
    drones_per_team=(3, 5),
    controllers=("ergodic", "flocking"),
    time_limit=5.0,
    dynamics=DynamicsConfig(speed_factor=0.8, failure_rate=1.0, repair_rate=1.0),
)
"""Rules with which every array of a game changes, but for the fields of trails."""


@pytest.mark.parametrize("config", [GameConfig(drones_per_team=3), EVERYTHING], ids=["paper", "everything"])
def test_a_game_begun_again_is_as_if_it_was_the_first_and_the_others_go_on(config):
    simulator = Simulator(config, num_games=3)
    simulator.reset([0, 1, 2])
    play(simulator, 3, [0, 1, 2])
    kept = simulator.snapshot()
    simulator.reset([8, 9], rows=[2, 0])
    for row, seed in ((0, 9), (2, 8)):
        first = Simulator(config)
        first.reset([seed])
        assert_same_game(simulator, row, first, 0)
        for name in ("positions", "trails", "memory", "targets", "coefficients", "velocities"):
            assert not np.array_equal(getattr(kept, name)[row], getattr(simulator.games, name)[row]), name
    for name, array, then in zip(kept._fields, simulator.games, kept, strict=True):
        np.testing.assert_array_equal(array[1], then[1], err_msg=name)


def test_both_teams_start_with_a_uniform_target():
    simulator = Simulator(GameConfig(drones_per_team=1, command_cells=5), num_games=2)
    simulator.command(1, np.eye(5)[None], rows=[1])
    simulator.reset([0], rows=[1])
    np.testing.assert_allclose(simulator.targets, 0.04)
    only_the_mean = np.zeros((10, 10))
    only_the_mean[0, 0] = 1.0
    np.testing.assert_allclose(simulator.games.coefficients, np.broadcast_to(only_the_mean, (2, 2, 10, 10)), atol=1e-6)


PEACE = {"drones_per_team": 3, "capture": CaptureConfig(enabled=False)}
RESENT = GameConfig(memory=MemoryConfig(controller_forgotten_on=("capture", "sending")), **PEACE)
UNIFORM, RAMP = np.ones((1, 10, 10)), np.arange(1.0, 101.0).reshape(1, 10, 10) / 100


def weights(simulator: Simulator, row: int = 0) -> list[float]:
    """Return how much the memories of a red drone and of a blue one weigh: solves, where nothing fades."""
    return simulator.games.memory_weight[row, [0, -1]].tolist()


def asked(red, blue):
    return np.concatenate([red, blue])[None]


def test_a_command_that_is_sent_empties_the_memory_be_it_the_same_again():
    simulator = Simulator(RESENT.replace(memory=RESENT.memory.replace(controller=None)), num_games=2)
    simulator.reset([0, 1])
    simulator.advance(30)
    simulator.command(RED, np.repeat(UNIFORM, 2, axis=0))  # which was in force
    simulator.advance(30)
    assert weights(simulator) == [10.0, 20.0]
    simulator.command(BLUE, RAMP, rows=[1])
    simulator.command(RED, RAMP / 2, rows=[0])
    simulator.advance(3)
    assert weights(simulator, 0) == [1.0, 21.0] and weights(simulator, 1) == [11.0, 1.0]
    simulator.command(RED, RAMP, rows=[0])
    saved = simulator.snapshot()
    for _ in range(2):  # a copy knows that something was sent
        simulator.advance(3)
        assert weights(simulator, 0) == [1.0, 22.0] and weights(simulator, 1) == [12.0, 2.0]
        simulator.restore(saved)


def test_a_step_that_asks_for_what_is_in_force_holds_it():
    config = RESENT.replace(memory=RESENT.memory.replace(controller=None))
    simulator = Simulator(config)
    simulator.reset([0])
    expected = [(UNIFORM, [10.0, 10.0]), (UNIFORM / 3, [20.0, 20.0]), (RAMP, [10.0, 30.0]), (RAMP / 2, [20.0, 40.0])]
    for density, solves in expected:
        simulator.advance(30, asked(density, UNIFORM))
        assert weights(simulator) == solves
    simulator.command_checked(RED, RAMP, np.zeros(1, np.int64), holds=True)
    simulator.advance(30)
    assert weights(simulator) == [30.0, 50.0]


def test_a_trail_and_a_memory_are_each_forgotten_on_their_own_occasion():
    for on, kept in (("command", 31), ("sending", 1)):
        memory = MemoryConfig(controller=None, trail=None, trail_forgotten_on=(on,), controller_forgotten_on=())
        simulator = Simulator(GameConfig(memory=memory, **PEACE))
        simulator.reset([0])
        simulator.advance(30)
        simulator.command(RED, UNIFORM)
        simulator.advance(1)
        assert simulator.occupancy[0].sum(axis=(1, 2)).tolist() == [3 * kept, 3 * 31]
        assert weights(simulator) == [11.0, 11.0]


def test_a_target_that_was_sent_has_its_mass_and_that_of_the_start_has_one():
    simulator = Simulator(GameConfig(controller=ControllerConfig(target_mass=10.0), **PEACE))
    plain = Simulator(GameConfig(**PEACE))
    for one in (simulator, plain):
        one.reset([0])
        one.advance(30, asked(UNIFORM, RAMP))
    # Red holds what nobody sent.
    np.testing.assert_array_equal(simulator.games.coefficients[0, RED], plain.games.coefficients[0, RED])
    np.testing.assert_allclose(
        simulator.games.coefficients[0, BLUE], 10.0 * plain.games.coefficients[0, BLUE], rtol=1e-6
    )
    simulator.command(RED, UNIFORM)
    assert simulator.games.coefficients[0, RED, 0, 0] == np.float32(10.0)
    # What was asked for, as a density, is the same.
    np.testing.assert_array_equal(simulator.targets, plain.targets)
    np.testing.assert_allclose(simulator.target_coefficients, plain.target_coefficients, atol=1e-7)
    simulator.reset([1])
    assert simulator.games.coefficients[0, :, 0, 0].tolist() == [1.0, 1.0]


def test_where_nothing_tells_sending_from_holding_games_are_the_same():
    sent, held = Simulator(GameConfig(), num_games=2), Simulator(GameConfig(), num_games=2)
    for simulator in (sent, held):
        simulator.reset([0, 1])
    for density in (RAMP, RAMP, UNIFORM):
        for team in (RED, BLUE):
            sent.command(team, np.repeat(density, 2, axis=0))
        sent.advance(30)
        held.advance(30, np.repeat(asked(density, density), 2, axis=0))
    assert_same_game(sent, 0, held, 0)
    assert_same_game(sent, 1, held, 1)


def test_games_without_seeds_are_all_different():
    simulator, starts = Simulator(num_games=2), []
    for _ in range(2):
        starts += [*simulator.positions.copy()]
        simulator.reset()
    simulator.reset(rows=[1])
    assert len({start.tobytes() for start in [*starts, *simulator.positions]}) == 6


@pytest.mark.parametrize("controllers", ["ergodic", "flocking", ("ergodic", "flocking"), ("flocking", "ergodic")])
@pytest.mark.parametrize("team", [0, 1])
def test_a_command_is_for_the_games_and_the_team_that_it_names(controllers, team):
    config = GameConfig(drones_per_team=2, controllers=controllers)
    simulator = Simulator(config, num_games=4)
    images = np.random.default_rng(0).random((2, 10, 10)) ** 4
    orders = [images]
    if config.team_controllers[team] == "flocking":
        orders.append(
            [FlockingCommand(position=(0.2, 0.7), weight=60.0), FlockingCommand(position=(0.9, 0.1), weight=80)]
        )
    for order in orders:
        simulator.reset(range(4))
        before = simulator.snapshot()
        simulator.command(team, order, rows=[3, 1])
        for name, array, then in zip(before._fields, simulator.games, before, strict=True):
            changed = name in ("targets", "coefficients") or config.team_controllers[team] == "flocking"
            if name in ("targets", "coefficients", "commands"):
                np.testing.assert_array_equal(array[[0, 2]], then[[0, 2]], err_msg=name)
                np.testing.assert_array_equal(array[:, 1 - team], then[:, 1 - team], err_msg=name)
                for row in (1, 3):
                    assert changed != np.array_equal(array[row, team], then[row, team]), name
            else:
                np.testing.assert_array_equal(array, then, err_msg=name)
        for place, row in enumerate((3, 1)):
            alone = Simulator(config)
            alone.reset([row])
            alone.command(team, order[place : place + 1])
            assert_same_game(simulator, row, alone, 0)
    if len(orders) > 1:
        np.testing.assert_allclose(simulator.games.commands[[3, 1], team, :3], [[0.2, 0.7, 60], [0.9, 0.1, 80]])
        targets, centres = simulator.targets[[3, 1], team], (np.arange(10) + 0.5) / 10
        middles = np.stack([targets.sum(axis=1) @ centres, targets.sum(axis=2) @ centres], axis=1)
        np.testing.assert_allclose(middles, [[0.2, 0.7], [0.9, 0.1]], atol=1e-6)
        assert ((targets > 1e-6).sum(axis=(1, 2)) <= 4).all()


def test_commands_with_an_advance_are_for_the_games_that_advance():
    simulator, apart = (Simulator(GameConfig(drones_per_team=2), num_games=4) for _ in range(2))
    for one in (simulator, apart):
        one.reset(range(4))
        one.games.teams[3] = 1  # decided
    commands = np.random.default_rng(0).random((4, 2, 10, 10)) ** 4
    simulator.advance([3, 0, 7, 5], commands)
    for team in range(2):
        apart.command(team, commands[[0, 2], team], rows=[0, 2])
    apart.advance([3, 0, 7, 5])
    assert simulator.games.ticks.tolist() == [3, 0, 7, 0]
    for row in range(4):
        assert_same_game(simulator, row, apart, row)


def test_games_put_back_go_to_the_rows_asked_for():
    simulator = Simulator(GameConfig(drones_per_team=2), num_games=4)
    simulator.reset(range(4))
    begun = simulator.snapshot()
    simulator.restore(simulator.snapshot([3, 0]), rows=[1, 2])
    for name, array, then in zip(begun._fields, simulator.games, begun, strict=True):
        np.testing.assert_array_equal(array, then[[0, 3, 0, 3]], err_msg=name)


@pytest.fixture
def two_processors(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 2)


@pytest.mark.usefixtures("two_processors")
def test_there_are_no_more_threads_than_games_and_processors():
    for games, threads, expected in ((5, 4, 2), (1, 2, 1), (5, 1, 1)):
        assert Simulator(GameConfig(drones_per_team=1), games, threads).threads == expected


def workers(simulator) -> set[int]:
    """Share seven rows out among threads; return who they were, once each row had its turn."""
    at_once, seen, done = threading.Barrier(simulator.threads, timeout=20.0), set(), []

    def work(rows):
        if simulator.threads > 1 and len(rows) < 7:
            at_once.wait()
        seen.add(threading.get_ident())
        done.extend(rows.tolist())

    simulator.for_rows(np.arange(7), work)
    assert sorted(done) == list(range(7))
    return seen


@pytest.mark.usefixtures("two_processors")
def test_threads_share_all_rows_and_copies_have_threads_of_their_own_unless_they_were_ended():
    simulator = Simulator(GameConfig(drones_per_team=1), num_games=7, threads=2)
    twins = [copy.deepcopy(simulator), pickle.loads(pickle.dumps(simulator))]  # noqa: S301
    assert [len(workers(one)) for one in (simulator, *twins)] == [2, 2, 2]
    simulator.close()
    assert workers(simulator) == workers(copy.deepcopy(simulator)) == {threading.get_ident()}
    for one in twins:
        one.close()


@pytest.mark.usefixtures("two_processors")
@pytest.mark.parametrize("bad", [0, 1])
def test_what_goes_wrong_in_a_thread_is_told_when_all_have_done_their_part(bad):
    simulator, done = Simulator(GameConfig(drones_per_team=1), num_games=4, threads=2), []

    def work(rows):
        if bad in rows:
            raise ValueError(bad)
        done.extend(rows.tolist())

    with pytest.raises(ValueError, match=str(bad)):
        simulator.for_rows(np.arange(4), work)
    assert sorted(done) == [row for row in range(4) if row % 2 != bad]
    simulator.close()


def test_no_thread_goes_on_once_the_caller_has_an_exception(monkeypatch):
    """The second thread fails while the third still changes its game."""
    monkeypatch.setattr(os, "cpu_count", lambda: 3)
    simulator, is_waited_for, done = Simulator(GameConfig(drones_per_team=1), 3, threads=3), threading.Event(), []

    def wait(futures):
        is_waited_for.set()
        return concurrent.futures.wait(futures)

    def work(rows):
        if 1 in rows:
            raise ValueError(1)
        if 2 in rows:
            is_waited_for.wait(20.0)
        done.extend(rows.tolist())

    monkeypatch.setattr("swarm_pz.simulator.simulator.wait", wait, raising=False)
    with pytest.raises(ValueError, match="1"):
        simulator.for_rows(np.arange(3), work)
    try:
        assert sorted(done) == [0, 2]
    finally:
        is_waited_for.set()
        simulator.close()


@pytest.mark.usefixtures("two_processors")
def test_closing_ends_the_threads():
    simulator, threads = Simulator(GameConfig(drones_per_team=1), num_games=4, threads=2), []
    simulator.for_rows(np.arange(4), lambda rows: threads.append(threading.current_thread()))
    others = [thread for thread in threads if thread is not threading.current_thread()]
    assert [thread.is_alive() for thread in others] == [True]
    simulator.close()
    assert [thread.is_alive() for thread in others] == [False]


def test_what_can_be_seen_cannot_be_changed_and_is_what_the_games_hold():
    peaceful = GameConfig(capture=CaptureConfig(enabled=False), dynamics=DynamicsConfig(speed_factor=0.5))
    simulator = Simulator(peaceful.replace(drones_per_team=(1, 2)), num_games=2)
    simulator.reset([0, 1])
    simulator.advance(4)
    for name in ("positions", "velocities", "failed", "altitudes", "teams", "targets"):
        seen, held = getattr(simulator, name), getattr(simulator.games, name)
        np.testing.assert_array_equal(seen, held)
        assert not seen.flags.writeable and held.flags.writeable
    np.testing.assert_array_equal(simulator.speeds, simulator.velocities / 2)
    assert simulator.velocities.any()
    np.testing.assert_allclose(simulator.time_s, 4 / 30)


def test_sizes_are_counted_and_without_captures_nothing_is_decided():
    simulator = Simulator(GameConfig(drones_per_team=(3, 1)), num_games=2)
    simulator.games.teams[1] = (0, 0, 0, 0)
    assert simulator.sizes.tolist() == [[3, 1], [4, 0]]
    assert simulator.decided.tolist() == [False, True]
    peaceful = Simulator(GameConfig(drones_per_team=(4, 0), capture=CaptureConfig(enabled=False)))
    assert peaceful.decided.tolist() == [False]


def test_a_flocking_command_is_refused_if_any_of_the_games_is_flown_by_another_controller():
    config = GameConfig(controllers=("ergodic", "flocking"))
    simulator = Simulator(config, num_games=2)
    simulator.reset(seeds=[1, 2], swapped=[False, True])  # blue flocks in game 0 alone
    before = simulator.snapshot()
    commands = [FlockingCommand(position=(0.2, 0.7), weight=config.flocking.migration[1])] * 2
    with pytest.raises(CommandError, match=r"blue's command .*for ergodic, which takes density"):
        simulator.command(BLUE, commands)
    assert all(np.array_equal(one, other) for one, other in zip(before, simulator.games, strict=True))
    simulator.command(BLUE, commands[:1], rows=[0])
    simulator.command(RED, commands[:1], rows=[1])
    np.testing.assert_allclose(simulator.games.commands[[0, 1], [BLUE, RED], :2], [(0.2, 0.7)] * 2)
