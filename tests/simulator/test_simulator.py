from __future__ import annotations

import concurrent.futures
import copy
import itertools
import os
import pickle
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarm_pz.config import BLUE, RED, CaptureConfig, ControllerConfig, DynamicsConfig, GameConfig, MemoryConfig
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.kernels.game import Games
from swarm_pz.simulator import CheckedCommands, Simulator
from swarm_pz.simulator.parameters import boards_of
from tests.games import assert_same, unchanged


def play(simulator: Simulator, seconds: int, streams: list[int]) -> None:
    """Send random commands every second, drawn per game, so that batches cannot share them."""
    generators = [np.random.default_rng(stream) for stream in streams]
    for _ in range(seconds):
        commands = np.stack([generator.random((2, 10, 10)) ** 8 for generator in generators])
        for team in (RED, BLUE):
            simulator.command(team, commands[:, team])
        simulator.advance(30)


@settings(max_examples=8)
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


EVERYTHING = GameConfig.preset("released").replace(
    drones_per_team=(3, 5),
    controllers=("ergodic", "flocking"),
    time_limit=5.0,
    dynamics=DynamicsConfig(speed_factor=0.8, failure_rate=1.0, repair_rate=1.0),
)
"""Rules with which every array of a game changes, but for the fields of trails."""


def test_a_snapshot_continues_bit_for_bit_in_any_row():
    simulator = Simulator(EVERYTHING, num_games=3)
    simulator.reset([1, 2, 3])
    play(simulator, 2, [1, 2, 3])
    saved, then = simulator.snapshot(rows=[1]), Games(*(array[[1, 1]] for array in simulator.games))
    play(simulator, 2, [4, 5, 6])
    other = Simulator(simulator.config, num_games=2)
    for array in other.games:
        array.fill(99)
    other.restore(saved)
    assert_same(other.games, then)  # catches an array that is left out and decides nothing within two seconds
    play(other, 2, [5, 5])
    assert_same(other.games, simulator.snapshot([1, 1]))


# --- what is sent, and what is held -----------------------------------------------------------------------------------

PEACE = {"drones_per_team": 3, "capture": CaptureConfig(enabled=False)}


def sending(mass: float = 1.0, trail: tuple[str, ...] = (), controller: tuple[str, ...] = (), **options) -> Simulator:
    """Return games whose trails and controllers forget on occasions, and whose targets have a mass.

    The trail is endless and the start is warm, as in `released`: so these rules need no machine code of their own.
    """
    memory = MemoryConfig(trail=None, controller=None, trail_forgotten_on=trail, controller_forgotten_on=controller)
    weights = ControllerConfig(warm_start=True, target_mass=mass)
    simulator = Simulator(GameConfig(memory=memory, controller=weights, **PEACE), **options)
    simulator.reset(range(simulator.num_games))
    return simulator


UNIFORM, RAMP = np.ones((1, 10, 10)), np.arange(1.0, 101.0).reshape(1, 10, 10) / 100


def weights(simulator: Simulator, row: int = 0) -> list[float]:
    """Return the memory weights of a red and a blue drone: numbers of solves, if nothing fades."""
    return simulator.games.memory_weight[row, [0, -1]].tolist()


def test_a_command_that_is_sent_empties_the_memory_be_it_the_same_again():
    simulator = sending(controller=("capture", "sending"), num_games=2)
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
    for _ in range(2):  # a snapshot keeps that something was sent
        simulator.advance(3)
        assert weights(simulator, 0) == [1.0, 22.0] and weights(simulator, 1) == [12.0, 2.0]
        simulator.restore(saved)


def test_a_trail_and_a_memory_are_each_forgotten_on_their_own_occasion():
    for on, kept in (("command", 31), ("sending", 1)):
        simulator = sending(mass=2.0, trail=(on,))
        simulator.advance(30)
        simulator.command(RED, UNIFORM)
        simulator.advance(1)
        assert simulator.occupancy[0].sum(axis=(1, 2)).tolist() == [3 * kept, 3 * 31]
        assert weights(simulator) == [11.0, 11.0]


def test_a_target_that_was_sent_has_its_mass_and_that_of_the_start_has_one():
    simulator, plain = (sending(mass, trail=("sending",)) for mass in (10.0, 1.0))
    for one in (simulator, plain):
        one.advance(30, CheckedCommands(np.concatenate([UNIFORM, RAMP])[None]))
    coefficients, of_mass_one = simulator.games.coefficients[0], plain.games.coefficients[0]
    np.testing.assert_array_equal(coefficients[RED], of_mass_one[RED])  # nobody sent red's target
    np.testing.assert_allclose(coefficients[BLUE], 10.0 * of_mass_one[BLUE], rtol=1e-6)
    simulator.command(RED, UNIFORM)
    assert coefficients[RED, 0, 0] == np.float32(10.0)
    # As densities, the targets are the same.
    np.testing.assert_array_equal(simulator.targets, plain.targets)
    np.testing.assert_allclose(simulator.target_coefficients, plain.target_coefficients, atol=1e-7)
    simulator.reset([1])
    assert simulator.games.coefficients[0, :, 0, 0].tolist() == [1.0, 1.0]


def test_games_without_seeds_are_all_different():
    simulator, starts = Simulator(num_games=2), []
    for _ in range(2):
        starts += [*simulator.positions.copy()]
        simulator.reset()
    simulator.reset(rows=[1])
    assert len({start.tobytes() for start in [*starts, *simulator.positions]}) == 6


# --- threads ----------------------------------------------------------------------------------------------------------


def workers(simulator) -> set[threading.Thread]:
    """Share seven rows out among threads, each row once; return the threads."""
    at_once, threads, done = threading.Barrier(simulator.threads, timeout=20.0), set(), []

    def work(rows):
        if simulator.threads > 1 and len(rows) < 7:
            at_once.wait()
        threads.add(threading.current_thread())
        done.extend(rows.tolist())

    simulator.for_rows(np.arange(7), work)
    assert sorted(done) == list(range(7))
    return threads


def test_threads_share_all_rows_and_copies_have_threads_of_their_own_unless_they_were_ended(monkeypatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 2)
    small = GameConfig(drones_per_team=1)
    for games, threads, expected in ((7, 4, 2), (1, 2, 1), (7, 1, 1)):
        assert Simulator(small, games, threads).threads == expected
    simulator, me = Simulator(small, num_games=7, threads=2), threading.current_thread()
    twins = [copy.deepcopy(simulator), pickle.loads(pickle.dumps(simulator))]  # noqa: S301
    groups = [workers(one) for one in (simulator, *twins)]
    assert [len(one) for one in groups] == [2, 2, 2] and set.intersection(*groups) == {me}
    simulator.close()
    assert workers(simulator) == workers(copy.deepcopy(simulator)) == {me}
    for one in twins:
        one.close()
    assert not any(thread.is_alive() for thread in set.union(*groups) - {me})


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


# --- what is refused --------------------------------------------------------------------------------------------------

ONES = np.ones((2, 10, 10))
DOUBTFUL = {
    "NaN": (lambda s: s.command(0, ONES * np.nan), "got nan at index"),
    "one command for two games": (lambda s: s.command(0, ONES[:1]), "shape"),
    "a third team": (lambda s: s.command(2, ONES), "team"),
    "ticks": (lambda s: s.advance(-1), "ticks"),
    "coarse commands": (lambda s: s.advance(3, CheckedCommands(np.ones((2, 2, 5, 5)))), "float64 of shape"),
    "a negative seed": (lambda s: s.reset([0, -1]), "seed"),
    "bools as rows": (lambda s: s.reset(rows=[False, True]), r"rows must be whole numbers in \[0, 2\)"),
    "row -1": (lambda s: s.reset(rows=[-1]), "rows"),
    "one swapped of two": (lambda s: s.reset([0, 1], swapped=[True]), "swapped"),
    "of other teams": (lambda s: s.restore(Simulator(GameConfig(drones_per_team=3), 2).snapshot()), "1 or 2 games"),
    "of three games": (lambda s: s.restore(Simulator(num_games=3).snapshot()), "1 or 2 games"),
    "of other types": (lambda s: s.restore(s.snapshot()._replace(ticks=np.zeros(2, np.int32))), "must be int64"),
    "of other systems": (
        lambda s: s.restore(s.snapshot()._replace(flown_by=np.full((2, 2), 127, np.int8))),
        "flown_by",
    ),
}


@pytest.fixture(scope="module")
def two_games():
    simulator = Simulator(num_games=2)
    simulator.reset([7, 8])
    return simulator


@pytest.mark.parametrize("name", DOUBTFUL)
def test_what_does_not_fit_changes_no_game(name, two_games):
    call, message = DOUBTFUL[name]
    with unchanged(two_games), pytest.raises(CommandError, match=message):
        call(two_games)


def test_no_snapshot_sends_the_kernels_beyond_their_arrays(two_games):
    broken = [("teams", 2), ("teams", -1), ("trails", 2500), ("trails", -2), ("ticks", -1), ("positions", 1.5)]
    broken += itertools.product(("positions", "velocities"), (np.nan, np.inf, -1e30))
    before = two_games.snapshot()
    with unchanged(two_games):
        for name, value in broken:
            with pytest.raises(CommandError, match=f"snapshot's {name}"):
                two_games.restore(before._replace(**{name: np.full_like(getattr(before, name), value)}))


@pytest.mark.filterwarnings("ignore:overflow")
def test_a_simulator_has_games_and_threads_and_numbers_that_are_finite_for_the_kernels():
    for wrong in ({"num_games": 0}, {"threads": 0}):
        with pytest.raises(ConfigError, match=rf"{next(iter(wrong))} must be .* got 0"):
            Simulator(**wrong)
    config = GameConfig()
    object.__setattr__(config.controller, "control_weight", 1e-40)  # should a range allow it
    with pytest.raises(ConfigError, match="inverse_control_weight must be finite for the kernels, got inf"):
        Simulator(config)


@pytest.mark.parametrize(
    ("config", "dtypes"),
    [
        (GameConfig(drones_per_team=109), (np.int16, np.int32)),
        (GameConfig(drones_per_team=110), (np.int32, np.int64)),
        (GameConfig(memory=MemoryConfig(trail=600.0)), (np.int32, np.int64)),
        (GameConfig(memory=MemoryConfig(trail=None), time_limit=1.0), (np.int32, np.int64)),
    ],
)
def test_occupancies_and_fields_have_room_for_all_trails_in_one_cell(config, dtypes):
    occupancy, weights = boards_of(config)
    assert (occupancy.dtype, weights.dtype) == dtypes
    ticks = config.num_drones * config.trail_ticks
    assert ticks <= np.iinfo(occupancy.dtype).max and ticks * int(weights.max()) <= np.iinfo(weights.dtype).max


# --- which games, and until when --------------------------------------------------------------------------------------


@pytest.mark.parametrize("config", [GameConfig(drones_per_team=3), EVERYTHING], ids=["paper", "everything"])
def test_a_game_begun_again_is_as_if_it_was_the_first_and_the_others_go_on(config):
    simulator = Simulator(config, num_games=3)
    simulator.reset([0, 1, 2])
    play(simulator, 3, [0, 1, 2])
    kept, old = simulator.snapshot([1]), simulator.games.memory.copy()
    simulator.reset([8, 9], rows=[2, 0])
    for row, seed in ((0, 9), (2, 8)):
        first = Simulator(config)
        first.reset([seed])
        assert_same(simulator.snapshot([row]), first.games)
        assert not np.array_equal(old[row], simulator.games.memory[row])
    assert_same(simulator.snapshot([1]), kept)


def test_a_decided_game_stays_as_it_is_and_takes_no_commands():
    simulator, apart = (Simulator(GameConfig(drones_per_team=2), num_games=4) for _ in range(2))
    for one in (simulator, apart):
        one.reset(range(4))
        one.games.teams[3] = 1
    assert simulator.decided.tolist() == [False, False, False, True]
    commands = np.random.default_rng(0).random((4, 2, 10, 10)) ** 4
    simulator.advance([3, 0, 7, 5], CheckedCommands(commands))
    for team in range(2):
        apart.command(team, commands[[0, 2], team], rows=[0, 2])
    apart.advance([3, 0, 7, 5])
    assert simulator.games.ticks.tolist() == [3, 0, 7, 0]
    assert_same(simulator.games, apart.games)


def test_commands_in_any_order_of_memory_are_the_same_commands():
    values = np.random.default_rng(0).random((2, 2, 10, 10))
    plain, other = (Simulator(num_games=2) for _ in range(2))
    for simulator, commands in ((plain, values), (other, np.asfortranarray(values))):
        simulator.reset([1, 2])
        simulator.advance(30, CheckedCommands(commands))
    np.testing.assert_array_equal(other.targets, plain.targets)


def test_what_can_be_seen_cannot_be_changed_and_is_what_the_games_hold():
    peaceful = GameConfig(capture=CaptureConfig(enabled=False), dynamics=DynamicsConfig(speed_factor=0.5))
    simulator = Simulator(peaceful.replace(drones_per_team=(4, 0)), num_games=2)
    simulator.advance(4)
    for name in ("positions", "velocities", "failed", "altitudes", "teams", "targets"):
        view, held = getattr(simulator, name), getattr(simulator.games, name)
        np.testing.assert_array_equal(view, held)
        assert not view.flags.writeable and held.flags.writeable
    np.testing.assert_array_equal(simulator.speeds, simulator.velocities / 2)
    np.testing.assert_allclose(simulator.time_s, 4 / 30)
    assert simulator.velocities.any() and np.isfinite(simulator.positions).all()
    assert simulator.sizes.tolist() == [[4, 0]] * 2
    assert simulator.decided.tolist() == [False, False], "without captures nothing is decided"
