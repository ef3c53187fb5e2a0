"""All that games of a server share: its clock, its folder of recordings, its policies."""

from __future__ import annotations

import asyncio
import errno
import hashlib
import logging
import tempfile
import time
from collections import deque
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.errors import OutputError
from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings.folder import is_regular
from swarm_pz.play.server.policy_workers import PolicyWorkers

COUNTDOWN_S = 3.0
"""Seconds for which the start is shown: time to find the drones and to draw, and for a policy's first command."""
_CATCH_UP = 2
"""Ticks that a late game makes up for at once; beyond that its time slips."""
NAME = ".seats"
log = logging.getLogger("swarm_pz.play")


@dataclass
class Punctuality:
    """Lateness of the latest ticks of all games."""

    lateness_ms: deque[float] = field(default_factory=lambda: deque(maxlen=2_000))
    slipped: int = 0
    """Number of times that a game's time slipped."""


class GameClock:
    """The clock of a game at a speed, in seconds of game a second; it runs from when it is made."""

    def __init__(self, speed: float, punctuality: Punctuality) -> None:
        self._loop, self._punctuality = asyncio.get_running_loop(), punctuality
        self._period = 1.0 / (TICKS_PER_SECOND * speed)
        self._due = self._loop.time()

    async def due(self) -> int:
        """Wait for the next tick, and return the number of due ticks: more than one if it is late."""
        self._due += self._period
        await asyncio.sleep(max(self._due - self._loop.time(), 0.0))
        late = max(self._loop.time() - self._due, 0.0)
        ticks = 1 + min(int(late / self._period), _CATCH_UP - 1)
        self._punctuality.lateness_ms.append(1000.0 * late)
        self._due += (ticks - 1) * self._period
        if late > _CATCH_UP * self._period:
            self._due = self._loop.time()
            self._punctuality.slipped += 1
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


class SeatIndex:
    """The recordings of the seats' latest games, in the file ``.seats``: so a token leads there after a restart, too.

    Recordings are for everybody, and a token is a key to its seat: the file has digests of tokens.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / NAME
        lines = self._path.read_text(errors="replace").split("\n") if is_regular(self._path) else []
        self._recordings = dict(line.split(" ") for line in lines if line.count(" ") == 1)

    @staticmethod
    def _digest(token: str) -> str:
        return hashlib.sha256(token.encode()).hexdigest()[:32]

    def note(self, token: str, recording: str) -> None:
        """Keep the name of the recording of a seat's game."""
        digest = self._digest(token)
        self._recordings[digest] = recording
        try:
            if self._path.is_symlink() or (self._path.exists() and not is_regular(self._path)):
                raise OSError(errno.EINVAL, "it is no regular file")
            with self._path.open("a") as file:
                file.write(f"\n{digest} {recording}\n")  # the line before may be torn
        except OSError as error:
            log.warning("%s was not written: %s", self._path, error.strerror)

    def recording_of(self, token: str) -> str | None:
        """Return the name of the recording of a token's latest game, if there was one."""
        return self._recordings.get(self._digest(token))


@dataclass(frozen=True, kw_only=True)
class ServerContext:
    """All that games of a server share.

    - `table`: the default configuration; a room's settings replace parts of it.
    - `record_labels`: recordings hold the players' labels, which else only the people in the room see.
    """

    folder: Path
    workers: PolicyWorkers
    table: TableConfig = field(default_factory=TableConfig)
    countdown_s: float = COUNTDOWN_S
    record_labels: bool = True
    punctuality: Punctuality = field(default_factory=Punctuality)
    began: float = field(default_factory=time.monotonic)

    @cached_property
    def seat_index(self) -> SeatIndex:
        """The index of the folder."""
        return SeatIndex(self.folder)

    def now_ms(self) -> float:
        """Return the server's clock."""
        return 1000.0 * (time.monotonic() - self.began)
