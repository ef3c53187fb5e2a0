"""What can be known of a game from observations of its drones alone, once a command period.

Trails and capture fields follow from where drones have been: known at each observation, and interpolated by cubics in
between. A game that went as predicted is known exactly, with all that controllers remember.

The past is less exact where trails fade by other rules than time, where drones fail or return in the middle of a
command, and with long command periods.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import BLUE, RED, GameConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import PolicyError
from swarm_pz.kernels.game import Games
from swarm_pz.simulator.spawn import FASTEST

_FEWEST = 16
"""Games for which there is room at first."""


class DroneTracker:
    """Follows games from one side's observations of their drones; that side is red here, whatever it is there.

    The games, as far as they are known, are in `env`, each in the row of its number.
    """

    def __init__(self, config: GameConfig) -> None:
        self.env = BatchEnv(config, _FEWEST)
        self._begun: set[int] = set()

    def forget(self, rows: NDArray[np.int64]) -> None:
        """Make room for new games in some rows (n,), of which nothing was seen yet."""
        self._begun -= set(rows.tolist())
        if (needed := int(rows.max(initial=0)) + 1) > self.env.num_games:
            old, self.env = self.env, BatchEnv(self.env.config, 2 * needed)
            self.env.simulator.restore(old.simulator.snapshot(), np.arange(old.num_games))

    def look(self, drones: NDArray[np.float32], rows: NDArray[np.int64]) -> None:
        """Take in observations of kind `drones`, (n, N, 5), a command period after the last ones of these games."""
        positions, velocities, teams = split_drones(drones)
        is_known = np.array([row in self._begun for row in rows.tolist()], np.bool_)
        later, new, games = rows[is_known], rows[~is_known], self.env.simulator.games
        self.env.reset([0] * len(new), new)
        games.seeds[new] = 0  # what will happen by chance is not to be known
        # Not as a scenario: a game that is first seen in its middle may stand as none begins.
        for array, seen in ((games.positions, positions), (games.velocities, velocities), (games.teams, teams)):
            array[new] = seen[~is_known]
        self._begun |= set(new.tolist())
        ticks = self.env.config.step_ticks
        self.env.simulator.retrace(ticks, positions[is_known], velocities[is_known], teams[is_known], later)

    def adopt(self, game: Games, drones: NDArray[np.float32], row: int) -> None:
        """Take a predicted game for the one that is seen: its drones (N, 5) are where they were predicted."""
        self.env.simulator.restore(game, [row])
        positions, velocities, _ = split_drones(drones)
        self.env.simulator.games.positions[row] = positions
        self.env.simulator.games.velocities[row] = velocities


def checked_drones(drones: NDArray[np.float32], num_games: int, num_drones: int) -> NDArray[np.float32]:
    """Return observations of kind `drones`, (n, N, 5); a PolicyError is raised if no game can stand as they say."""
    seen, expected = np.asarray(drones, np.float32), (num_games, num_drones, 5)
    if seen.shape != expected:
        raise PolicyError(f"observations of drones must be of shape {expected}, got {seen.shape}")
    positions, velocities, _ = split_drones(seen)
    is_inside = (positions >= 0.0) & (positions <= 1.0)
    if not (np.isfinite(seen).all() and is_inside.all() and (np.abs(velocities) <= FASTEST).all()):
        raise PolicyError(
            f"observed drones must be in the square, and what is seen of them numbers, got {seen.tolist()}"
        )
    return seen


def split_drones(
    drones: NDArray[np.float32],
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.int8]]:
    """Return positions (..., N, 2), velocities (..., N, 2) and teams (..., N), the own one red, of observed drones."""
    parts = np.ascontiguousarray(drones[..., :2]), np.ascontiguousarray(drones[..., 2:4])
    return *parts, np.where(drones[..., 4] > 0.0, RED, BLUE).astype(np.int8)
