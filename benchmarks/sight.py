"""What seeing the board through a grid costs: the planner against `uniform`, shown less than there is.

Positions are anywhere within their cell of a grid, and velocities as they are or taken for 0.

python -m benchmarks.sight --games 40 --out runs/sight
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.match import play_match
from swarm_pz.kernels.game import Games
from swarm_pz.policies.planner import Planner, PlannerConfig
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.spawn import Seed

GRIDS = (0, 25, 10)
"""Cells a side; 0 for positions as they are."""


class _Seen(Simulator):
    """A simulator's games, as far as they are seen."""

    def __init__(self, simulator: Simulator, grid: int, *, moves: bool, generator: np.random.Generator) -> None:
        self.config, self._simulator = simulator.config, simulator
        self._grid, self._moves, self._generator = grid, moves, generator

    def snapshot(self, rows: Any = None) -> Games:
        """Copy games, and blur them."""
        games = self._simulator.snapshot(rows)
        if self._grid:
            within = self._generator.random(games.positions.shape)
            games.positions[:] = np.clip((np.floor(games.positions * self._grid) + within) / self._grid, 0.0, 1.0)
        if not self._moves:
            games.velocities[:] = 0.0
        return games


class Peering(Planner):
    """A planner that sees the board through a grid."""

    def __init__(self, config: GameConfig, grid: int, *, moves: bool, drone_steps: int) -> None:
        super().__init__(config, settings=PlannerConfig(drone_steps=drone_steps))
        self._grid, self._moves = grid, moves
        self._eyes: dict[int, np.random.Generator] = {}

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games."""
        super().reset(seeds, rows)
        for seed, row in zip(seeds, rows.tolist(), strict=True):
            self._eyes[row] = np.random.default_rng(seed).spawn(1)[0]

    def plan(self, simulator: Simulator, teams: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Answer games that are seen less well."""
        answers = []
        for place, row in enumerate(rows.tolist()):
            seen = _Seen(simulator, self._grid, moves=self._moves, generator=self._eyes[row])
            answers.append(super().plan(seen, teams[place : place + 1], rows[place : place + 1])[0])
        return np.stack(answers)


def play(sight: tuple[int, bool], games: int, drone_steps: int) -> dict[str, Any]:
    """Play a match with one kind of sight."""
    grid, moves = sight
    config = GameConfig()
    planner = Peering(config, grid, moves=moves, drone_steps=drone_steps)
    summary = play_match(planner, policies.load("uniform", config), games=games, config=config).summary()
    return {"grid": grid, "moves": moves} | summary


def main() -> None:
    """Play, print a Markdown table and write the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, default=40)
    parser.add_argument("--drone-steps", type=int, default=50_000)
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("runs/sight"))
    options = parser.parse_args()
    sights = [(grid, moves) for grid in GRIDS for moves in (True, False)]
    rows = []
    print("| positions | velocities | won | drawn | lost | median | mean, draws 300 s |")
    print("|---|---|---|---|---|---|---|", flush=True)
    with ProcessPoolExecutor(options.processes, mp_context=multiprocessing.get_context("spawn")) as pool:
        for row in pool.map(partial(play, games=options.games, drone_steps=options.drone_steps), sights):
            rows.append(row)
            where = f"to a cell of {row['grid']} x {row['grid']}" if row["grid"] else "exact"
            moves = "known" if row["moves"] else "taken for 0"
            print(
                f"| {where} | {moves} | {row['wins']} | {row['draws']} | {row['losses']} | "
                f"{row['median_seconds']:.0f} s | {row['restricted_mean_seconds']:.0f} s |",
                flush=True,
            )
    options.out.mkdir(parents=True, exist_ok=True)
    (options.out / "figures.json").write_text(json.dumps(rows, indent=2) + "\n")


if __name__ == "__main__":
    main()
