"""Commands on their way into a game: mixed with a helper's (shared control), and delayed, if the factors ask for it."""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.play.commands import Command, as_followed
from swarm_pz.play.factors import Factors
from swarm_pz.play.game import LiveGame
from swarm_pz.play.protocol import SIDES, SeatCommand, StrokeMessage, Timing
from swarm_pz.play.server.delays import DelayLine, Measured
from swarm_pz.play.server.game_log import GameLog


def mixture(own: NDArray[np.float64], helpers: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Return two densities (A, A) mixed, each scaled to a sum of 1; an empty one counts as uniform."""
    parts = [
        density / density.sum() if density.any() else np.full_like(density, 1.0 / density.size)
        for density in (own, helpers)
    ]
    return as_followed((1.0 - share) * parts[0] + share * parts[1])


class SharedCommand:
    """Mixes the latest densities of a team's player and its helper; `cells` a side."""

    def __init__(self, team: int, cells: int, share: float, helper: str) -> None:
        self._team, self._share, self._sender = team, share, f"shared:{helper}"
        self._own = Command(team, 0, np.ones((cells, cells)))
        self._helpers: NDArray[np.float64] | None = None
        self._latest = np.zeros(0)

    def take(self, own: Command) -> Command | None:
        """Take the player's command; return the mixed one, or None before the helper's first."""
        self._own = own
        return self._mixed()

    def be_helped(self, helpers: NDArray[np.float64]) -> Command | None:
        """Take the helper's density; return the mixed command, or None if it is unchanged."""
        self._helpers = helpers
        before, now = self._latest, self._mixed()
        return None if np.array_equal(before, self._latest) else now

    def _mixed(self) -> Command | None:
        if self._helpers is None:
            return None
        self._latest = mixture(self._own.values, self._helpers, self._share)
        return Command(self._team, self._own.number, self._latest, "density", self._sender)


class _Arrived(NamedTuple):
    """A command, and its arrival on the server's clock; with `unless_held`, it is dropped if `LiveGame.holds` it."""

    command: Command
    received_ms: float
    strokes: list[StrokeMessage] | None = None
    timing: Timing | None = None
    unless_held: bool = False


class IncomingCommands:
    """The commands of both teams of a game; `measured` has the delays of red's and blue's."""

    def __init__(self, game: LiveGame, factors: tuple[Factors, Factors], log: GameLog) -> None:
        self._game, self._log = game, log
        red, blue = factors
        self.measured = Measured(red.command_delay_ms), Measured(blue.command_delay_ms)
        self._lines = [DelayLine(own.command_delay_ms) for own in factors]
        self._shared = [
            SharedCommand(team, game.reader.cells, own.share, own.helper) if own.share > 0.0 else None
            for team, own in enumerate(factors)
        ]

    def submit(
        self, command: Command, strokes: list[StrokeMessage] | None = None, timing: Timing | None = None
    ) -> None:
        """Take a command, followed at once by its mixture with a helper's."""
        now, shared = self._log.server_ms(), self._shared[command.team]
        arrived = [_Arrived(command, now, strokes, timing)]
        if shared is not None and (mixed := shared.take(command)) is not None:
            arrived.append(_Arrived(mixed, now))
        self._delay(command.team, arrived)

    def take_answer(self, team: int, number: int, answer: NDArray[np.float64]) -> None:
        """Take a policy's answer, unless `LiveGame.holds` it; a helper's answer is mixed with the player's command."""
        command = self._game.reader.answered(team, number, answer)
        shared, now = self._shared[team], self._log.server_ms()
        if shared is None:
            self._delay(team, [_Arrived(command, now, unless_held=True)])
        elif (mixed := shared.be_helped(command.values)) is not None:
            self._delay(team, [_Arrived(mixed, now)])

    def _delay(self, team: int, arrived: list[_Arrived]) -> None:
        self._lines[team].put(functools.partial(self._hand_in, arrived), self.measured[team])

    def _hand_in(self, arrived: list[_Arrived]) -> None:
        for command, received_ms, strokes, timing, unless_held in arrived:
            if unless_held and self._game.holds(command):
                continue
            self._game.hand_in(command)
            plain, is_density = command.values.tolist(), command.kind == "density"
            self._log.command(
                SeatCommand(
                    seat=SIDES[command.team],
                    number=command.number,
                    density=plain if is_density else None,
                    server_ms=received_ms,
                    strokes=strokes,
                    timing=timing,
                    tick=self._game.tick,
                    command=None if is_density else plain,
                    sender=command.sender,
                )
            )

    def end(self, *, is_played: bool) -> None:
        """Record commands still delayed at the end of a game.

        They are dropped within a solve, since they would come later, and if the game was called off.
        """
        left = [act for line in self._lines for act in line.close()]
        if is_played and not self._game.has_begun_period:
            for hand_in in left:
                hand_in()
