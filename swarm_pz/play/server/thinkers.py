"""The policies of one game: when they are asked, and what becomes of their answers."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from swarm_pz.errors import SwarmError
from swarm_pz.kernels.game import Games
from swarm_pz.play.game import LiveGame
from swarm_pz.play.server.policy_workers import PolicySeat, PolicyWorkers

log = logging.getLogger("swarm_pz.play")


class Thinkers:
    """Asks a game's policies, each again only when it has answered; a game never waits for them.

    Parameters
    ----------
    game : LiveGame
    seed : int
        Of the game; each policy's random stream is a child of it, neither the other's nor the start's.
    seats : sequence of PolicySeat or None
        Red's and blue's; None where no policy sits.
    workers : PolicyWorkers
    answered : callable
        Told a team, the number of its command and that command, in the form that all have among others.
    failed : callable
        Told a team, and why its policy gave no command.
    """

    def __init__(
        self,
        game: LiveGame,
        seed: int,
        seats: Sequence[PolicySeat | None],
        workers: PolicyWorkers,
        answered: Callable[[int, int, NDArray[np.float64]], None],
        failed: Callable[[int, str], None],
    ) -> None:
        self._game, self._seats, self._workers = game, seats, workers
        self._seeds = [np.random.SeedSequence(seed, spawn_key=(team,)) for team in range(len(seats))]
        self._answered, self._failed = answered, failed
        self._tasks: dict[int, asyncio.Task[None]] = {}
        self._numbers = [0] * len(seats)
        self._stopped = False

    def ask(self) -> None:
        """Show the game as it is now to those that do not think yet."""
        for team, seat in enumerate(self._seats):
            if seat is not None and (team not in self._tasks or self._tasks[team].done()):
                shown = self._game.simulator.snapshot()
                self._tasks[team] = asyncio.create_task(self._think(team, seat, shown, begins=team not in self._tasks))

    async def answers(self) -> None:
        """Wait until all that were asked have answered or failed."""
        await asyncio.gather(*self._tasks.values())

    def stop(self) -> None:
        """Let go of what is asked: an answer that comes after this is nobody's."""
        self._stopped = True
        for task in self._tasks.values():
            task.cancel()
        for seat in filter(None, self._seats):
            self._workers.pause(seat)

    async def _think(self, team: int, seat: PolicySeat, shown: Games, *, begins: bool) -> None:
        try:
            answer = await self._workers.ask(seat, shown, self._seeds[team], begins=begins)
            if not self._stopped:
                self._numbers[team] += 1
                self._answered(team, self._numbers[team], answer)
        except SwarmError as error:
            self._failed(team, str(error))
        except Exception:
            log.exception("a policy was not asked")
            self._failed(team, "it could not be asked")
