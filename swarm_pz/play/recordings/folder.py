"""A folder of recorded games: only regular files of the folder itself, none of them too large, and their summaries.

Links are refused, since they may lead to private files, and pipes, since opening one blocks.
"""

from __future__ import annotations

import contextlib
import re
import stat
from pathlib import Path

from msgspec import Struct

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.errors import ConfigError, ProtocolError, RecordingError
from swarm_pz.files import opened, read_bytes
from swarm_pz.play.protocol import EndedBy, EndMessage, Header, Outcome, RecordedSeat, decode_log

SUFFIX = ".jsonl"
MOST_BYTES = 256 * 2**20
"""Largest file that is read."""
END_BYTES = 8 * 2**10
"""Bytes read from a file's beginning and end for its summary; its first and last lines are shorter."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}\.jsonl")


def checked_name(name: str) -> str:
    """Return the name of a recording, or raise RecordingError if it is no plain file name that ends in ``.jsonl``."""
    if not _NAME.fullmatch(name) or ".." in name:
        raise RecordingError(f"a recording's name must be letters, digits and . _ - with {SUFFIX}, got {name[:80]!r}")
    return name


def is_regular(path: Path) -> bool:
    """Return True if a path is of a regular file, and no link to one."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except OSError:
        return False


def read_regular(path: Path) -> bytes:
    """Return the bytes of a recording's file; raise RecordingError if it is no regular file or above `MOST_BYTES`."""
    try:
        return read_bytes(path, MOST_BYTES, links=False)
    except ConfigError as error:
        raise RecordingError(f"{path} {error}") from error


def read_ends(path: Path, count: int) -> tuple[bytes, bytes]:
    """Return at most `count` first and last bytes of a file; raise RecordingError if it is no regular file."""
    try:
        with opened(path, links=False) as (file, size):
            first = file.read(count)
            file.seek(max(size - count, 0))
            return first, file.read(count)
    except ConfigError as error:
        raise RecordingError(f"{path} {error}") from error


class Summary(Struct):
    """The summary of a recorded game; fields that its file does not tell stay empty.

    `seconds` is the length in game time; `sizes` are the numbers of red and blue drones at the end.
    """

    name: str
    started: str | None = None
    red: RecordedSeat | None = None
    blue: RecordedSeat | None = None
    lesson: bool = False
    outcome: Outcome | None = None
    ended_by: EndedBy | None = None
    seconds: float | None = None
    sizes: tuple[int, int] | None = None


def summary_of(path: Path) -> Summary:
    """Return the summary of a file, from its first and its last line."""
    summary = Summary(path.name)
    with contextlib.suppress(RecordingError, ProtocolError):
        first, last = read_ends(path, END_BYTES)
        header = decode_log(first.partition(b"\n")[0])
        if not isinstance(header, Header):
            return summary
        summary.started, summary.lesson = header.started, header.lesson
        summary.red, summary.blue = header.red, header.blue
        end = decode_log(last.removesuffix(b"\n").rpartition(b"\n")[2])
        if not isinstance(end, EndMessage):
            return summary
        summary.outcome, summary.ended_by, summary.sizes = end.outcome, end.ended_by, end.sizes
        summary.seconds = round(end.tick / TICKS_PER_SECOND, 1)
    return summary
