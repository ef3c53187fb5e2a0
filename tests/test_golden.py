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
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest

from swarm_pz.config import GRID_CELLS, TICKS_PER_SECOND, GameConfig
from swarm_pz.kernels.capture import capture_fields
from swarm_pz.simulator import Simulator

FOLDER = Path(__file__).parent / "golden"
DIFFERENCES = {"positions": 1e-6, "velocities": 1e-5, "plans": 1e-4, "field": 1e-4}
"""Largest differences allowed after one tick, 0 for all else. Those of positions and velocities are 16 times the
largest between any two of seven kinds of processor."""


class Golden(NamedTuple):
    """A game to store: file and number there, preset, seed of start and commands, drones of red and blue, seconds.

    The longest lasts longer than a trail does.
    """

    file: str
    number: int
    preset: str
    seed: int
    sizes: tuple[int, int]
    seconds: int


GAMES = (
    Golden("games", 0, "paper", 6, (10, 10), 6),
    Golden("games", 1, "paper", 20, (3, 17), 2),
    Golden("games", 2, "paper", 1, (1, 1), 3),
    Golden("games", 3, "paper", 5, (40, 40), 2),
    Golden("released", 0, "released", 10, (8, 8), 4),
    Golden("released", 1, "released", 9, (2, 9), 4),
)


def state_of(simulator: Simulator) -> dict[str, Any]:
    """Return the positions (N, 2), velocities (N, 2) and teams (N,), and numbers made of all that a game remembers.

    With the preset `paper`, these are a checksum of both teams' capture fields. With `released`, they are `plans`
    (N, H, 2), the controls that drones keep for the next solve; `field` (2, 10, 10), both teams' capture fields at
    every fifth cell; and `weights` (N,), those of the controller's memories.
    """
    games = simulator.games
    state = {name: getattr(games, name)[0].copy() for name in ("positions", "velocities", "teams")}
    if simulator.config.capture.field == "reconstruction":
        field = simulator.capture_field[0, :, 2::5, 2::5]
        return state | {"plans": games.plans[0].copy(), "field": field, "weights": games.memory_weight[0].copy()}
    fields = np.pad(capture_fields(games.occupancy[0]), ((0, 0), (2, 2), (2, 2))).astype("<i8")
    return state | {"fields": zlib.crc32(fields.tobytes())}


def play(game: Golden) -> Iterator[tuple[Simulator, dict[str, Any]]]:
    """Play a game with its commands; yield its state at the start and after each tick.

    With `released`, every other command repeats the last density, which counts as sent.
    """
    simulator = Simulator(GameConfig.preset(game.preset).replace(drones_per_team=game.sizes))
    simulator.reset([game.seed])
    generator, command = np.random.default_rng(game.seed), np.ones((1, 10, 10))
    for tick in range(game.seconds * TICKS_PER_SECOND + 1):
        yield simulator, state_of(simulator)
        if game.preset == "paper" and tick % 30 == 0:
            for team in range(2):
                simulator.command(team, generator.random((1, 10, 10)) ** 3)
        if game.preset == "released" and tick % 20 == 0:
            command = generator.random((1, 10, 10)) ** 6 if tick % 40 == 0 else 0.5 * command
            simulator.command(tick // 60 % 2, command)
        simulator.advance(1)


@pytest.mark.parametrize("game", GAMES, ids=lambda game: f"{game.preset} {game.sizes}")
def test_golden_games(game):
    with np.load(FOLDER / f"{game.file}.npz") as arrays:
        stored = {name.rpartition("_")[0]: arrays[name] for name in arrays if name.endswith(f"_{game.number}")}
    states = [dict(zip(stored, values, strict=True)) for values in zip(*stored.values(), strict=True)]
    for tick, ((simulator, now), then) in enumerate(zip(play(game), states, strict=True)):
        assert now.keys() == then.keys()
        for name, value in now.items():
            atol, where = DIFFERENCES.get(name, 0.0), f"{name} at tick {tick}"
            np.testing.assert_allclose(value, then[name], rtol=0, atol=atol, err_msg=where)
        for name in {"positions", "velocities", "plans"} & then.keys():
            getattr(simulator.games, name)[0] = then[name]


def main() -> None:
    """Store all games, if they have captures and rounding decides none of them."""
    columns: dict[str, dict[str, np.ndarray]] = {"games": {}, "released": {}}
    for game in GAMES:
        states, threshold = [], 1.0
        for simulator, state in play(game):
            states.append(state)
            if "field" in state:
                columns_and_rows = np.minimum((state["positions"] * GRID_CELLS).astype(int), GRID_CELLS - 1).T
                values = simulator.capture_field[0][1 - state["teams"], columns_and_rows[1], columns_and_rows[0]]
                threshold = min(threshold, float(np.abs(values - 0.75).min()))
        stacked = {name: np.stack([state[name] for state in states]) for name in states[0]}
        captures, edge = int(np.abs(np.diff(stacked["teams"], axis=0)).sum()), distance_from_edges(stacked["positions"])
        print(f"{game}: {captures} captures, never within {edge:.1e} of an edge, {threshold:.1e} of the threshold")
        decided_by_rounding = edge <= 2 * DIFFERENCES["positions"] or threshold <= 2 * DIFFERENCES["field"]
        assert captures and not decided_by_rounding, "take another seed"
        columns[game.file] |= {f"{name}_{game.number}": column for name, column in stacked.items()}
    for file, arrays in columns.items():
        np.savez_compressed(FOLDER / f"{file}.npz", **arrays)


def distance_from_edges(positions: np.ndarray) -> float:
    """Return the least distance of a drone to an edge between two cells; the square's own edges do not count."""
    cells = positions.astype(np.float64) * GRID_CELLS
    edges = np.clip(np.rint(cells), 1, GRID_CELLS - 1)
    return float(np.abs(cells - edges).min() / GRID_CELLS)


if __name__ == "__main__":
    main()
