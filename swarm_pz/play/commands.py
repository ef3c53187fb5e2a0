"""Commands of any kind in people's games: checked, and in the form that is followed and recorded."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import BLUE, RED, TEAM_NAMES, GameConfig
from swarm_pz.config.installed import FAULTS
from swarm_pz.config.system import serves_densities
from swarm_pz.config.values import check_densities
from swarm_pz.errors import CommandError, SwarmError
from swarm_pz.play.forms import read_form
from swarm_pz.simulator.control import Control, check_kind, serve_densities

_DECIMALS = 8
"""Decimals that densities are rounded to, so that recordings are short and hold exactly what was played."""


def as_followed(density: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a checked density (A, A) as it is followed and recorded: scaled to a largest value of 1, and rounded.

    The scale of a density has no effect, even if tiny: only ratios to its largest value count.
    """
    largest = density.max(initial=0.0)
    return np.round(density / largest if largest > 0.0 else density, _DECIMALS)


@dataclass(frozen=True)
class Command:
    """A team's checked command, with the number that its sender gave it.

    - `values`: a density (A, A), as it is followed, or a command of another kind, of the shape of its control system's
      space; float64.
    - `kind`: "density", or what the control system takes.
    - `sender`: "shared:POLICY" if a policy shared the command; else empty.
    """

    team: int
    number: int
    values: NDArray[np.float64] = field(repr=False, compare=False)
    kind: str = "density"
    sender: str = ""


class CommandReader:
    """Reads the commands of a game; it changes nothing, so threads may share it.

    - `systems`: the control systems of red and blue.
    - `cells`, `modes`: cells a side of a density, and modes a side of its target.
    """

    def __init__(self, game: GameConfig) -> None:
        self._game, self._control = game, Control(game)
        self.systems = game.team_systems
        self.cells, self.modes = game.command_cells, game.controller.modes

    def read(self, team: int, number: int, given: Any, kind: str = "density") -> Command:
        """Check a command, and return it as it is followed.

        `given` is a density (A, A), or any form that the team's control system reads; `kind` is "density", or what that
        system takes. Raises CommandError if the team or command is not valid, or the system does not take that kind.
        """
        if team not in (RED, BLUE):
            raise CommandError(f"team must be 0 (red) or 1 (blue), got {team!r}")
        system, name = self.systems[team], f"{TEAM_NAMES[team]}'s command"
        try:
            if kind != "density" or not serves_densities(system, self._game):
                check_kind(system, kind, name)
            if kind == "density":
                values = as_followed(check_densities(given, (self.cells, self.cells), name))
            else:
                values = read_form(given, system, self._game, name)
            command = Command(team, number, values, kind)
            self.packed(command)
        except SwarmError:
            raise
        except FAULTS as error:  # of a control system of another package
            raise CommandError(f"{name}: {system.name} cannot serve it: {error!r}") from error
        return command

    def answered(self, team: int, number: int, answer: NDArray[np.float64]) -> Command:
        """Return a policy's checked answer, which has the padded shape that all systems share, as a command."""
        own = self._control.unpack(answer[None], self._control.numbers[team])[0]
        kind = self.systems[team].takes
        return Command(team, number, as_followed(own) if kind == "density" else own, kind)

    def packed(self, command: Command) -> NDArray[np.float64]:
        """Return a command in the padded shape that all systems share, (1, *control.command_shape)."""
        values = command.values[None]
        if command.kind == "density":
            name = f"{TEAM_NAMES[command.team]}'s command"
            values = serve_densities(self.systems[command.team], values, self._game, name)
        return self._control.pack(values)

    def picture(self, command: Command) -> NDArray[np.float64]:
        """Return a command as a density (A, A), to show it."""
        if command.kind == "density":
            return command.values
        system = self.systems[command.team]
        try:
            drawn = system.to_densities(command.values[None], self._game)
            return np.asarray(check_densities(drawn, (1, self.cells, self.cells), "a picture of commands")[0])
        except FAULTS as error:
            raise CommandError(f"{system.name} cannot draw a command: {error!r}") from error
