"""Flocking: alignment, cohesion, separation, and migration to an attractor.

Its parameters are `GameConfig.flocking`; `swarm_pz.kernels.controllers.flocking` has the equations and their
source.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import GameConfig
from swarm_pz.config.system import ControlSystem, Flight
from swarm_pz.config.values import check_densities, check_values, describe
from swarm_pz.errors import CommandError
from swarm_pz.kernels.controllers.flocking import flocking, flocking_parameters, serve_densities
from swarm_pz.simulator.commands import hats

MOST = 4
"""Attractors that a command holds."""


@dataclass(frozen=True, kw_only=True)
class FlockingCommand:
    """An attractor: one place for the whole team.

    Attributes
    ----------
    position : (float, float)
        x, y, in map widths.
    weight : float
        How strongly it draws, within the range of `FlockingConfig.migration`.
    """

    position: tuple[float, float]
    weight: float


def _weights(config: GameConfig) -> tuple[float, float]:
    """Return the range of weights that lies in the command space, whose numbers are float32."""
    least, largest = config.flocking.migration
    return max(least, float(np.float32(least))), min(largest, float(np.float32(largest)))


@dataclass(frozen=True, kw_only=True)
class Flocking(ControlSystem):
    """The team flies as a flock to one place, or to up to four in turn.

    A command has four rows x, y and weight. Each is in force for `FlockingConfig.dwell` seconds, and the
    last one stays. With fewer attractors, the last one fills the rest.
    """

    name: ClassVar[str] = "flocking"
    takes: ClassVar[str] = "attractors"
    turns: ClassVar[str] = "places"
    shares: ClassVar[str] = "its position and velocity"

    def space(self, config: GameConfig) -> spaces.Box:
        """Return the attractors (4, 3): x and y in [0, 1], the weight within `FlockingConfig.migration`."""
        least, largest = config.flocking.migration
        low, high = np.array([[0.0, 0.0, least], [1.0, 1.0, largest]], np.float32)
        return spaces.Box(np.tile(low, (MOST, 1)), np.tile(high, (MOST, 1)), dtype=np.float32)

    def default(self, config: GameConfig) -> NDArray[np.float64]:
        """Return the middle, with the least weight."""
        return np.tile([0.5, 0.5, _weights(config)[0]], (MOST, 1))

    def parse(self, command: Any, config: GameConfig, name: str = "command") -> NDArray[np.float64]:
        """Return a command, which may be written as 1 to 4 attractors or as a density, as an array (4, 3).

        Parameters
        ----------
        command : FlockingCommand, array_like (3,), sequence of these, or array_like (A, A)
            An attractor, several in order, or a density, whose strongest mode is the attractor.

        Raises
        ------
        CommandError
            If it is none of these, or a place or a weight is out of range.
        """
        rows = _rows_of(command)
        cells = (config.command_cells, config.command_cells)
        if _shape_of(rows) == cells:
            return np.asarray(self.from_densities(check_densities(rows, cells, name)[None], config)[0])
        if _shape_of(rows) == (3,):
            rows = [rows]
        count = _shape_of(rows)[0] if _shape_of(rows) else 0
        if not 1 <= count <= MOST:
            raise CommandError(
                f"{name} must be 1 to {MOST} attractors (x, y, weight), or a density of shape {cells}, "
                f"got {describe(command)}"
            )
        return self._checked(rows, (count, 3), config, name)

    def parse_all(self, commands: ArrayLike, count: int, config: GameConfig, name: str) -> NDArray[np.float64]:
        """Parse an array (n, k, 3) of k attractors for each of n games."""
        shape = _shape_of(commands)
        several = shape[1] if len(shape) == 3 and 1 <= shape[1] <= MOST else MOST
        return self._checked(commands, (count, several, 3), config, name)

    @staticmethod
    def _checked(rows: ArrayLike, shape: tuple[int, ...], config: GameConfig, name: str) -> NDArray[np.float64]:
        least, largest = config.flocking.migration
        # Learners send float32, which may be rounded beyond the ends.
        low = np.array([0.0, 0.0, min(least, float(np.float32(least)))])
        high = np.array([1.0, 1.0, max(largest, float(np.float32(largest)))])
        values = check_values(rows, shape, low, high, name)
        rest = [(0, 0)] * (len(shape) - 2) + [(0, MOST - shape[-2]), (0, 0)]
        return np.pad(values, rest, mode="edge")

    def from_densities(self, densities: NDArray[np.float64], config: GameConfig) -> NDArray[np.float64]:
        """Return attractors at the strongest modes, whose weights grow with their shares."""
        attractors = np.empty((len(densities), 3))
        serve_densities(np.ascontiguousarray(densities, np.float64), _weights(config), attractors)
        return np.repeat(attractors[:, None], MOST, axis=1)

    def to_densities(self, commands: NDArray[np.float64], config: GameConfig) -> NDArray[np.float64]:
        """Return densities whose mass lies in the cells nearest to the attractors."""
        cells = config.command_cells
        places = np.clip(commands[:, :, :2].reshape(-1, 2) * cells - 0.5, 0.0, cells - 1.0)
        one_each = hats(places[:, 1], cells)[:, :, None] * hats(places[:, 0], cells)[:, None, :]
        return np.asarray(one_each.reshape(len(commands), MOST, cells, cells).mean(axis=1))

    def solve(self, flight: Flight, config: GameConfig) -> NDArray[np.float32]:
        """Steer towards the attractors in force now."""
        current = np.minimum(flight.age / config.flocking.dwell, MOST - 1).astype(np.int64)
        attractors = flight.commands[np.arange(len(current)), current].astype(np.float32)
        accelerations = np.zeros_like(flight.positions)
        flocking(flight, attractors, flocking_parameters(config), accelerations)
        return accelerations


def _rows_of(command: Any) -> Any:
    """Return `FlockingCommand` objects as rows, and anything else unchanged."""
    if isinstance(command, FlockingCommand):
        return _row_of(command)
    if isinstance(command, (list, tuple)) and any(isinstance(one, FlockingCommand) for one in command):
        return [_row_of(one) if isinstance(one, FlockingCommand) else one for one in command]
    return command


def _row_of(command: FlockingCommand) -> tuple[Any, ...]:
    try:
        return (*command.position, command.weight)
    except TypeError as error:
        raise CommandError(f"a FlockingCommand has a position (x, y) and a weight, got {command!r}") from error


def _shape_of(values: Any) -> tuple[int, ...]:
    """Return the shape of values, or () if they are no array."""
    try:
        return np.shape(values)
    except ValueError:  # rows of different lengths
        return ()
