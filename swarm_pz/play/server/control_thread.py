"""A thread in which one game's control systems choose accelerations: one that hangs holds up no other game."""

from __future__ import annotations

from swarm_pz.config import TEAM_NAMES, TICKS_PER_CONTROL_PERIOD, GameConfig
from swarm_pz.errors import FlightError
from swarm_pz.play.server.worker import Worker
from swarm_pz.simulator import Simulator

SOLVE_S = 2.0
"""Seconds that one solve may take; the simulator checks that all of them keep up with the game."""
TRIAL_S = 120.0
"""Seconds for a solve before the game begins, which may compile something."""
_TRIAL_PERIODS = 2


class ControlThread:
    """Flies the teams of one game whose control systems are written in Python."""

    def __init__(self, game: GameConfig) -> None:
        self._game = game
        self._worker = Worker("control")

    def close(self) -> None:
        """Let the thread end."""
        self._worker.close()

    async def fly(self, simulator: Simulator, limit_s: float | None = None) -> None:
        """Let the control systems choose accelerations, where a control period begins.

        Raises FlightError if one raises, answers nonsense, cannot keep up with the game, or does not answer.
        """
        limit_s = SOLVE_S if limit_s is None else limit_s
        for team, system in enumerate(self._game.team_systems):
            if system.kernel:
                continue
            who = f"{system.name}, which flies {TEAM_NAMES[team]},"
            try:
                await self._worker.do(simulator.solve, team, limit_s=limit_s)
            except FlightError:
                raise
            except TimeoutError as error:
                raise FlightError(team, system.name, (0,), f"{who} did not answer within {limit_s:g} s") from error
            except RuntimeError as error:
                raise FlightError(team, system.name, (0,), f"{who} {error}") from error

    async def try_out(self) -> None:
        """Let the control systems fly another game for a moment; errors as of `fly`."""
        trial = Simulator(self._game)
        for _ in range(_TRIAL_PERIODS):
            await self.fly(trial, TRIAL_S)
            trial.advance(TICKS_PER_CONTROL_PERIOD)
