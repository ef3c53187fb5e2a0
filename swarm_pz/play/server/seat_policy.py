"""A policy that has a seat, or helps who has it, while it is loaded and from then on."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Literal

from swarm_pz.errors import SwarmError
from swarm_pz.play.server.policy_workers import PolicySeat, PolicyWorkers

log = logging.getLogger("swarm_pz.play")


class SeatPolicy:
    """Loads a policy for a seat; nobody waits for it.

    Parameters
    ----------
    place : PolicySeat
        Where it is loaded.
    workers : PolicyWorkers
        Who load it.
    told : callable
        Told when it is loaded, or has failed.

    Attributes
    ----------
    state : str
        "loading", "loaded" or "failed".
    reason : str
        Why it could not be loaded.
    """

    def __init__(self, place: PolicySeat, workers: PolicyWorkers, told: Callable[[], None]) -> None:
        self.place, self._workers, self._told = place, workers, told
        self.state: Literal["loading", "loaded", "failed"] = "loading"
        self.reason = ""
        self._task = asyncio.create_task(self._load())

    async def _load(self) -> None:
        try:
            await self._workers.load(self.place)
        except SwarmError as error:
            self.state, self.reason = "failed", str(error)[:500]
        except Exception:
            log.exception("a policy was not loaded")
            self.state, self.reason = "failed", "it could not be loaded"
        else:
            self.state = "loaded"
        self._told()

    def close(self) -> None:
        """Let it go."""
        self._task.cancel()
        self._workers.forget(self.place)
