"""Players of figures: a fixed command, a script as slow as a person, and a tactic of two commands."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.policy import Policy
from swarm_pz.simulator.spawn import Seed
from swarm_pz.spaces.densities import disc

Array = NDArray[np.float64]


class Fixed:
    """Give one command (A, A), in [0, 1], and never change it."""

    name = "fixed"
    observation = ObservationConfig(grid=2, channels=("time_left",))

    def __init__(self, density: Array) -> None:
        self._density = density

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin games; nothing is remembered."""

    def act(self, observations: NDArray[np.uint8], rows: NDArray[np.int64]) -> Array:
        """Answer n observations with the command (n, A, A)."""
        return np.broadcast_to(self._density, (len(rows), *self._density.shape))


class Held:
    """Ask a player at every step, but give its answer in every few of them alone, and hold it in between.

    A player that counts its commands counts seconds as before, so a tactic's own course takes as long as it did.
    """

    def __init__(self, player: Policy, steps: int) -> None:
        self.name = f"{getattr(player, 'name', type(player).__name__)}, every {steps} steps"
        self.observation = player.observation
        self._player, self._steps = player, steps
        self._asked: dict[int, int] = {}
        self._given: dict[int, Array] = {}

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin games: their first command is the player's first."""
        self._player.reset(seeds, rows)
        self._asked.update(dict.fromkeys(rows.tolist(), 0))

    def act(self, observations: NDArray[np.uint8], rows: NDArray[np.int64]) -> Array:
        """Answer n observations with the commands (n, A, A) in force."""
        for row, answer in zip(rows.tolist(), self._player.act(observations, rows), strict=True):
            if self._asked[row] % self._steps == 0:
                self._given[row] = np.array(answer)
            self._asked[row] += 1
        return np.stack([self._given[row] for row in rows.tolist()])


class Ensemble:
    """Make a shape around the centre; once `last` opposing drones are left, the same around them.

    A shape makes densities of the distances (n, A, A) of a command's cells from the place, in map widths.
    """

    name = "ensemble"
    observation = ObservationConfig(grid=25, channels=("opposing_positions", "own_share"))

    def __init__(
        self, config: GameConfig, shape: Callable[[Array], Array] = lambda distance: disc(distance, 0.1), last: int = 1
    ) -> None:
        self._most = 1.0 - (last + 0.5) / config.num_drones
        self._centres = (np.arange(config.command_cells) + 0.5) / config.command_cells
        self._shape = shape

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin games; nothing is remembered."""

    def act(self, observations: NDArray[np.uint8], rows: NDArray[np.int64]) -> Array:
        """Answer n observations with densities (n, A, A)."""
        positions, share = observations[:, 0].astype(np.float64), observations[:, 1, 0, 0] / 255
        # Whole numbers, whose sums do not depend on their order, nor so on how many games are played.
        odd = 2.0 * np.arange(positions.shape[-1]) + 1.0
        weight = 2.0 * len(odd) * np.maximum(positions.sum(axis=(1, 2)), 1.0)
        places = np.stack([positions.sum(axis=axis) @ odd for axis in (1, 2)], axis=1) / weight[:, None]
        aim = np.where((share > self._most)[:, None], places, 0.5)
        offset = self._centres[None, :] - aim[:, :, None]
        density = self._shape(np.hypot(offset[:, 0, None, :], offset[:, 1, :, None]))
        return np.asarray(density / density.max(axis=(1, 2), keepdims=True))
