"""The control systems of a configuration: their teams, commands and solves."""

from __future__ import annotations

import collections
import math
import threading
import time
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import CONTROL_PERIOD, TEAM_NAMES, TICKS_PER_SECOND, GameConfig
from swarm_pz.config.installed import FAULTS
from swarm_pz.config.system import ControlSystem, Flight, serve, serves_densities
from swarm_pz.config.values import TOLERANCE, as_floats, check_densities, describe, repr_of
from swarm_pz.errors import CommandError, ConfigError, FlightError, SwarmError
from swarm_pz.kernels.game import DIRECT, ERGODIC, GIVEN, Games

_SOLVES = 10
"""Solves over which a system must keep up with the game: one alone may have waited for the processor."""

_HARDEST = 1e18
"""Acceleration that no system needs, and whose square is finite in float32."""
_TIMING = threading.Lock()
"""Guards the timings of solves; one for all, since a simulator with a lock of its own could not be copied."""


class Control:
    """The control systems that fly the teams of some games.

    Attributes
    ----------
    numbers : (int, int)
        The values of `Games.flown_by` for the first and the second of `controllers`.
    systems : dict
        The systems by these numbers.
    command_shape : tuple of int
        The padded shape that all systems share: (A, A) if all take densities, else one axis as long as the longest.
    is_given : bool
        True if a team is flown by another system than the ergodic controller.
    solves : bool
        True if the `solve` of a system flies, and not the kernels alone.
    """

    def __init__(self, config: GameConfig) -> None:
        self.config = config
        first, second = config.team_systems
        number = _number(first, 0)
        self.numbers = (number, number if second == first else _number(second, 1))
        self.systems: dict[int, ControlSystem] = dict(zip(self.numbers, (first, second), strict=True))
        self.is_given = any(number != ERGODIC for number in self.systems)
        self.solves = any(number >= GIVEN for number in self.systems)
        self._densities = (config.command_cells, config.command_cells)
        self._shapes = {number: command_shape(system, config) for number, system in self.systems.items()}
        longest = max(math.prod(shape) for shape in self._shapes.values())
        are_densities = set(self._shapes.values()) == {self._densities}
        self.command_shape: tuple[int, ...] = self._densities if are_densities else (longest,)
        self._spent: dict[int, collections.deque[tuple[float, float]]] = {
            number: collections.deque(maxlen=_SOLVES) for number in self.systems
        }

    @property
    def room(self) -> int:
        """Length of a command if a system other than the ergodic controller flies; else 0."""
        return math.prod(self.command_shape) if self.is_given else 0

    # --- commands -----------------------------------------------------------------------------

    def defaults(self, flown_by: NDArray[np.int8]) -> NDArray[np.float64]:
        """Return the commands (n, 2, room) at the start, for teams that the systems `flown_by` (n, 2) fly."""
        commands = np.zeros((*flown_by.shape, self.room))
        for number, system in self.systems.items():
            if self.room:
                values = np.asarray(system.default(self.config), np.float64)
                commands[flown_by == number, : values.size] = values.ravel()
        return commands

    def pack(self, commands: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return commands (n, ...) of one system, padded to the shape that all share, (n, *command_shape)."""
        if commands.shape[1:] == self.command_shape:
            return commands
        packed = np.zeros((len(commands), *self.command_shape))
        packed[:, : commands[0].size if len(commands) else 0] = commands.reshape(len(commands), -1)
        return packed

    def unpack(self, packed: NDArray[np.float64], number: int) -> NDArray[np.float64]:
        """Undo `pack`: return commands (n, ...) in the shape of a system."""
        shape = self._shapes[number]
        flat = packed.reshape(len(packed), -1)[:, : math.prod(shape)]
        return np.ascontiguousarray(flat).reshape(len(packed), *shape)

    def parse(self, commands: Any, flown_by: NDArray[np.int8], name: str) -> NDArray[np.float64]:
        """Return checked commands (n, *command_shape) from any forms that the systems `flown_by` (n,) can parse.

        Raises
        ------
        CommandError
            If one is not in its system's space.
        """
        if not self.is_given:
            return check_densities(commands, (len(flown_by), *self._densities), name)
        if not hasattr(commands, "__len__") or len(commands) != len(flown_by):
            raise CommandError(f"{name} must be one for each of {len(flown_by)} games, got {describe(commands)}")
        packed = np.zeros((len(flown_by), *self.command_shape))
        for number, chosen in self._by_system(flown_by):
            system = self.systems[number]
            with reading(system, name):
                own = np.stack([system.parse(commands[place], self.config, name) for place in chosen])
                packed[chosen] = self.pack(self._in_shape(own, number))
        return packed

    def read(
        self, answer: Any, games: Games, rows: NDArray[np.int64], teams: ArrayLike, kind: str, name: str
    ) -> NDArray[np.float64]:
        """Return checked commands (n, *command_shape) of one kind, for one team or a team each of the rows (n,).

        Raises
        ------
        CommandError
            If a system does not take that kind, or the commands are not in its space.
        FlightError
            If a system fails to convert densities.
        """
        count = len(rows)
        if kind == "density" and not self.is_given:
            return check_densities(answer, (count, *self._densities), name)
        sides = np.broadcast_to(teams, len(rows))
        flown_by = games.flown_by[rows, sides]
        if kind == "density":
            densities = check_densities(answer, (count, *self._densities), name)
            commands = np.zeros((count, *self.command_shape))
            for number, chosen in self._by_system(flown_by):
                system, team = self.systems[number], int(sides[chosen[0]])
                with flight_errors(team, system, rows[chosen][sides[chosen] == team]):
                    served = serve(system, densities[chosen], self.config)
                if served is None:
                    raise _mismatch(system, "density", name)
                commands[chosen] = self.pack(served)
            return commands
        groups = list(self._by_system(flown_by))
        for number, _ in groups:
            check_kind(self.systems[number], kind, name)
        if len(groups) > 1:
            raise CommandError(f"{name} are for several control systems at once: give them for one after the other")
        number, _ = groups[0]
        with reading(self.systems[number], name):
            return self.pack(self._in_shape(self.systems[number].parse_all(answer, count, self.config, name), number))

    def _in_shape(self, commands: NDArray[np.float64], number: int) -> NDArray[np.float64]:
        """Return commands (n, ...) of a system; raise a TypeError unless they are float64 of its space's shape."""
        if commands.shape[1:] != self._shapes[number] or commands.dtype != np.float64:
            raise TypeError(
                f"commands must be float64 of shape {self._shapes[number]}, not {commands.dtype} of shape "
                f"{commands.shape[1:]}"
            )
        return commands

    def check_sizes(
        self, packed: NDArray[np.float64], flown_by: NDArray[np.int8], sizes: NDArray[np.int64], name: str
    ) -> None:
        """Refuse commands (n, *command_shape) that teams of `sizes` (n,) drones cannot fly.

        Raises
        ------
        CommandError
            If a system refuses one.
        """
        for number, chosen in self._by_system(flown_by):
            own = self.unpack(packed[chosen], number)
            with reading(self.systems[number], name):
                self.systems[number].check_sizes(own, sizes[chosen], self.config, name)

    def _by_system(self, flown_by: NDArray[np.int8]) -> Iterator[tuple[int, NDArray[np.int64]]]:
        """Yield each system's number, and the indices in `flown_by` (n,) at which it flies."""
        for number in self.systems:
            places = (flown_by == number).nonzero()[0]
            if len(places):
                yield number, places

    def pictures(
        self, games: Games, commands: NDArray[np.float64], rows: NDArray[np.int64], teams: NDArray[np.int64]
    ) -> NDArray[np.float64]:
        """Return commands (n, t, *command_shape) of t teams as densities (n, t, A, A), to show them.

        Raises
        ------
        FlightError
            If a system fails to convert them.
        """
        densities = np.ones((*commands.shape[:2], *self._densities))
        for place, team in enumerate(teams.tolist()):
            for number, chosen in self._by_system(games.flown_by[rows, team]):
                system = self.systems[number]
                shown = self.unpack(commands[chosen, place], number)
                if system.takes != "density":
                    if type(system).to_densities is ControlSystem.to_densities:
                        continue  # uniform, as `densities` is
                    label, shape = "cannot show its commands as densities: they", (len(chosen), *self._densities)
                    with flight_errors(team, system, rows[chosen]):
                        shown = check_densities(system.to_densities(shown, self.config), shape, label)
                densities[chosen, place] = shown
        return densities

    # --- flying -------------------------------------------------------------------------------

    def fly(self, games: Games, rows: NDArray[np.int64], team: int) -> None:
        """Store the accelerations that systems with a `solve` choose for a team in the control period that begins.

        Raises
        ------
        FlightError
            If a system raises, returns invalid accelerations, or is slower than the game.
        """
        for number, chosen in self._by_system(games.flown_by[rows, team]):
            if number >= GIVEN:
                self._solve(games, rows[chosen], team, number)

    def _solve(self, games: Games, rows: NDArray[np.int64], team: int, number: int) -> None:
        system = self.systems[number]
        flight = self.flight_of(games, rows, team, number)
        own = flight.own.copy()  # a system may write into its flight
        may_compile = not self._spent[number]
        began, busy = time.perf_counter(), time.thread_time()
        with flight_errors(team, system, rows):
            answer = as_floats(system.solve(flight, self.config), "must answer accelerations as numbers")
        expected = (len(rows), *games.positions.shape[1:])
        if answer.shape != expected:
            raise flight_error(team, system, rows, f"answered accelerations of shape {answer.shape}, not {expected}")
        broken = own & ~(np.abs(answer) <= _HARDEST).all(axis=2)  # in this form, since no comparison holds for NaN
        if broken.any():
            row, drone = np.argwhere(broken)[0]
            reason = (
                f"answered {answer[row, drone].tolist()} for drone {drone}: accelerations must be finite, "
                f"in [-{_HARDEST:g}, {_HARDEST:g}]"
            )
            raise flight_error(team, system, rows[broken.any(axis=1)], reason)
        games.given[rows] = np.where(own[:, :, None], answer, games.given[rows])
        spent = time.perf_counter() - began, time.thread_time() - busy
        self._time(team, system, rows, number, *((0.0, 0.0) if may_compile else spent))

    def flight_of(self, games: Games, rows: NDArray[np.int64], team: int, number: int) -> Flight:
        """Return a system's view of one team of some games."""
        own = (games.teams[rows] == team) & ~games.failed[rows]
        unknown = np.float32(np.nan)
        heard = own[:, :, None] & own[:, None, :]
        if (radius := self.config.controller.communication_radius) is not None:
            x, y = np.moveaxis(games.positions[rows].astype(np.float64), -1, 0)
            away_x, away_y = x[:, :, None] - x[:, None, :], y[:, :, None] - y[:, None, :]
            heard &= away_x * away_x + away_y * away_y <= radius * radius
        return Flight(
            positions=np.where(own[:, :, None], games.positions[rows], unknown),
            velocities=np.where(own[:, :, None], games.velocities[rows], unknown),
            own=own,
            heard=heard,
            commands=self.unpack(games.commands[rows, team], number),
            former=self.unpack(games.former[rows, team], number),
            age=(games.ticks[rows] - games.commanded[rows, team]) / TICKS_PER_SECOND,
        )

    def _time(
        self, team: int, system: ControlSystem, rows: NDArray[np.int64], number: int, seconds: float, busy: float
    ) -> None:
        """Store the time of a solve, and raise if the system is slower than the game.

        It is slower if its mean processor time is too long, or if every solve takes too long: one may have waited for a
        busy machine. Solves that began before the first had ended may have compiled, and count as 0 s.
        """
        spent, period = self._spent[number], CONTROL_PERIOD * len(rows)
        with _TIMING:  # the simulator's threads share the systems
            spent.append((seconds / period, busy / period))
            if len(spent) < _SOLVES:
                return
            load = max(min(waited for waited, _ in spent), sum(worked for _, worked in spent) / _SOLVES)
        if load > 1.0:
            reason = f"took {load * CONTROL_PERIOD:.2f} s for a solve of a game, for which it has {CONTROL_PERIOD:g} s"
            raise flight_error(team, system, rows, reason)


@contextmanager
def reading(system: ControlSystem, name: str) -> Iterator[None]:
    """Turn errors of a system that reads commands into a CommandError that names it."""
    try:
        yield
    except CommandError as error:
        raise CommandError(f"{error} (for {system.name}, which takes {system.takes})") from error
    except FAULTS as error:
        raise CommandError(f"{name} cannot be read by the control system {system.name}: {repr_of(error)}") from error


def command_shape(system: ControlSystem, config: GameConfig) -> tuple[int, ...]:
    """Return the shape of a system's commands.

    Raises
    ------
    ConfigError
        If its space is no bounded Box, or its default command is outside of it.
    """
    with _refusing(system, "cannot say what it takes"):
        space, begins = system.space(config), np.asarray(system.default(config), np.float64)
    if not isinstance(space, spaces.Box) or not (space.shape and np.prod(space.shape) and space.is_bounded()):
        raise ConfigError(f"controllers: {system.name} must take commands of a bounded Box, got {repr_of(space)}")
    densities = (config.command_cells, config.command_cells)
    if system.takes == "density" and space.shape != densities:
        raise ConfigError(
            f"controllers: {system.name} says that it takes densities, which are of shape {densities}, got a space of "
            f"shape {space.shape}"
        )
    is_inside = begins.shape == space.shape and (space.low - TOLERANCE <= begins).all()
    if not (is_inside and (begins <= space.high + TOLERANCE).all()):
        raise ConfigError(
            f"controllers: {system.name} must begin with a command of its space, {repr_of(space)}, got shape "
            f"{begins.shape} with {repr_of(begins.tolist())[:200]}"
        )
    if system.takes != "density":
        with _refusing(system, "cannot show its commands by to_densities"):
            check_densities(system.to_densities(begins[None], config), (1, *densities), "densities")
        serves_densities(system, config)
    return tuple(space.shape)


@contextmanager
def _refusing(system: ControlSystem, failure: str) -> Iterator[None]:
    """Turn errors of a system into a ConfigError."""
    try:
        yield
    except FAULTS as error:
        reason = error if isinstance(error, SwarmError) else repr_of(error)
        raise ConfigError(f"controllers: {system.name} {failure}: {reason}") from error


@contextmanager
def flight_errors(team: int, system: ControlSystem, rows: NDArray[np.int64]) -> Iterator[None]:
    """Turn errors of a control system into a FlightError that says where."""
    try:
        yield
    except FAULTS as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(last.filename).name}:{last.lineno}"
        reason = str(error) if isinstance(error, SwarmError) else f"raised {repr_of(error)} ({where})"
        raise flight_error(team, system, rows, reason) from error


def flight_error(team: int, system: ControlSystem, rows: NDArray[np.int64], reason: str) -> FlightError:
    """Return a FlightError of a system that flies a team of some games."""
    message = f"{system.name}, which flies {TEAM_NAMES[team]}, {reason}"
    return FlightError(team, system.name, tuple(rows.tolist()), message)


def serve_densities(
    system: ControlSystem, densities: NDArray[np.float64], config: GameConfig, name: str
) -> NDArray[np.float64]:
    """Return densities (n, A, A) as commands (n, ...) of a system.

    Raises
    ------
    CommandError
        If it does not take densities; errors that it raises pass through.
    """
    served = serve(system, densities, config)
    if served is None:
        raise _mismatch(system, "density", name)
    return served


def check_kind(system: ControlSystem, kind: str, name: str) -> None:
    """Refuse commands of another kind than a system takes."""
    if system.takes != kind:
        raise _mismatch(system, kind, name)


def _mismatch(system: ControlSystem, kind: str, name: str) -> CommandError:
    return CommandError(
        f"{name}: commands of kind {kind!r} cannot fly {system.name}, which takes those of kind {system.takes!r}"
    )


def _number(system: ControlSystem, place: int) -> int:
    return {"ergodic": ERGODIC, "direct": DIRECT}.get(system.kernel, GIVEN + place)
