"""Games that must not change: one tick from each stored state must lead to the next stored state.

Rounding differs between processors, and games are chaotic: a game left to itself soon diverges. So after every tick
the computed state is compared with the stored one, and then replaced by it. Whole numbers must agree exactly: the
drones' cells, captures, and the fields made of both. Positions and velocities may differ by as much as one solve can.
Rounding decides nothing: no drone of the stored games is ever that close to the edge of a cell.

A change here is a change of behaviour: write it into CHANGELOG.md, then store the games anew with
``python -m tests.test_golden``.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from swarm_pz.config import GRID_CELLS, TICKS_PER_SECOND, GameConfig
from swarm_pz.kernels.capture import capture_fields
from swarm_pz.simulator import Simulator

GOLDEN, PUBLISHED = (Path(__file__).parent / "golden" / f"{name}.npz" for name in ("games", "released"))
POSITION, VELOCITY = 1e-6, 1e-5
"""Largest difference allowed after one tick: 16 times the largest between any two of seven kinds of processor."""


class Golden(NamedTuple):
    """A game to store: the seed of start and commands, drones of red and blue, and seconds.

    The longest lasts longer than a trail does.
    """

    seed: int
    sizes: tuple[int, int]
    seconds: int


GAMES = (Golden(6, (10, 10), 6), Golden(20, (3, 17), 2), Golden(1, (1, 1), 3), Golden(5, (40, 40), 2))


class State(NamedTuple):
    """A game after a tick."""

    positions: np.ndarray
    """(N, 2) float32"""
    velocities: np.ndarray
    """(N, 2) float32"""
    teams: np.ndarray
    """(N,) int8"""
    fields: int
    """A checksum of both teams' capture fields."""


def state_of(simulator: Simulator) -> State:
    fields = np.pad(capture_fields(simulator.games.occupancy[0]), ((0, 0), (2, 2), (2, 2))).astype("<i8")
    positions, velocities, teams = simulator.positions[0].copy(), simulator.velocities[0].copy(), simulator.teams[0]
    return State(positions, velocities, teams.copy(), zlib.crc32(fields.tobytes()))


def ticks(game: Golden, simulator: Simulator) -> Iterator[int]:
    """Play a game with its commands; yield the number of each tick after it."""
    generator = np.random.default_rng(game.seed)
    simulator.reset([game.seed])
    yield 0
    for tick in range(1, game.seconds * TICKS_PER_SECOND + 1):
        if tick % TICKS_PER_SECOND == 1:
            for team in range(2):
                simulator.command(team, generator.random((1, 10, 10)) ** 3)
        simulator.advance(1)
        yield tick


def stored(number: int) -> list[State]:
    with np.load(GOLDEN) as arrays:
        columns = [arrays[f"{name}_{number}"] for name in State._fields]
    return [State(*row) for row in zip(*columns, strict=True)]


@pytest.mark.parametrize("number", range(len(GAMES)))
def test_golden_games(number):
    game, golden = GAMES[number], stored(number)
    simulator = Simulator(GameConfig(drones_per_team=game.sizes))
    for tick, then in zip(ticks(game, simulator), golden, strict=True):
        now = state_of(simulator)
        where = f"at tick {tick}"
        np.testing.assert_allclose(now.positions, then.positions, rtol=0, atol=POSITION, err_msg=where)
        np.testing.assert_allclose(now.velocities, then.velocities, rtol=0, atol=VELOCITY, err_msg=where)
        np.testing.assert_array_equal(now.teams, then.teams, err_msg=where)
        assert now.fields == then.fields, where
        simulator.games.positions[0], simulator.games.velocities[0] = then.positions, then.velocities


@pytest.mark.parametrize("number", range(len(GAMES)))
def test_golden_games_have_captures_and_rounding_decides_none_of_them(number):
    states = stored(number)
    assert distance_from_edges(states) > 2 * POSITION
    assert captures(states) > 0


def distance_from_edges(states: Sequence[State | Published]) -> float:
    """Return the least distance of a drone to an edge between two cells; the square's own edges do not count."""
    cells = np.stack([state.positions for state in states]).astype(np.float64) * GRID_CELLS
    edges = np.clip(np.rint(cells), 1, GRID_CELLS - 1)
    return float(np.abs(cells - edges).min() / GRID_CELLS)


# --- by the preset released -------------------------------------------------------------------------------------------

RELEASED = (Golden(10, (8, 8), 4), Golden(9, (2, 9), 4))
PLAN, FIELD = 1e-4, 1e-4
"""Largest difference allowed in a plan's control and in a value of a capture field after one tick."""


class Published(NamedTuple):
    """A game by the preset `released` after a tick."""

    positions: np.ndarray
    """(N, 2) float32"""
    velocities: np.ndarray
    """(N, 2) float32"""
    teams: np.ndarray
    """(N,) int8"""
    plans: np.ndarray
    """(N, H, 2) float32, the controls that drones keep for the next solve."""
    field: np.ndarray
    """(2, 10, 10) float32, values of both teams' capture fields at every fifth cell."""
    weights: np.ndarray
    """(N,) float32, the weights of the controller's memories."""


def published(game: Golden) -> Iterator[tuple[Simulator, Published]]:
    """Play a game tick by tick; every other command repeats the last density, which counts as sent."""
    simulator = Simulator(GameConfig.preset("released").replace(drones_per_team=game.sizes))
    simulator.reset([game.seed])
    generator, command = np.random.default_rng(game.seed), np.ones((1, 10, 10))
    for tick in range(game.seconds * TICKS_PER_SECOND + 1):
        games = simulator.games
        held = games.positions[0], games.velocities[0], games.teams[0], games.plans[0]
        field = simulator.capture_field[0, :, 2::5, 2::5]
        yield simulator, Published(*(values.copy() for values in (*held, field, games.memory_weight[0])))
        if tick % 20 == 0:
            command = generator.random((1, 10, 10)) ** 6 if tick % 40 == 0 else 0.5 * command
            simulator.command(tick // 60 % 2, command)
        simulator.advance(1)


def stored_published(number: int) -> list[Published]:
    with np.load(PUBLISHED) as arrays:
        columns = [arrays[f"{name}_{number}"] for name in Published._fields]
    return [Published(*row) for row in zip(*columns, strict=True)]


@pytest.mark.parametrize("number", range(len(RELEASED)))
def test_golden_games_by_the_preset_released(number):
    bounds = Published(POSITION, VELOCITY, 0.0, PLAN, FIELD, 0.0)
    for (simulator, now), then in zip(published(RELEASED[number]), stored_published(number), strict=True):
        for name, one, other, bound in zip(now._fields, now, then, bounds, strict=True):
            where = f"{name} at tick {simulator.games.ticks[0]}"
            np.testing.assert_allclose(one, other, rtol=0, atol=bound, err_msg=where)
        for held, value in zip(
            ("positions", "velocities", "plans"), (then.positions, then.velocities, then.plans), strict=True
        ):
            getattr(simulator.games, held)[0] = value


def captures(states: Sequence[State | Published]) -> int:
    return int(np.abs(np.diff([state.teams for state in states], axis=0)).sum())


def main() -> None:
    """Store all games."""
    columns = {}
    for number, game in enumerate(GAMES):
        simulator = Simulator(GameConfig(drones_per_team=game.sizes))
        states = [state_of(simulator) for _ in ticks(game, simulator)]
        print(f"{game}: {captures(states)} captures, never within {distance_from_edges(states):.1e} of an edge")
        by_name = zip(State._fields, zip(*states, strict=True), strict=True)
        columns |= {f"{name}_{number}": np.stack(column) for name, column in by_name}
    np.savez_compressed(GOLDEN, **columns)
    store_published()


def store_published() -> None:
    """Store the games by the preset `released`, if rounding decides nothing in them."""
    columns = {}
    for number, game in enumerate(RELEASED):
        states, nearest = [], 1.0
        for simulator, state in published(game):
            states.append(state)
            cells = np.minimum((state.positions * GRID_CELLS).astype(int), GRID_CELLS - 1)
            values = simulator.capture_field[0][1 - state.teams, cells[:, 1], cells[:, 0]]
            nearest = min(nearest, float(np.abs(values - 0.75).min()))
        edge = distance_from_edges(states)
        print(
            f"{game}: {captures(states)} captures, never within {edge:.1e} of an edge, {nearest:.1e} of the threshold"
        )
        assert captures(states) and edge > 2 * POSITION and nearest > 2 * FIELD, "take another seed"
        columns |= {
            f"{name}_{number}": np.stack(column)
            for name, column in zip(Published._fields, zip(*states, strict=True), strict=True)
        }
    np.savez_compressed(PUBLISHED, **columns)


if __name__ == "__main__":
    main()
