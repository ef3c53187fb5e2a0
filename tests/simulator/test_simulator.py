from __future__ import annotations

from collections import deque

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm_pz.config import CaptureConfig, GameConfig, MemoryConfig
from swarm_pz.errors import CommandError
from swarm_pz.kernels.game import advance_games
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.commands import FlockingCommand
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
    with pytest.raises(CommandError, match=r"num_games must be a whole number from 1 to .*, got 0"):
        Simulator(num_games=0)
    with pytest.raises(CommandError, match="threads"):
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
        with pytest.raises(CommandError, match="flown by the ergodic controller"):
            simulator.command(team, [command], rows=row)
    with pytest.raises(CommandError, match="red is flown by the ergodic controller"):
        simulator.command(0, [command] * 2)
    simulator.advance(3)
    np.testing.assert_allclose(simulator.games.attractors[[0, 1], [1, 0]], [(0.2, 0.3, 60.0)] * 2, rtol=1e-6)


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
