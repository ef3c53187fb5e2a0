"""What all games of a server share: the clock of each, and the folder of their recordings.

Recordings are for everybody here, and a token is a key to its seat: so tokens stand in neither. A digest of each does,
in the file ``.seats``, a line for each person's or program's seat in each game: a server that starts anew knows where
a token leads.
"""

from __future__ import annotations

import asyncio
import errno
import hashlib
import logging
import os
import re
import stat
import tempfile
import time
from collections import deque
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.errors import OutputError
from swarm_pz.play.game import TableConfig
from swarm_pz.play.server.policy_workers import PolicyWorkers

COUNTDOWN_S = 3.0
"""Seconds for which the start is shown before the clock begins: time to find one's drones and to draw, and more than
a policy may take for a command."""
_CATCH_UP = 2
"""Ticks that a late game makes up for at once; beyond that its time slips."""
NAME = ".seats"
_LINE = re.compile(r"([0-9a-f]{32}) (\S+)")
log = logging.getLogger("swarm_pz.play")


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


def check_folder(folder: Path) -> None:
    """Check that games can be recorded in a folder, which is made if it is not there.

    Raises OutputError if not, and why.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OutputError(
            f"games cannot be recorded in {folder}: {error.strerror}; choose a folder that can be written to (--out)"
        ) from error


def _digest(token: str) -> str:
    return hashlib.sha256(token.encode()).hexdigest()[:32]


def _open_own(path: str, flags: int) -> int:
    """Open a regular file, and none that a link leads to: nothing outside the folder is written to, or waited for."""
    file = os.open(path, flags | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0), 0o666)
    if not stat.S_ISREG(os.fstat(file).st_mode):
        os.close(file)
        raise OSError(errno.EINVAL, "it is no regular file")
    return file


class SeatIndex:
    """The latest game of every seat that was played in a folder; read once, when it is made.

    - `folder`: of the recordings.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / NAME
        self._recordings: dict[str, str] = {}
        if self._path.is_file() and not self._path.is_symlink():
            text = self._path.read_text(errors="replace")
            self._recordings |= {found[1]: found[2] for found in map(_LINE.fullmatch, text.splitlines()) if found}

    def note(self, token: str, recording: str) -> None:
        """Note that the game of a token's seat is recorded in a file of this name."""
        digest = _digest(token)
        self._recordings[digest] = recording
        try:
            with open(self._path, "a", opener=_open_own) as file:
                file.write(f"\n{digest} {recording}\n")  # whatever the line before lacks
        except OSError as error:
            log.warning("%s was not written: %s", self._path, error.strerror)

    def recording_of(self, token: str) -> str | None:
        """Return the name of the recording of a token's latest game, if there was one."""
        return self._recordings.get(_digest(token))


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
    punctuality: Punctuality = field(default_factory=Punctuality)
    began: float = field(default_factory=time.monotonic)

    @cached_property
    def seat_index(self) -> SeatIndex:
        """Which recordings seats' tokens lead to."""
        return SeatIndex(self.folder)

    def now_ms(self) -> float:
        """Return the server's clock."""
        return 1000.0 * (time.monotonic() - self.began)
