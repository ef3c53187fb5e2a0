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
    """What a control system knows about the team that it flies in each of n games.

    Positions and velocities of failed drones and of the other team are NaN: the system does not know them.
    """

    positions: NDArray[np.float32]
    """(n, N, 2) map widths."""
    velocities: NDArray[np.float32]
    """(n, N, 2) map widths per second, over the speed factor."""
    own: NDArray[np.bool_]
    """(n, N) the drones that it flies: those of the team that work."""
    heard: NDArray[np.bool_]
    """(n, N, N) `[i, j]`: whether drone i receives what drone j shares in this control period; i hears itself. False
    outside `own`. What drone i does may depend only on drones that it hears."""
    commands: NDArray[np.float64]
    """(n, *shape) the team's commands in force, of the shape of the system's space."""
    former: NDArray[np.float64]
    """(n, *shape) the commands before those."""
    age: NDArray[np.float64]
    """(n,) seconds that `commands` have been in force."""


class ControlSystem(Config):
    """A way to fly a team: a frozen dataclass whose fields are its parameters.

    A subclass defines its commands, and computes accelerations from them. `GameConfig.controllers` takes the class, an
    object of it, or the name under which it is installed in the entry points `swarm_pz.systems`; files take names only.
    """

    name: ClassVar[str]
    """Name of its entry point; by default its module and class."""
    takes: ClassVar[str]
    """The kind of its commands. Policies state the kind that they return; the same word means the same space."""
    shares: ClassVar[str] = "nothing"
    """Data that each drone sends to the team-mates within the communication radius, in words."""
    shapes: ClassVar[tuple[str, ...]] = ()
    """Names of the shapes that its commands may have."""
    turns: ClassVar[str] = ""
    """How commands turn with the square, if its flight turns alike: "images" (..., A, A), or "places" or "vectors",
    whose last axis begins with x and y."""
    kernel: ClassVar[str] = ""
    """"ergodic" or "direct": compiled code in the games' loop flies in place of `solve`. Empty: `solve` flies."""

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "name" not in vars(cls):
            cls.name = f"{cls.__module__}:{cls.__qualname__}"
        cls._section = cls.name

    def tag(self) -> dict[str, str]:
        """Return the name, which is one of a system's plain values."""
        return {"name": self.name}

    def space(self, config: GameConfig) -> spaces.Box:
        """Return the space of one command, in its own units."""
        raise NotImplementedError(f"{type(self).__name__} must say which commands it takes")

    def learner_space(self, config: GameConfig) -> spaces.Box:
        """Return the space of learners' commands: `space`, or that of a shorter form that `parse_all` also reads."""
        return self.space(config)

    def default(self, config: GameConfig) -> NDArray[np.float64]:
        """Return the command of the start: cover evenly, or do nothing."""
        raise NotImplementedError(f"{type(self).__name__} must have a command to begin with")

    def parse(self, command: Any, config: GameConfig, name: str = "command") -> NDArray[np.float64]:
        """Return one command, in any form, as float64 of the space's shape; raise a CommandError if it is invalid."""
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
        """Return commands (n, *shape) for densities (n, A, A) of policies; None if such policies cannot fly it."""
        return None

    def to_densities(self, commands: NDArray[np.float64], config: GameConfig) -> NDArray[np.float64]:
        """Return pictures of commands (n, *shape) as densities (n, A, A), for spectators; uniform by default."""
        return np.ones((len(commands), config.command_cells, config.command_cells))

    def named(self, config: GameConfig) -> Mapping[str, NDArray[np.float64]]:
        """Return the commands that discrete actions choose from, by name; empty if there are no such actions."""
        return {}

    def solve(self, flight: Flight, config: GameConfig) -> NDArray[Any]:
        """Choose accelerations for the games of a flight, which must not be modified.

        Returns
        -------
        array (n, N, 2), castable to float32
            Map widths per second squared. Rows of drones that it does not fly are ignored; magnitudes are cut to
            `controller.max_acceleration` afterwards.
        """
        raise NotImplementedError(f"{type(self).__name__} must choose accelerations")


def serve(system: ControlSystem, densities: NDArray[np.float64], config: GameConfig) -> NDArray[np.float64] | None:
    """Return densities (n, A, A) as commands (n, *shape) of a system; None if it does not take densities.

    Raises a CommandError if `from_densities` returns commands outside the space; errors that it raises pass through.
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
        message = f"controllers: {system.name} cannot serve densities by from_densities: {repr_of(error)}"
        raise ConfigError(message) from error
