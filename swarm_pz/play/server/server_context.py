"""What all games of a server share, and the clock of each."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.play.game import TableConfig
from swarm_pz.play.lsl import Markers
from swarm_pz.play.server.games_folder import SeatIndex
from swarm_pz.play.server.policy_workers import PolicyWorkers

COUNTDOWN_S = 3.0
"""Seconds for which the start is shown before the clock begins: time to find one's drones and to draw, and more than
a policy may take for a command."""
_CATCH_UP = 2
"""Ticks that a late game makes up for at once; beyond that its time slips."""


@dataclass
class Punctuality:
    """How late the latest ticks of all games were."""

    lateness_ms: deque[float] = field(default_factory=lambda: deque(maxlen=200_000))
    most_caught_up: int = 0
    slipped: int = 0
    """How often a game's time had to slip."""


class GameClock:
    """The clock of a game at a speed, in seconds of game a second; it runs from when it is made."""

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


@dataclass(frozen=True, kw_only=True)
class ServerContext:
    """What all games of a server share."""

    folder: Path
    workers: PolicyWorkers
    table: TableConfig = field(default_factory=TableConfig)
    """What rooms start from; their settings replace parts of it."""
    countdown_s: float = COUNTDOWN_S
    record_labels: bool = True
    """Whether recordings hold the players' labels; else only those at the table see them."""
    markers: Markers | None = None
    punctuality: Punctuality = field(default_factory=Punctuality)
    began: float = field(default_factory=time.monotonic)

    @cached_property
    def seat_index(self) -> SeatIndex:
        """Which recordings seats' tokens lead to."""
        return SeatIndex(self.folder)

    def now_ms(self) -> float:
        """Return the server's clock."""
        return 1000.0 * (time.monotonic() - self.began)
