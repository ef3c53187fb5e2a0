"""Observations and actions of drones that are agents.

An observation is one float32 vector in [-1, 1]. Its parts follow one another:

| part       | shape      | holds                                                                                 |
|------------|------------|---------------------------------------------------------------------------------------|
| `self`     | (10,)      | 1; x, y from -1 to 1; velocity; distances to walls left, right, down, up; its side's share |
| `own`      | (k, 5)     | the nearest k of its own side, nearest first: 1; position and velocity relative to it  |
| `opposing` | (k, 5)     | the same of the other side                                                            |
| `ground`   | (4, p, p)  | `GROUND` in the p x p coarse cells around it, `[row = y, column = x]`; 0 beyond walls  |

If there are fewer than k drones, rows of zeros fill the list. Velocities are in units of sqrt(2 a): the speed that a
drone reaches from wall to wall with its largest acceleration a, at speed factor 1. Relative velocities are in units of
twice that. Both are clipped to [-1, 1]. An inactive drone sees -1 in place of the first 1, and zeros.
"""

from __future__ import annotations

import math
from typing import Any, Literal, get_args

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import GRID_CELLS, RED, GameConfig, ObservationConfig
from swarm_pz.config.base import check, check_choice, check_count
from swarm_pz.config.values import check_indices, check_values
from swarm_pz.kernels.sight import OTHER, SELF, see
from swarm_pz.simulator import Simulator
from swarm_pz.spaces.observation import observe

GROUND = ("own_trail_age", "opposing_trail_age", "own_capture_field", "opposing_capture_field")
"""The channels that a drone sees of the ground around it; see `swarm_pz.spaces.observation`."""
_HALF = math.sqrt(0.5)
DIRECTIONS = {
    "coast": (0.0, 0.0),
    "east": (1.0, 0.0),
    "north-east": (_HALF, _HALF),
    "north": (0.0, 1.0),
    "north-west": (-_HALF, _HALF),
    "west": (-1.0, 0.0),
    "south-west": (-_HALF, -_HALF),
    "south": (0.0, -1.0),
    "south-east": (_HALF, -_HALF),
}
"""The nine discrete actions in their order: accelerations in units of the largest."""
DroneAction = Literal["acceleration", "discrete"]


class DroneView:
    """The observations of drones; `space` is that of one drone, and `parts` has the slice and shape of each part.

    Raises a ConfigError if a number is out of range.

    Parameters
    ----------
    neighbours : int
        Other drones of each side that a drone sees: k above.
    grid : int
        Coarse cells a side of the square; divides 50.
    patch : int
        Coarse cells a side of the ground that a drone sees: p above. Odd, with the drone's own in the middle.
    """

    def __init__(self, config: GameConfig, *, neighbours: int = 5, grid: int = 10, patch: int = 5) -> None:
        neighbours = check_count(neighbours, "neighbours", 1, 10_000)
        grid = check_count(grid, "grid", 1, GRID_CELLS)
        check(GRID_CELLS % grid == 0, "grid", grid, f"a divisor of {GRID_CELLS}")
        patch = check_count(patch, "patch", 1, 2 * GRID_CELLS + 1)
        check(patch % 2 == 1, "patch", patch, "odd, so that the drone's own cell is in the middle")
        self._drones, self._neighbours, self._patch = config.num_drones, neighbours, patch
        self._images = ObservationConfig(grid=grid, channels=GROUND)
        self._speed = np.float32(math.sqrt(2.0 * config.controller.max_acceleration))
        shapes: dict[str, tuple[int, ...]] = {
            "self": (SELF,),
            "own": (neighbours, OTHER),
            "opposing": (neighbours, OTHER),
            "ground": (len(GROUND), patch, patch),
        }
        self.parts: dict[str, tuple[slice, tuple[int, ...]]] = {}
        size = 0
        for name, shape in shapes.items():
            self.parts[name] = (slice(size, size + math.prod(shape)), shape)
            size += math.prod(shape)
        self.space = spaces.Box(-1.0, 1.0, (size,), np.float32)

    def observe(self, simulator: Simulator, teams: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.float32]:
        """Return fresh observations (n, N, D) of all drones of the games `rows` (n,).

        Drones of other teams than `teams` (n,) are inactive; -1 stands for both teams.
        """
        games = simulator.games
        images = observe(simulator, self._images, np.full(len(rows), RED), rows)
        observations = np.zeros((len(rows), self._drones, *self.space.shape), np.float32)
        see(
            games.positions,
            games.velocities,
            games.teams,
            games.failed,
            rows,
            teams,
            images,
            self._speed,
            self._neighbours,
            self._patch,
            observations,
        )
        return observations


class DroneActions:
    """The actions of drones: accelerations Box(-1, 1, (2,)) in units of the largest, or numbers of `DIRECTIONS`."""

    def __init__(self, kind: DroneAction = "acceleration") -> None:
        check_choice(kind, "action", get_args(DroneAction))
        self._directions = np.array(list(DIRECTIONS.values())) if kind == "discrete" else None
        self.space: spaces.Space[Any] = (
            spaces.Discrete(len(DIRECTIONS)) if kind == "discrete" else spaces.Box(-1.0, 1.0, (2,), np.float32)
        )

    def read(self, actions: ArrayLike, shape: tuple[int, ...], name: str) -> NDArray[np.float64]:
        """Return actions of a shape as accelerations (*shape, 2); raise a CommandError if one is not in the space."""
        if self._directions is None:
            return check_values(actions, (*shape, 2), -1.0, 1.0, name)
        known = len(self._directions)
        expected = f"{name} must be whole numbers in [0, {known}) of shape {shape}: {', '.join(DIRECTIONS)}"
        return np.asarray(self._directions[check_indices(actions, shape, known, expected)])
