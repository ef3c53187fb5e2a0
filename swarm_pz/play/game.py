"""One game as people play it: tick by tick, with commands that come whenever they come.

No clock, network or file in here: who calls `LiveGame.advance` decides how fast time goes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import (
    BLUE,
    RED,
    TEAM_NAMES,
    TICKS_PER_CONTROL_PERIOD,
    TICKS_PER_SECOND,
    GameConfig,
)
from swarm_pz.config.base import Config, check, check_number
from swarm_pz.config.values import check_densities
from swarm_pz.errors import CommandError
from swarm_pz.kernels.fourier import SAME_TARGET
from swarm_pz.kernels.game import Games
from swarm_pz.play.strokes import DEFAULT_MAPPING, MAPPINGS, Mapping
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.commands import make_target
from swarm_pz.simulator.spawn import Seed

_DECIMALS = 4
"""Digits of a density at the table, so that recordings hold exactly what was played, and are short."""


def as_followed(density: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a checked density (A, A) as it is followed and written down at the table: its largest value 1, rounded.

    An image and its double are the same, however faint: only what stands beside its largest value counts.
    """
    largest = density.max(initial=0.0)
    return np.round(density / largest if largest > 0.0 else density, _DECIMALS)


@dataclass(frozen=True, kw_only=True)
class TableConfig(Config):
    """What everybody at a table shares.

    Attributes
    ----------
    game : GameConfig
        The rules. A command period is how often a policy at the table is asked.
    min_command_interval : float
        Seconds of game between two commands of a team that come into force, whoever gives them; of
        those that come sooner, the latest waits.
    mapping : {"firm", "bold", "paper"}
        From strokes to a density; see `swarm_pz.play.strokes`.
    speed : float
        Seconds of game a second.
    """

    game: GameConfig = field(default_factory=GameConfig)
    min_command_interval: float = 0.5
    mapping: Mapping = DEFAULT_MAPPING
    speed: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check(isinstance(self.game, GameConfig), "game", self.game, "a GameConfig")
        check_number(self.min_command_interval, "min_command_interval", 0.0, 60.0)
        is_known = isinstance(self.mapping, str) and self.mapping in MAPPINGS
        check(is_known, "mapping", self.mapping, f"one of {', '.join(MAPPINGS)}")
        check_number(self.speed, "speed", 0.1, 10.0)

    @property
    def interval_ticks(self) -> int:
        """Ticks between two commands that come into force; they do so at solves."""
        periods = np.ceil(self.min_command_interval * TICKS_PER_SECOND / TICKS_PER_CONTROL_PERIOD - 1e-6)
        return int(periods) * TICKS_PER_CONTROL_PERIOD


@dataclass(frozen=True)
class Command:
    """A team's command, its density checked, and the number by which its sender knows it."""

    team: int
    number: int
    density: NDArray[np.float64] = field(repr=False, compare=False)


@dataclass(frozen=True)
class InForce:
    """A command that the swarm follows from a tick on."""

    tick: int
    command: Command


@dataclass(frozen=True)
class Captured:
    """A drone that a team took in a tick."""

    tick: int
    drone: int
    team: int


Event = InForce | Captured


class LiveGame:
    """A game that runs as long as somebody advances it.

    Parameters
    ----------
    config : TableConfig
    seed : int or SeedSequence
        Of the start.

    Attributes
    ----------
    simulator : Simulator
        Of this one game.
    """

    def __init__(self, config: TableConfig, seed: Seed) -> None:
        self.config = config
        self.simulator = Simulator(config.game)
        self.simulator.reset([seed])
        self._waiting: list[Command | None] = [None, None]
        self._never = -config.interval_ticks
        self._last_in_force = [self._never, self._never]

    @property
    def tick(self) -> int:
        """Ticks since the start."""
        return int(self.simulator.games.ticks[0])

    @property
    def sizes(self) -> tuple[int, int]:
        """Drones of red and blue."""
        red, blue = self.simulator.sizes[0]
        return int(red), int(blue)

    @property
    def over(self) -> bool:
        """Whether one team owns every drone or time is up."""
        return bool(self.simulator.decided[0]) or self.tick >= self.config.game.limit_ticks

    @property
    def outcome(self) -> str | None:
        """Return "red", "blue" or "draw" of a game that is over."""
        if not self.over:
            return None
        if not self.simulator.decided[0]:
            return "draw"
        return TEAM_NAMES[RED if self.sizes[RED] else BLUE]

    def submit(self, team: int, number: int, density: ArrayLike) -> Command:
        """Hand in a command, and return it as it will be followed; one that still waits is forgotten.

        Raises
        ------
        CommandError
            If the team or the density is not valid; the game goes on with what it had.
        """
        if team not in (RED, BLUE):
            raise CommandError(f"team must be 0 (red) or 1 (blue), got {team!r}")
        cells = self.config.game.command_cells
        values = check_densities(density, (cells, cells), f"{TEAM_NAMES[team]}'s command")
        return self.submit_checked(team, number, values)

    def submit_checked(self, team: int, number: int, density: NDArray[np.float64]) -> Command:
        """As `submit`, for who has checked team and density (A, A) already."""
        command = Command(team, number, as_followed(density))
        self._waiting[team] = command
        return command

    def holds(self, team: int, density: NDArray[np.float64]) -> bool:
        """Whether a checked density (A, A) need not be handed in by who asks for something at every step.

        It asks for what was handed in last, and the rules tell that held from that sent again; see `MemoryConfig`.
        """
        game, waiting, last = self.config.game, self._waiting[team], self.simulator.targets[0, team]
        if not game.tells_sending:
            return False
        if waiting is not None:
            last, _ = make_target(waiting.density, game.controller.modes)
        asked, _ = make_target(as_followed(density), game.controller.modes)
        return bool(np.abs(asked - last).max() <= SAME_TARGET)

    def withdraw(self) -> None:
        """Forget the commands that wait."""
        self._waiting = [None, None]

    def put_in_force(self, command: Command) -> None:
        """Let a team follow a command from the next solve on, however young its last one is."""
        first, name = np.zeros(1, np.int64), f"{TEAM_NAMES[command.team]}'s command"
        flown_by = self.simulator.games.flown_by[first, command.team]
        commands = self.simulator.control.read(command.density[None], flown_by, "density", name)
        self.simulator.command_checked(command.team, commands, first)
        self._last_in_force[command.team] = self.tick

    def restore(self, games: Games, last_in_force: Sequence[int | None]) -> None:
        """Go to a moment that was kept.

        Parameters
        ----------
        games : Games
            A snapshot of this game's simulator.
        last_in_force : sequence of int or None
            Ticks at which the last commands of red and blue had come into force before; None if there was none.
        """
        self.simulator.restore(games)
        self._waiting = [None, None]
        self._last_in_force = [self._never if tick is None else tick for tick in last_in_force]

    def advance(self, ticks: int = 1) -> list[Event]:
        """Advance the game, or to its end, and return what happened, in order."""
        events: list[Event] = []
        for _ in range(ticks):
            if self.over:
                break
            if self.tick % TICKS_PER_CONTROL_PERIOD == 0:
                events += self._take_waiting()
            before = self.simulator.games.teams[0].copy()
            self.simulator.advance(1)
            teams = self.simulator.games.teams[0]
            events += [Captured(self.tick, int(i), int(teams[i])) for i in np.flatnonzero(teams != before)]
        return events

    def _take_waiting(self) -> Iterable[InForce]:
        for team, command in enumerate(self._waiting):
            if command is not None and self.tick - self._last_in_force[team] >= self.config.interval_ticks:
                self._waiting[team] = None
                self.put_in_force(command)
                yield InForce(self.tick, command)
