"""The folder of the recordings: whether it takes any, and which of them a seat's token leads to.

The latter is kept beside the recordings, so that a server that starts anew knows it. Recordings are for everybody
here, and a token is a key to its seat: so tokens stand in neither. A digest of each does, in the file ``.seats``, a
line for each person's or program's seat in each game.
"""

from __future__ import annotations

import errno
import hashlib
import logging
import os
import re
import stat
import tempfile
from pathlib import Path

from swarm_pz.errors import OutputError

NAME = ".seats"
_LINE = re.compile(r"([0-9a-f]{32}) (\S+)")
log = logging.getLogger("swarm_pz.play")


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
