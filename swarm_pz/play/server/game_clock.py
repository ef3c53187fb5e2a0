"""The clock of a game in real time: which of its ticks are due."""

from __future__ import annotations

import asyncio
from collections import deque
from dataclasses import dataclass, field

from swarm_pz.config import TICKS_PER_SECOND

_CATCH_UP = 2
"""Ticks that a late game makes up for at once; beyond that its time slips."""


@dataclass
class Punctuality:
    """How late the ticks of all games were, of late."""

    lateness_ms: deque[float] = field(default_factory=lambda: deque(maxlen=200_000))
    most_caught_up: int = 0
    slipped: int = 0
    """How often a game's time had to slip."""


class GameClock:
    """Runs from when it is made.

    Parameters
    ----------
    speed : float
        Seconds of game a second.
    punctuality : Punctuality
        Where it is noted how late ticks are.
    """

    def __init__(self, speed: float, punctuality: Punctuality) -> None:
        self._loop, self._punctuality = asyncio.get_running_loop(), punctuality
        self._period = 1.0 / (TICKS_PER_SECOND * speed)
        self._due = self._loop.time()

    async def due(self) -> int:
        """Wait for the next tick, and return how many are due: more than one if it is late."""
        self._due += self._period
        await asyncio.sleep(max(self._due - self._loop.time(), 0.0))
        late = max(self._loop.time() - self._due, 0.0)
        ticks = 1 + min(int(late / self._period), _CATCH_UP - 1)
        self._punctuality.lateness_ms.append(1000.0 * late)
        self._punctuality.most_caught_up = max(self._punctuality.most_caught_up, ticks)
        self._due += (ticks - 1) * self._period
        if late > _CATCH_UP * self._period:
            self._due = self._loop.time()
            self._punctuality.slipped += 1
        return ticks
