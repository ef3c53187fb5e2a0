"""What all games of a server share: its clock, its folder of recordings, its policies."""

from __future__ import annotations

import asyncio
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.errors import OutputError
from swarm_pz.play.game import TableConfig
from swarm_pz.play.server.policy_workers import PolicyWorkers
from swarm_pz.play.server.robots import Robots

COUNTDOWN_S = 3.0
"""Seconds for which the start is shown: time to find the drones and to draw, and for a policy's first command."""
_CATCH_UP = 2
"""Most ticks that a late game plays at once; it does not catch up with more."""


class GameClock:
    """The clock of a game at a speed, in seconds of game per second; it starts when it is created."""

    def __init__(self, speed: float) -> None:
        self._loop = asyncio.get_running_loop()
        self._period = 1.0 / (TICKS_PER_SECOND * speed)
        self._due = self._loop.time()

    async def due(self) -> int:
        """Wait for the next tick, and return the number of due ticks: more than one if it is late."""
        self._due += self._period
        await asyncio.sleep(max(self._due - self._loop.time(), 0.0))
        late = max(self._loop.time() - self._due, 0.0)
        ticks = 1 + min(int(late / self._period), _CATCH_UP - 1)
        self._due += (ticks - 1) * self._period
        if late > _CATCH_UP * self._period:
            self._due = self._loop.time()
        return ticks


def check_folder(folder: Path) -> None:
    """Make a folder, and check that games can be recorded there.

    Raises OutputError if not.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OutputError(
            f"games cannot be recorded in {folder}: {error.strerror}; choose a folder that can be written to (--out)"
        ) from error


@dataclass(frozen=True, kw_only=True)
class ServerContext:
    """What all games of a server share.

    - `table`: the default configuration; a room's settings replace parts of it.
    - `robots`: fly the games, if there are any.
    - `record_labels`: recordings hold the players' labels; without it, only people in the room see labels.
    """

    folder: Path
    workers: PolicyWorkers
    table: TableConfig = field(default_factory=TableConfig)
    countdown_s: float = COUNTDOWN_S
    record_labels: bool = True
    robots: Robots | None = None
    began: float = field(default_factory=time.monotonic)

    def now_ms(self) -> float:
        """Return the server's clock."""
        return 1000.0 * (time.monotonic() - self.began)
