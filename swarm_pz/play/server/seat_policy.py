"""A policy that commands for a seat: the seat's own, its player's helper, or that of an automatic response."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine
from typing import Any, Literal

from swarm_pz.errors import SwarmError
from swarm_pz.play.server.policy_workers import Answer, PolicySeat, PolicyWorkers
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.spawn import Seed

log = logging.getLogger("swarm_pz.play")


async def _fault_of(work: Coroutine[Any, Any, None], unexpected: str) -> str:
    """Await work, and return why it failed; nothing if it did not."""
    try:
        await work
    except SwarmError as error:
        return str(error)[:500]
    except Exception:
        log.exception("a policy was not loaded or asked")
        return unexpected
    return ""


class SeatPolicy:
    """Loads a policy, and asks it when it is free; no game waits for either.

    - `changed`: called when the policy is loaded, or has failed.
    - `state`: one of "loading", "loaded", "failed".
    - `reason`: why it could not be loaded.
    """

    def __init__(self, place: PolicySeat, workers: PolicyWorkers, changed: Callable[[], None]) -> None:
        self.place, self._workers = place, workers
        self.state: Literal["loading", "loaded", "failed"] = "loading"
        self.reason = ""
        self._plays = False
        self._question: asyncio.Task[None] | None = None
        self._loading = asyncio.create_task(self._load(changed))

    async def _load(self, changed: Callable[[], None]) -> None:
        self.reason = await _fault_of(self._workers.load(self.place), "it could not be loaded")
        self.state = "failed" if self.reason else "loaded"
        changed()

    def ask(
        self, simulator: Simulator, seed: Seed, answered: Callable[[Answer], None], failed: Callable[[str], None]
    ) -> None:
        """Show a game to the policy, unless it still thinks; the first question of a game starts its random stream."""
        if self._question is not None and not self._question.done():
            return
        games, begins, self._plays = simulator.snapshot(), not self._plays, True

        async def ask() -> None:
            answered(await self._workers.ask(self.place, games, seed, begins=begins))

        async def watch() -> None:
            if reason := await _fault_of(ask(), "it could not be asked"):
                failed(reason)

        self._question = asyncio.create_task(watch())

    async def wait(self) -> None:
        """Wait until it has answered or failed."""
        if self._question is not None:
            await self._question

    def rest(self) -> None:
        """End its game: an answer that comes later is dropped."""
        self._plays = False
        self._drop_question()
        self._workers.pause(self.place)

    def _drop_question(self) -> None:
        if self._question is not None:
            self._question.cancel()
        self._question = None

    def close(self) -> None:
        """Let the policy go."""
        self._loading.cancel()
        self._drop_question()
        self._workers.forget(self.place)
