"""Commands of several kinds in one game, and which system flies which drones."""

from __future__ import annotations

import threading
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import CommandError, FlightError
from swarm_pz.simulator import CheckedCommands, Simulator
from tests.games import assert_same, unchanged
from tests.systems_of_tests import Magnet, install

MIXED = {"controllers": ("magnet", "ergodic"), "drones_per_team": 4}
DENSITY = np.ones((10, 10))


@pytest.fixture(autouse=True)
def systems(monkeypatch):
    install(monkeypatch, Magnet, Faulty)


@dataclass(frozen=True, kw_only=True)
class Faulty(Magnet):
    """Does what its `fault` says."""

    name: ClassVar[str] = "faulty"
    fault: str = ""

    def solve(self, flight, config):
        right = super().solve(flight, config)
        wrong = {
            "shape": right[:, 1:],
            "words": [["fly"]],
            "masked": np.ma.masked_all(right.shape),
            "vast": np.full(right.shape, -1e300),
            "huge": np.where(flight.positions[:, :, :1] > 0.5, 1e30, right),
            "nan": np.where(flight.positions[:, :, :1] > 0.5, np.nan, right),
        }
        if self.fault == "raises":
            raise ZeroDivisionError("no place like home")
        if self.fault == "exits":
            raise SystemExit(3)
        return wrong[self.fault]


def games(swapped=(False, True), threads=1, **options) -> Simulator:
    simulator = Simulator(GameConfig(**(MIXED | options)), num_games=len(swapped), threads=threads)
    simulator.reset(range(len(swapped)), swapped=np.array(swapped))
    return simulator


def shown(simulator, row=0, team=0):
    """Return the flight of the first system of the pair in a game."""
    return simulator.control.flight_of(simulator.games, np.array([row]), team, simulator.control.numbers[0])


def test_each_row_takes_the_command_of_who_flies_there():
    simulator = games()
    ring = np.random.default_rng(0).random((10, 10))
    simulator.command(0, [[0.2, 0.3], ring])
    simulator.command(1, [ring, [0.9, 0.7]])
    held = simulator.games.commands
    np.testing.assert_array_equal(held[[0, 1], [0, 1], :3], [[0.2, 0.3, 0.0], [0.9, 0.7, 0.0]])
    np.testing.assert_allclose(simulator.targets[[0, 1], [1, 0]], [ring / ring.sum()] * 2)
    assert np.argwhere(simulator.targets[0, 0]).tolist() == [[3, 2]], "those who watch see where a team is sent"
    simulator.advance(300)
    for row, team in ((0, 0), (1, 1)):
        places = simulator.positions[row][simulator.teams[row] == team]
        np.testing.assert_allclose(places, np.broadcast_to(held[row, team, :2], places.shape), atol=0.02)


@pytest.mark.parametrize("team", [0, 1])
def test_a_command_remembers_what_it_took_the_place_of_and_since_when(team):
    simulator = games(swapped=(team == 1,))

    def history():
        flight = shown(simulator, team=team)
        return flight.former[0].tolist(), flight.commands[0].tolist(), float(flight.age[0])

    simulator.advance(30)
    simulator.command(team, [[0.2, 0.3]])
    assert history() == ([0.5, 0.5], [0.2, 0.3], 0.0)
    simulator.advance(15)
    held = np.ones((1, 2, 100))
    held[0, team] = 0.0
    held[0, team, :2] = 0.2, 0.3
    simulator.advance(15, CheckedCommands(held))
    assert history() == ([0.5, 0.5], [0.2, 0.3], 1.0), "a step holds what is in force"
    simulator.command(team, [[0.2, 0.3]])
    assert history() == ([0.2, 0.3], [0.2, 0.3], 0.0), "who sends it again sends it"


def test_a_system_is_told_of_its_own_drones_at_work_alone_and_who_hears_whom():
    simulator = games(controller=GameConfig().controller.replace(communication_radius=0.25))
    line = np.stack([np.linspace(0.1, 0.8, 8), np.full(8, 0.5)], axis=1)
    simulator.reset([0, 1], scenario={"positions": line}, swapped=[False, True])
    simulator.games.failed[0, 1] = simulator.games.failed[1, 5] = True
    for row, team in ((0, 0), (1, 1)):
        flight = shown(simulator, row, team)
        own = (simulator.teams[row] == team) & ~simulator.failed[row]
        np.testing.assert_array_equal(flight.own[0], own)
        np.testing.assert_array_equal(np.isnan(flight.positions[0]).all(axis=1), ~own)
        np.testing.assert_array_equal(np.isnan(flight.velocities[0]).all(axis=1), ~own)
        np.testing.assert_array_equal(flight.positions[0][own], simulator.positions[row][own])
        near = np.abs(line[:, None, 0] - line[None, :, 0]) < 0.25
        np.testing.assert_array_equal(flight.heard[0], near & own[:, None] & own[None, :])
    simulator = games()
    own = shown(simulator).own[0]
    np.testing.assert_array_equal(shown(simulator).heard[0], own[:, None] & own[None, :])


def test_a_captured_drone_is_flown_by_its_new_team_from_the_next_solve_on():
    simulator = games(swapped=(False,), controllers=("magnet", "direct"))
    simulator.command(0, [[0.9, 0.5]])
    simulator.games.teams[0, 5] = 0  # as a capture would
    simulator.advance(3)
    towards = np.array([0.9, 0.5]) - simulator.positions[0, 5]
    assert simulator.games.accelerations[0, 5] @ towards > 0.0
    assert not simulator.games.accelerations[0, 6:].any()


def test_systems_solve_at_control_periods_however_a_game_is_advanced():
    whole, parts = (games(swapped=(False, True, False)) for _ in range(2))
    whole.advance(np.array([37, 41, 0]))
    for ticks in (1, 2, 7, 1, 26):
        parts.advance(np.array([ticks, ticks, 0]))
    parts.advance(np.array([0, 4, 0]))
    assert_same(whole.games, parts.games)


@pytest.mark.parametrize(
    ("commands", "said"),
    [
        ([[0.2, 0.3], np.ones((9, 9))], "shape"),
        ([[0.2, 0.9], DENSITY], r"within \[0.25, 0.75\] at index \(1,\), got 0.9"),
        ([[0.2, np.nan], DENSITY], "nan at index"),
        ([[0.2, 0.3]], "one for each of 2 games"),
        ([[0.2, 0.3], np.ma.masked_all((10, 10))], "got a masked array"),
        ([[0.2 + 0j, 0.3], DENSITY], "got numbers of type complex128"),
        (7, "one for each of 2 games"),
    ],
)
def test_a_bad_command_changes_no_game(commands, said):
    simulator = games()
    with unchanged(simulator), pytest.raises(CommandError, match=said):
        simulator.command(0, commands)


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("raises", r"faulty, which flies red, raised ZeroDivisionError.* \(test_control.py:\d+\)"),
        ("exits", r"SystemExit\(3\)"),
        ("shape", r"shape \(1, 7, 2\), not \(1, 8, 2\)"),
        ("words", r"got list \[\['fly'\]\]"),
        ("masked", "got a masked array"),
        ("vast", r"answered \[-1e\+300, -1e\+300\] for drone"),
        ("nan", r"answered \[nan, nan\] for drone \d"),
        ("huge", r"for drone \d: accelerations must be finite, in \[-1e\+18, 1e\+18\]"),
    ],
)
def test_a_system_at_fault_is_named(fault, said):
    simulator = games(swapped=(False,), controllers=(Faulty(fault=fault), "ergodic"))
    with pytest.raises(FlightError, match=said) as caught:
        simulator.advance(30)
    assert (caught.value.team, caught.value.system, caught.value.rows) == (0, "faulty", (0,))


@pytest.mark.parametrize(
    ("waits", "works", "swapped", "ends_at"),
    [
        ([0.15] * 50, [0.0] * 50, (False,), (27, 30)),
        ([0.15, 0.0] * 25, [0.15] * 50, (False,), (27, 30)),
        ([3.0, 0.01] * 50, [0.05] * 100, (False,), None),
        ([0.15] * 50, [0.15] * 50, (False, False), None),
    ],
    ids=["every solve waits", "too much work", "a busy machine", "two games together may take twice as long"],
)
def test_a_system_that_cannot_keep_up_is_named(waits, works, swapped, ends_at, monkeypatch):
    for name, spans in (("perf_counter", waits), ("thread_time", works)):
        clock = iter(np.cumsum([0.0] + [span for one in spans for span in (one, 0.0)]).tolist())
        monkeypatch.setattr(f"swarm_pz.simulator.control.time.{name}", lambda clock=clock: next(clock))
    simulator = games(swapped=swapped)
    if ends_at is None:
        simulator.advance(90)
        assert (simulator.games.ticks == 90).all()
        return
    with pytest.raises(FlightError, match=r"magnet, which flies red, took 0\.1\d s"):
        simulator.advance(90)
    assert simulator.games.ticks[0] in ends_at, "its first solve may compile"


def test_both_threads_may_compile_in_their_first_solve(monkeypatch):
    spent, both = threading.local(), threading.Barrier(2)
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    monkeypatch.setattr("swarm_pz.simulator.control.time.thread_time", lambda: getattr(spent, "seconds", 0.0))

    def solve(self, flight, config):
        if not hasattr(spent, "seconds"):
            both.wait(10)
            spent.seconds = 30.0
        return self.gain * (flight.commands[:, None] - flight.positions)

    monkeypatch.setattr(Magnet, "solve", solve)
    simulator = games(swapped=(False, False), threads=2)
    simulator.advance(60)
    assert (simulator.games.ticks == 60).all()


@pytest.mark.parametrize("system", ["ergodic", "coverage", "potential_field"])
def test_the_faintest_images_fly(system):
    for value in (1e-299, 3e-309, 5e-324):
        simulator = games(swapped=(False,), controllers=(system, "ergodic"))
        image = np.zeros(simulator.control.systems[simulator.control.numbers[0]].space(simulator.config).shape)
        image.flat[3] = value
        simulator.command(0, [image])
        simulator.command(1, [np.full((10, 10), value)])
        simulator.advance(6)
        assert np.isfinite(simulator.positions).all() and np.isfinite(simulator.games.coefficients).all()


@pytest.mark.parametrize("claimed", [True, False])
def test_a_system_that_writes_into_its_flight_flies_its_own_drones_alone(claimed, monkeypatch):
    def claim(self, flight, config):
        flight.own[:] = claimed
        return np.full(flight.positions.shape, 1.0 if claimed else np.nan)

    monkeypatch.setattr(Magnet, "solve", claim)
    simulator = games(swapped=(False,))
    if not claimed:
        with pytest.raises(FlightError, match="finite"):
            simulator.solve(0)
    else:
        simulator.solve(0)
        np.testing.assert_array_equal(simulator.games.given[0].any(axis=1), simulator.teams[0] == 0)
