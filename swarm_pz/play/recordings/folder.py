"""A folder of recorded games: only regular files of the folder itself, and none that is too large.

A link may lead to what is nobody's business, and who opens a pipe waits for its writer.
"""

from __future__ import annotations

import contextlib
import os
import re
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from swarm_pz.errors import RecordingError
from swarm_pz.files import explain

SUFFIX = ".jsonl"
MOST_BYTES = 256 * 2**20
"""Of a recording that is read."""
# Not every system has them all.
_FLAGS = os.O_RDONLY
for _flag in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_BINARY"):
    _FLAGS |= getattr(os, _flag, 0)
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}\.jsonl")


def checked_name(name: str) -> str:
    """Return the name of a recording, if it is one and no path.

    Raises
    ------
    RecordingError
        If it is not a plain file name that ends in ``.jsonl``.
    """
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
    """Return what stands in a recording's file.

    Raises
    ------
    RecordingError
        If it cannot be read, is no regular file (a link, a folder, a pipe, a device) or is larger than `MOST_BYTES`.
    """
    with _opened(path) as (file, size):
        if size > MOST_BYTES:
            raise RecordingError(f"{path} is not read: a recording may have {MOST_BYTES} bytes, it has {size}")
        return file.read(MOST_BYTES + 1)  # it may be growing


def read_ends(path: Path, count: int) -> tuple[bytes, bytes]:
    """Return the first and the last bytes of a recording's file, so many of each at most.

    Raises
    ------
    RecordingError
        If it cannot be read, or is no regular file.
    """
    with _opened(path) as (file, size):
        first = file.read(count)
        file.seek(max(size - count, 0))
        return first, file.read(count)


@contextlib.contextmanager
def _opened(path: Path) -> Iterator[tuple[BinaryIO, int]]:
    """Give a regular file that was opened, and its size."""
    other = f"{path} is not read: expected a regular file, got a link, a folder, a pipe or a device"
    try:
        if not stat.S_ISREG(path.lstat().st_mode):
            raise RecordingError(other)
        file = os.open(path, _FLAGS)  # a pipe that has come since opens at once, and is refused
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {explain(OSError(error.errno, error.strerror))}") from error
    with os.fdopen(file, "rb") as opened:
        status = os.fstat(file)
        if not stat.S_ISREG(status.st_mode):
            raise RecordingError(other)
        try:
            yield opened, status.st_size
        except OSError as error:
            raise RecordingError(f"{path} cannot be read: {explain(error)}") from error
