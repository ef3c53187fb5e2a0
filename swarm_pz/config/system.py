"""Interface of control systems: a controller and its commands."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config.base import Config
from swarm_pz.config.installed import FAULTS
from swarm_pz.config.values import check_values, repr_of
from swarm_pz.errors import CommandError, ConfigError

if TYPE_CHECKING:
    from swarm_pz.config.game import GameConfig


class Flight(NamedTuple):
    """One team of each of n games, as the control system that flies it may know them.

    Drones of the other team, and those that have failed, stand in the arrays as NaN: nobody told it about them.
    """

    positions: NDArray[np.float32]
    """(n, N, 2) map widths."""
    velocities: NDArray[np.float32]
    """(n, N, 2) map widths per second, over the speed factor."""
    own: NDArray[np.bool_]
    """(n, N) the drones that it flies: those of the team that work."""
    heard: NDArray[np.bool_]
    """(n, N, N) `[i, j]`: whether drone i hears what drone j shares in this control period; i hears itself. Only among
    `own`. What drone i does may depend on the others that it hears, and on no others."""
    commands: NDArray[np.float64]
    """(n, *shape) the team's commands in force, of the shape of the system's space."""
    former: NDArray[np.float64]
    """(n, *shape) those that they took the place of."""
    age: NDArray[np.float64]
    """(n,) seconds since they came into force."""


class ControlSystem(Config):
    """A way to fly a team: a frozen dataclass whose fields are its parameters.

    A subclass defines its commands, and computes accelerations from them. `GameConfig.controllers` takes the class, an
    object of it, or the name under which it is installed in the entry points `swarm_pz.systems`; files take names only.
    """

    name: ClassVar[str]
    """That of its entry point; by default its module and class."""
    takes: ClassVar[str]
    """The kind of its commands. Policies state the kind that they return; the same word means the same space."""
    shares: ClassVar[str] = "nothing"
    """Data that each drone sends to the team-mates within the communication radius, in words."""
    shapes: ClassVar[tuple[str, ...]] = ()
    """Names of the shapes that its commands may have."""
    turns: ClassVar[str] = ""
    """Form of commands that turn with the square, if what it does turns, too: images (..., A, A), or numbers whose last
    axis begins with x and y."""
    kernel: ClassVar[str] = ""
    """"ergodic" or "direct" fly in the games' own loop in place of `solve`; empty for none."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "name" not in vars(cls):
            cls.name = f"{cls.__module__}:{cls.__qualname__}"
        cls._section = cls.name

    def tag(self) -> dict[str, str]:
        """Return the name, which stands among a system's plain values."""
        return {"name": self.name}

    def space(self, config: GameConfig) -> spaces.Box:
        """Return the space of one command, in its own units."""
        raise NotImplementedError(f"{type(self).__name__} must say which commands it takes")

    def learner_space(self, config: GameConfig) -> spaces.Box:
        """Return the space of learners' commands: all, or a shorter form that `parse_all` reads, too."""
        return self.space(config)

    def default(self, config: GameConfig) -> NDArray[np.float64]:
        """Return the command of the start: cover evenly, or do nothing."""
        raise NotImplementedError(f"{type(self).__name__} must have a command to begin with")

    def parse(self, command: Any, config: GameConfig, name: str = "command") -> NDArray[np.float64]:
        """Return one command, in any form, as float64 of the space's shape; raise a CommandError if it is not of it."""
        space = self.space(config)
        return check_values(command, space.shape, space.low, space.high, name)

    def parse_all(self, commands: ArrayLike, count: int, config: GameConfig, name: str) -> NDArray[np.float64]:
        """Return the commands (n, *shape) of n games, given as an array."""
        space = self.space(config)
        return check_values(commands, (count, *space.shape), space.low, space.high, name)

    def check_sizes(
        self, commands: NDArray[np.float64], sizes: NDArray[np.int64], config: GameConfig, name: str
    ) -> None:
        """Raise a CommandError if teams of `sizes` (n,) drones cannot fly parsed commands (n, *shape)."""

    def from_densities(self, densities: NDArray[np.float64], config: GameConfig) -> NDArray[np.float64] | None:
        """Return commands (n, *shape) for densities (n, A, A), with which policies of densities fly it; None: never."""
        return None

    def to_densities(self, commands: NDArray[np.float64], config: GameConfig) -> NDArray[np.float64]:
        """Return pictures of commands (n, *shape) as densities (n, A, A), for spectators; uniform by default."""
        return np.ones((len(commands), config.command_cells, config.command_cells))

    def named(self, config: GameConfig) -> Mapping[str, NDArray[np.float64]]:
        """Return commands by name, among which discrete actions choose; none if there are no such actions."""
        return {}

    def solve(self, flight: Flight, config: GameConfig) -> NDArray[Any]:
        """Choose accelerations for the games of a flight, which is not to be written to.

        Returns
        -------
        array (n, N, 2), castable to float32
            Map widths per second squared, of the drones that it flies; of the others anything. Each drone's is cut
            to `controller.max_acceleration` afterwards.
        """
        raise NotImplementedError(f"{type(self).__name__} must choose accelerations")


def serve(system: ControlSystem, densities: NDArray[np.float64], config: GameConfig) -> NDArray[np.float64] | None:
    """Return densities (n, A, A) as commands (n, *shape) of a system; None if densities mean nothing to it.

    Raises a CommandError if its `from_densities` returns what is not of its space; whatever that raises passes through.
    """
    if system.takes == "density":
        return densities
    commands, space = system.from_densities(densities, config), system.space(config)
    if commands is None:
        return None
    shape = (len(densities), *space.shape)
    return check_values(commands, shape, space.low, space.high, "cannot serve densities: what from_densities returns")


def serves_densities(system: ControlSystem, config: GameConfig) -> bool:
    """Test that densities can be converted to a system's commands; raise a ConfigError if that fails."""
    try:
        return serve(system, np.ones((1, config.command_cells, config.command_cells)), config) is not None
    except CommandError as error:
        raise ConfigError(f"controllers: {system.name} {error}") from error
    except FAULTS as error:
        said = f"controllers: {system.name} cannot serve densities by from_densities: {repr_of(error)}"
        raise ConfigError(said) from error
