"""A thread in which one game's control systems choose accelerations: one that hangs holds up no other game."""

from __future__ import annotations

import asyncio
import contextlib
import queue
import threading
from collections.abc import Callable

from swarm_pz.config import TEAM_NAMES, TICKS_PER_CONTROL_PERIOD, GameConfig
from swarm_pz.errors import FlightError
from swarm_pz.play.game import LiveGame
from swarm_pz.simulator import Simulator

SOLVE_S = 2.0
"""Seconds that one solve may take; that all of them keep up with the game, the simulator sees to."""
TRIAL_S = 120.0
"""Seconds for the first solves, before the game begins: what is compiled late is compiled then."""
_TRIAL_PERIODS = 2


class Pilot:
    """Flies one game's teams by those of its control systems that are Python's.

    Parameters
    ----------
    game : GameConfig
    """

    def __init__(self, game: GameConfig) -> None:
        self._game = game
        self._work: queue.SimpleQueue[Callable[[], None] | None] = queue.SimpleQueue()
        # A daemon: what hangs in it does not keep the server from ending.
        threading.Thread(target=self._run, name="pilot", daemon=True).start()

    def _run(self) -> None:
        while (work := self._work.get()) is not None:
            work()

    def close(self) -> None:
        """Let the thread end, as soon as it has nothing to do."""
        self._work.put(None)

    async def fly(self, game: LiveGame, team: int) -> None:
        """Let a team's control system choose, where a control period begins.

        Raises
        ------
        FlightError
            If it raises, answers nonsense, cannot keep up with the game, or does not answer.
        """
        if not self._game.team_systems[team].kernel:
            await self._wait(team, lambda: game.simulator.solve(team), SOLVE_S)

    async def try_out(self) -> None:
        """Let the control systems fly another game for a moment; errors as of `fly`."""
        trial = Simulator(self._game)
        for _ in range(_TRIAL_PERIODS):
            for team, system in enumerate(self._game.team_systems):
                if not system.kernel:
                    await self._wait(team, lambda team=team: trial.solve(team), TRIAL_S)  # type: ignore[misc]
            trial.advance(TICKS_PER_CONTROL_PERIOD)

    async def _wait(self, team: int, work: Callable[[], None], limit_s: float) -> None:
        loop = asyncio.get_running_loop()
        done: asyncio.Future[None] = loop.create_future()

        def answer(error: BaseException | None) -> None:
            if not done.done():
                done.set_result(None) if error is None else done.set_exception(error)

        def run() -> None:
            fault: BaseException | None = None
            try:
                work()
            except BaseException as error:
                fault = error
            with contextlib.suppress(RuntimeError):  # the server has ended
                loop.call_soon_threadsafe(answer, fault)

        self._work.put(run)
        try:
            await asyncio.wait_for(done, limit_s)
        except TimeoutError as error:
            system = self._game.team_systems[team].name
            told = f"{system}, which flies {TEAM_NAMES[team]}, did not answer within {limit_s:g} s"
            raise FlightError(team, system, (0,), told) from error
