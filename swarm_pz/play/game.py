"""One game as people play it: tick by tick, with commands that arrive at any tick.

It has no clock, network or file: the caller of `LiveGame.advance` sets the pace.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import TEAM_NAMES, TICKS_PER_CONTROL_PERIOD, TICKS_PER_SECOND, GameConfig
from swarm_pz.config.base import Config, Range, check, hash_exempt
from swarm_pz.errors import ConfigError
from swarm_pz.kernels.fourier import SAME_TARGET
from swarm_pz.play.commands import Command, CommandReader
from swarm_pz.play.factors import Factors
from swarm_pz.play.strokes import Mapping, mapping_of
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.commands import CheckedCommands, make_target
from swarm_pz.simulator.spawn import Seed

SPEED_LIMIT = 4.0
"""Largest velocity of a robot's pose, in the units of velocity of the rules."""


@dataclass(frozen=True, kw_only=True)
class TableConfig(Config):
    """The configuration of a table.

    - `game`: the rules. Policies are asked for a command once in each command period.
    - `min_command_interval`: seconds of game between two commands of a team that come into force, whoever sends them.
      Of commands that arrive sooner, the latest waits.
    - `mapping`: from strokes to a density; see `swarm_pz.play.strokes`. None becomes `mapping_of(game)`.
    - `speed`: seconds of game per second; a speed in the factors replaces it.
    - `factors`: what an experimenter varies at red's seat, and at blue's.
    - `majority`: when time is up, the side with more drones wins, and equal sides draw. Without it, all such games are
      draws.
    """

    game: GameConfig = field(default_factory=GameConfig)
    min_command_interval: Annotated[float, Range(0.0, 60.0)] = 0.5
    mapping: Mapping = None  # type: ignore[assignment]  # None until the rules are known
    speed: Annotated[float, Range(0.1, 10.0)] = 1.0
    factors: tuple[Factors, Factors] = (Factors(), Factors())
    majority: bool = hash_exempt(False)

    def __post_init__(self) -> None:
        super().__post_init__()
        self.game.to_dict()  # refuses what no recording can name
        if vars(self)["mapping"] is None:  # despite its declared type
            object.__setattr__(self, "mapping", mapping_of(self.game))
        pair = self.factors
        object.__setattr__(self, "factors", tuple(one.bare for one in pair))
        speeds = {one.speed for one in pair} - {1.0}
        check(len(speeds) < 2, "factors: speed", sorted(speeds), "the same for both seats: a table has one clock")
        if speeds:
            object.__setattr__(self, "speed", speeds.pop())
        for side, one, system in zip(TEAM_NAMES, pair, self.game.team_systems, strict=True):
            if one.share > 0.0 and system.takes != "density":
                raise ConfigError(
                    f"factors: {side} cannot share its command with {one.helper}: only densities are mixed, and {side} "
                    f"is flown by {system.name}, which takes commands of kind {system.takes!r}; expected share 0"
                )

    @property
    def varies(self) -> bool:
        """True if an experimenter varies anything."""
        return any(one != Factors() for one in self.factors)

    @property
    def interval_ticks(self) -> int:
        """Least ticks between two commands that come into force, in whole control periods."""
        periods = np.ceil(self.min_command_interval * TICKS_PER_SECOND / TICKS_PER_CONTROL_PERIOD - 1e-6)
        return int(periods) * TICKS_PER_CONTROL_PERIOD


@dataclass(frozen=True)
class InForce:
    """A command that the swarm follows from a tick on."""

    tick: int
    command: Command


@dataclass(frozen=True)
class Captured:
    """A drone that a team captured in a tick."""

    tick: int
    drone: int
    team: int


Event = InForce | Captured


class LiveGame:
    """A game that its caller advances, with its simulator and the reader of its commands.

    With `robots`, drones move by `place` alone.
    """

    def __init__(self, config: TableConfig, seed: Seed, *, robots: bool = False) -> None:
        self.config, self.reader = config, CommandReader(config.game)
        self.simulator = Simulator(config.game, external_motion=robots)
        self.simulator.reset([seed])
        self._waiting: list[Command | None] = [None, None]
        self._begun = -1
        """The tick whose control period has begun: commands count from the next one on."""
        self._last_in_force = [-config.interval_ticks] * 2

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
        """True if one team owns every drone or time is up."""
        return bool(self.simulator.decided[0]) or self.tick >= self.config.game.limit_ticks

    @property
    def outcome(self) -> Literal["red", "blue", "draw"] | None:
        """Return "red", "blue" or "draw" of a game that is over."""
        red, blue = self.sizes
        if self.simulator.decided[0] or (self.over and self.config.majority and red != blue):
            return "red" if red > blue else "blue"
        return "draw" if self.over else None

    def check_size(self, command: Command) -> None:
        """Raise CommandError if a team cannot fly a command with its present number of drones."""
        team, control, name = command.team, self.simulator.control, f"{TEAM_NAMES[command.team]}'s command"
        flown_by, sizes = self.simulator.games.flown_by[:, team], self.simulator.sizes[:, team]
        control.check_sizes(self.reader.packed(command), flown_by, sizes, name)

    def submit(self, team: int, number: int, given: Any, kind: str = "density") -> Command:
        """Read a command, hand it in and return it; errors are as in `CommandReader.read`, and change nothing."""
        command = self.reader.read(team, number, given, kind)
        self.check_size(command)
        self.hand_in(command)
        return command

    def hand_in(self, command: Command) -> None:
        """Let a command wait for its solve; it replaces its team's command that still waits, if there is one."""
        self._waiting[command.team] = command

    def holds(self, command: Command) -> bool:
        """Return true if a policy, which answers at every step, need not hand in a command again.

        That is so if the command equals its team's last one, and only if resending has an effect: with the ergodic
        controller by the rules (see `GameConfig.tells_sending`), with other control systems always.
        """
        game, team, waiting = self.config.game, command.team, self._waiting[command.team]
        if self.reader.systems[team].kernel != "ergodic":
            packed, last = self.reader.packed(command).ravel(), self.simulator.games.commands[0, team]
            former = last if waiting is None else self.reader.packed(waiting).ravel()
            return bool((packed == former[: packed.size]).all())
        if not game.tells_sending:
            return False
        modes = game.controller.modes
        held = self.simulator.targets[0, team] if waiting is None else make_target(waiting.values, modes)[0]
        return bool(np.abs(make_target(command.values, modes)[0] - held).max() <= SAME_TARGET)

    def put_in_force(self, command: Command) -> None:
        """Let a team follow a command from the next solve on, however recent its last one is."""
        self.simulator.command(command.team, CheckedCommands(self.reader.packed(command)))
        self._last_in_force[command.team] = self.tick

    def place(self, poses: NDArray[np.float32]) -> None:
        """Move drones to their measured poses (N, 4), x, y and velocity; a row of NaN is a lost drone.

        By the rules, a lost drone has failed, and rests at its last position.
        """
        games, lost = self.simulator.games, np.isnan(poses).any(axis=1)
        games.positions[0, ~lost], games.velocities[0, ~lost] = poses[~lost, :2], poses[~lost, 2:]
        games.velocities[0, lost] = 0.0
        games.failed[0] = lost

    def advance(self, ticks: int = 1) -> list[Event]:
        """Advance the game, or to its end, and return its events in order."""
        events: list[Event] = []
        for _ in range(ticks):
            if self.over:
                break
            events += self.begin_period()
            before = self.simulator.games.teams[0].copy()
            self.simulator.advance(1)
            teams = self.simulator.games.teams[0]
            events += [Captured(self.tick, int(i), int(teams[i])) for i in np.flatnonzero(teams != before)]
        return events

    @property
    def is_at_solve(self) -> bool:
        """True if a control period begins."""
        return self.tick % TICKS_PER_CONTROL_PERIOD == 0

    @property
    def has_begun_period(self) -> bool:
        """True if the solve of this tick has begun: commands count from the next one on."""
        return self.tick == self._begun

    def begin_period(self) -> list[InForce]:
        """Put waiting commands in force if a control period begins; a second call, as by `advance`, does nothing."""
        if not self.is_at_solve or self.has_begun_period:
            return []
        self._begun, begun = self.tick, []
        for team, command in enumerate(self._waiting):
            if command is not None and self.tick - self._last_in_force[team] >= self.config.interval_ticks:
                self._waiting[team] = None
                self.put_in_force(command)
                begun.append(InForce(self.tick, command))
        return begun
