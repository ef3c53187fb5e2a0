"""A folder of recorded games: only regular files of the folder itself, and none that is too large.

A link may lead to somebody's private file, and opening a pipe waits for its writer.
"""

from __future__ import annotations

import re
import stat
from pathlib import Path

from swarm_pz.errors import ConfigError, RecordingError
from swarm_pz.files import opened, read_bytes

SUFFIX = ".jsonl"
MOST_BYTES = 256 * 2**20
"""Largest file that is read."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}\.jsonl")


def checked_name(name: str) -> str:
    """Return the name of a recording, or raise RecordingError if it is no plain file name that ends in ``.jsonl``."""
    if not _NAME.fullmatch(name) or ".." in name:
        raise RecordingError(f"a recording's name must be letters, digits and . _ - with {SUFFIX}, got {name[:80]!r}")
    return name


def is_regular(path: Path) -> bool:
    """Tell whether a path is of a regular file, and no link to one."""
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
    """Return at most `count` first and `count` last bytes of a recording's file; errors as of `read_regular`."""
    try:
        with opened(path, links=False) as (file, size):
            first = file.read(count)
            file.seek(max(size - count, 0))
            return first, file.read(count)
    except ConfigError as error:
        raise RecordingError(f"{path} {error}") from error
