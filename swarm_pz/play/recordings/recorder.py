"""Writes a game down as it is played."""

from __future__ import annotations

import io
import logging
import os
import threading
import time
from collections import deque
from pathlib import Path

from swarm_pz.files import explain
from swarm_pz.play.protocol import Header, LogMessage, encode

_ONE_FLUSH = 256 * 1024
"""Bytes that a flush writes at most: an event loop waits for it, and a game that is taken over has many lines."""
_PATIENCE = 120
"""Flushes in a row that may fail, a minute of game, before the recording breaks off."""
_LAST_TRIES, _LAST_PAUSE_S = 20, 0.5
"""How often, and how far apart, the end of a game is tried to be written to a disk that is full."""
log = logging.getLogger("swarm_pz.play")


class Recorder:
    """Writes a game into a file that is not there yet; a game goes on even if it can no longer be written down.

    What a full disk did not take waits until there is room again, and the file goes on where it stopped. When a game
    has ended, its file is written through to the disk itself.
    """

    def __init__(self, path: Path, header: Header) -> None:
        self.path = path
        self.fault = ""
        """What keeps the recording from being written, to be told once; empty if nothing does."""
        self.is_behind = False
        """Whether the last flush left lines to the next one, though the disk took all that it was given."""
        self._file: io.FileIO | None = None
        self._lines: deque[Header | LogMessage] = deque([header])
        self._bytes = bytearray()
        self._failed = 0
        self._open = True
        self._end: threading.Thread | None = None

    @property
    def written(self) -> bool:
        """Whether the game is over and all of it in the file."""
        return not (self._open or self._lines or self._bytes)

    def write(self, line: LogMessage) -> None:
        """Append a line."""
        if self._open:
            self._lines.append(line)

    def flush(self) -> None:
        """Hand what was written to the system, in a file that the first call makes, or raise OSError if it cannot."""
        if not self._open:
            return
        if self._file is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self.path.open("xb", buffering=0)
        self._write_some()
        if self._failed > _PATIENCE:
            self.fault = f"the recording breaks off: {self._reason}"
            self.close()

    def close(self) -> None:
        """Finish the file; what takes long is done in a thread."""
        if not self._open:
            return
        if self._file is None:
            self.flush()
        self._open = False
        if self._failed <= _PATIENCE:
            self._write_some()
        self._end = threading.Thread(target=self._finish, name=f"end of {self.path.name}")
        self._end.start()

    def join(self) -> None:
        """Wait until a game that is over is on the disk, or cannot be."""
        if self._end is not None:
            self._end.join()

    def _write_some(self) -> None:
        """Write what waits, but not so much that it takes long; what was not taken goes on waiting."""
        assert self._file is not None  # noqa: S101
        while self._lines and len(self._bytes) < _ONE_FLUSH:
            self._bytes += encode(self._lines.popleft()).encode() + b"\n"
        try:
            while self._bytes:
                del self._bytes[: self._file.write(self._bytes)]  # a disk that is nearly full takes a part
        except OSError as error:
            self._reason = explain(OSError(error.errno, error.strerror))
            self.fault = self.fault if self._failed else f"the recording waits, {self._reason}; the game goes on"
            self._failed += 1
        else:
            self._failed = 0
        self.is_behind = bool(self._lines) and not self._failed

    def _finish(self) -> None:
        assert self._file is not None  # noqa: S101
        tries = 1 if self._failed > _PATIENCE else _LAST_TRIES
        while self._lines or self._bytes:
            self._write_some()
            tries -= self._failed > 0
            if not tries:
                log.warning("%s lacks its end: %s", self.path.name, self._reason)
                self._lines.clear()
                self._bytes.clear()
                break
            time.sleep(_LAST_PAUSE_S if self._failed else 0.0)
        try:
            os.fsync(self._file.fileno())
            sync_folder(self.path.parent)
        except OSError as error:
            log.warning("%s may not be on the disk: %s", self.path.name, explain(error))
        finally:
            self._file.close()


def sync_folder(folder: Path) -> None:
    """Write the folder's entries, the file's name among them, to the disk."""
    if not hasattr(os, "O_DIRECTORY"):
        return  # this system opens no folders
    opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(opened)
    finally:
        os.close(opened)
