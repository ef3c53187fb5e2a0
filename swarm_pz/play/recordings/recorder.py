"""Recording of a game while it is played."""

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
"""Most bytes of a flush, since an event loop waits for it."""
_PATIENCE = 120
"""Flushes in a row (a minute of game) that may fail before the recording breaks off."""
_LAST_TRIES, _LAST_PAUSE_S = 20, 0.5
"""Attempts to write the end of a game to a disk that is full, and the pause between them."""
log = logging.getLogger("swarm_pz.play")


class Recorder:
    """Writes a game into a new file; the game goes on even if writing fails.

    Lines that a full disk did not take wait until there is room again. When a game has ended, its file is synced to the
    disk. `fault` is an error of writing that players should be shown once, or empty. `is_behind` is True if the last
    flush left lines to the next one without an error.
    """

    def __init__(self, path: Path, header: Header) -> None:
        self.path, self.fault, self.is_behind = path, "", False
        self._file: io.FileIO | None = None
        self._lines: deque[Header | LogMessage] = deque([header])
        self._bytes = bytearray()
        self._failed, self._open = 0, True
        self._end: threading.Thread | None = None

    @property
    def written(self) -> bool:
        """True if the game is over and all of it in the file."""
        return not (self._open or self._lines or self._bytes)

    def write(self, message: LogMessage) -> None:
        """Append a message."""
        if self._open:
            self._lines.append(message)

    def flush(self) -> None:
        """Write waiting lines; the first call creates the file, and raises OSError if it cannot."""
        if not self._open:
            return
        if self._file is None:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self.path.open("xb", buffering=0)
        self._write_some(self._file)
        if self._failed > _PATIENCE:
            self.fault = f"the recording breaks off: {self._reason}"
            self.close()

    def close(self) -> None:
        """Finish the file; a thread writes the rest and syncs it."""
        if self._open:
            if self._file is None:
                self.flush()
            assert self._file is not None  # noqa: S101
            self._open = False
            if self._failed <= _PATIENCE:
                self._write_some(self._file)
            self._end = threading.Thread(target=self._finish, args=(self._file,), name=f"end of {self.path.name}")
            self._end.start()

    def join(self) -> None:
        """Wait until a finished game is on the disk, or writing has failed."""
        if self._end is not None:
            self._end.join()

    def _write_some(self, file: io.FileIO) -> None:
        """Write waiting lines, about `_ONE_FLUSH` bytes at most."""
        while self._lines and len(self._bytes) < _ONE_FLUSH:
            self._bytes += encode(self._lines.popleft()).encode() + b"\n"
        try:
            while self._bytes:
                del self._bytes[: file.write(self._bytes)]  # a disk that is nearly full takes a part
        except OSError as error:
            self._reason = explain(OSError(error.errno, error.strerror))
            self.fault = self.fault if self._failed else f"the recording waits, {self._reason}; the game goes on"
            self._failed += 1
        else:
            self._failed = 0
        self.is_behind = bool(self._lines) and not self._failed

    def _finish(self, file: io.FileIO) -> None:
        tries = 1 if self._failed > _PATIENCE else _LAST_TRIES
        while self._lines or self._bytes:
            self._write_some(file)
            tries -= self._failed > 0
            if not tries:
                log.warning("%s lacks its end: %s", self.path.name, self._reason)
                self._lines.clear()
                self._bytes.clear()
                break
            time.sleep(_LAST_PAUSE_S if self._failed else 0.0)
        try:
            os.fsync(file.fileno())
            sync_folder(self.path.parent)
        except OSError as error:
            log.warning("%s may not be on the disk: %s", self.path.name, explain(error))
        finally:
            file.close()


def sync_folder(folder: Path) -> None:
    """Sync a folder's entries, such as the name of a new file, to the disk."""
    if hasattr(os, "O_DIRECTORY"):  # other systems do not open folders
        opened = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(opened)
        finally:
            os.close(opened)
