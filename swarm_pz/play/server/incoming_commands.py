"""Commands on their way into a game: with a helper's share, and later, where that was asked for."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.play.commands import Command
from swarm_pz.play.factors import Factors
from swarm_pz.play.game import LiveGame
from swarm_pz.play.protocol import SIDES, SeatCommand, StrokeMessage, Timing
from swarm_pz.play.server.delays import DelayLine, Measured
from swarm_pz.play.server.game_log import GameLog
from swarm_pz.play.shared import SharedCommand


class _Given(NamedTuple):
    """A command on its way, and when it arrived, on the server's clock."""

    command: Command
    received_ms: float
    strokes: list[StrokeMessage] | None = None
    timing: Timing | None = None
    unless_held: bool = False
    """It is not handed in if it holds already."""


class IncomingCommands:
    """The commands of both teams of a game.

    - `factors`: red's and blue's.
    - `log`: where they are written down.
    - `sent`: ticks at which red's and blue's players last sent one; of the start, if they have not.
    - `measured`: how much later red's and blue's were handed in than they came.
    """

    def __init__(self, game: LiveGame, factors: tuple[Factors, Factors], log: GameLog) -> None:
        self._game, self._log = game, log
        red, blue = factors
        self.sent = [game.tick, game.tick]
        self.measured = Measured(red.command_delay_ms), Measured(blue.command_delay_ms)
        self._lines = [DelayLine(own.command_delay_ms) for own in factors]
        cells = game.reader.cells
        self._shared = [
            SharedCommand(team, cells, own.share, own.helper) if own.share > 0.0 else None
            for team, own in enumerate(factors)
        ]

    def submit(
        self, command: Command, strokes: list[StrokeMessage] | None = None, timing: Timing | None = None
    ) -> None:
        """Hand in a command, followed at once by what a helper makes of it, and write both down."""
        if not command.sender:
            self.sent[command.team] = self._game.tick
        now, shared = self._log.server_ms(), self._shared[command.team]
        given = [_Given(command, now, strokes, timing)]
        if shared is not None and (mixed := shared.take(command)) is not None:
            given.append(_Given(mixed, now))
        self._give(command.team, given)

    def take_answer(self, team: int, number: int, answer: NDArray[np.float64], sender: str = "") -> None:
        """Hand in a policy's answer, unless it holds already; a helper's becomes its share of the command."""
        command = self._game.reader.answered(team, number, answer, sender)
        shared, now = self._shared[team], self._log.server_ms()
        if shared is None:
            self._give(team, [_Given(command, now, unless_held=True)])
        elif (mixed := shared.be_helped(command.values)) is not None:
            self._give(team, [_Given(mixed, now)])

    def _give(self, team: int, given: list[_Given]) -> None:
        """Hand in commands of a team, together, when its delay is over."""
        self._lines[team].put(functools.partial(self._hand_in, given), self.measured[team])

    def _hand_in(self, given: list[_Given]) -> None:
        for one in given:
            command = one.command
            if one.unless_held and self._game.holds(command):
                continue
            self._game.hand_in(command)
            plain, is_density = command.values.tolist(), command.kind == "density"
            self._log.command(
                SeatCommand(
                    seat=SIDES[command.team],
                    number=command.number,
                    density=plain if is_density else None,
                    server_ms=one.received_ms,
                    strokes=one.strokes,
                    timing=one.timing,
                    tick=self._game.tick,
                    command=None if is_density else plain,
                    sender=command.sender,
                )
            )

    def end(self) -> None:
        """Write down the commands that the end came before; within a solve they are of a tick that is not played."""
        left = [act for line in self._lines for act in line.close()]
        if not self._game.has_begun_period:
            for hand_in in left:
                hand_in()

    def drop(self) -> None:
        """Forget what is on its way: the game has not been played."""
        for line in self._lines:
            line.close()
