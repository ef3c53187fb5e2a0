"""Games for figures: whole batches of two players, with red and blue fixed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from swarm_pz.batch_env import BatchEnv
from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.policy import Player, ask, load_players

Watch = Callable[[BatchEnv, NDArray[np.int64]], None]


def play(
    red: str | Player,
    blue: str | Player,
    seeds: Sequence[int],
    config: GameConfig | None = None,
    watch: Watch | None = None,
    animate: Callable[[BatchEnv], None] | None = None,
) -> BatchEnv:
    """Play one game a seed to its end; a game does not depend on which others are played with it.

    Parameters
    ----------
    red, blue : str or Player
    seeds : sequence of int
    config : GameConfig, optional
    watch : callable, optional
        Called at the start and after every step with the games and the rows that were still running
        before it.
    animate : callable, optional
        Called after every control period.

    Returns
    -------
    BatchEnv
        As the games ended.
    """
    config = config if config is not None else GameConfig()
    batch = BatchEnv(config, len(seeds))
    players = load_players(red, blue, config)
    everyone = np.arange(len(seeds))
    streams = [[np.random.SeedSequence(seed, spawn_key=(place,)) for place in range(3)] for seed in seeds]
    batch.reset([stream[2] for stream in streams])
    for place, player in enumerate(players):
        player.reset([stream[place] for stream in streams], everyone)
    if watch is not None:
        watch(batch, everyone)
    cells = config.command_cells
    while batch.running.any():
        rows = np.flatnonzero(batch.running)
        commands = np.zeros((len(seeds), 2, cells, cells))
        for team, player in zip((RED, BLUE), players, strict=True):
            commands[rows, team] = ask(player, batch, np.full(len(rows), team), rows)
        batch.step_checked(commands, None if animate is None else lambda: animate(batch))
        if watch is not None:
            watch(batch, rows)
    return batch


class Sizes:
    """Keeps the number of red's drones at the start and after every step, a list a game; for `play` to call."""

    def __init__(self, games: int) -> None:
        self.red: list[list[int]] = [[] for _ in range(games)]

    def __call__(self, batch: BatchEnv, rows: NDArray[np.int64]) -> None:
        """Keep the present sizes."""
        for row, size in zip(rows.tolist(), batch.simulator.sizes[rows, RED].tolist(), strict=True):
            self.red[row].append(size)


def outcomes(batch: BatchEnv, team: int = RED) -> list[str]:
    """Return how each game ended for a team: "win", "draw" or "loss"."""
    return [batch.outcome(row, team) or "draw" for row in range(batch.num_games)]
