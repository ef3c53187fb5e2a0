"""Atomic writing of files, and the errors of reading and writing them."""

from __future__ import annotations

import errno
import json
import os
import shutil
import stat
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from swarm_pz.errors import ConfigError, OutputError

MOST_TEXT_BYTES = 2**20
"""Largest text file."""

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Error numbers of the system for a full disk, quota or file."""


@contextmanager
def opened(path: Path, *, links: bool = True) -> Iterator[tuple[BinaryIO, int]]:
    """Open a file, perhaps an untrusted one, for reading; yield it and its size. Without `links`, refuse links.

    Raises a ConfigError if it cannot be read or is no regular file (opening a pipe blocks). The message is to follow
    the file's name.
    """
    other = f"cannot be read: expected a regular file, got {'' if links else 'a link, '}a folder, a pipe or a device"
    flags = os.O_RDONLY
    for name in ("O_NONBLOCK", "O_CLOEXEC", "O_BINARY", *([] if links else ["O_NOFOLLOW"])):
        flags |= getattr(os, name, 0)  # not every system has them all
    try:
        if not stat.S_ISREG((path.stat() if links else path.lstat()).st_mode):
            raise ConfigError(other)
        with os.fdopen(os.open(path, flags), "rb") as file:
            status = os.fstat(file.fileno())
            if not stat.S_ISREG(status.st_mode):  # replaced since the first test
                raise ConfigError(other)
            yield file, status.st_size
    except OSError as error:
        raise ConfigError(f"cannot be read: {explain(OSError(error.errno, error.strerror))}") from error


def read_bytes(path: Path, most: int, *, links: bool = True) -> bytes:
    """Read a file, perhaps an untrusted one; raise a ConfigError as `opened`, or if it exceeds `most` bytes."""
    with opened(path, links=links) as (file, size):
        data = file.read(most + 1) if size <= most else b""  # it may be growing
        if (size := max(size, len(data))) > most:
            raise ConfigError(f"is too large: expected {most:,} bytes or fewer, got {size:,}")
        return data


def read_text(path: Path) -> str:
    """Read a text file in UTF-8; raise a ConfigError as `read_bytes`."""
    try:
        return read_bytes(path, MOST_TEXT_BYTES).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise ConfigError(f"cannot be read: {error}") from error


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file; raise a ConfigError, to follow the file's name, if it cannot be read or is no TOML."""
    text = read_text(path).replace("\r\n", "\n")
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        raise ConfigError("is no TOML: what it holds is too deep") from error
    except ValueError as error:  # also for a number with too many digits
        raise ConfigError(f"is no TOML: {error}") from error


def check_file(path: Path) -> None:
    """Make the folder of a file, before any work; raise an OutputError if the file cannot be written."""
    check_folder(path.parent)
    if path.is_dir():
        raise OutputError(f"expected the name of a file to write, got the folder {str(path)!r}")
    if path.exists() and not os.access(path, os.W_OK):
        raise OutputError(f"cannot write {str(path)!r}: the file is read-only")


def check_folder(path: Path) -> None:
    """Make a folder; raise an OutputError if it cannot be made or written to."""
    try:
        place = next(place for place in (path, *path.absolute().parents) if place.exists())
        if not place.is_dir():
            raise OutputError(
                f"cannot write into {str(path)!r}: {str(place)!r} is a file, not a folder; choose another folder"
            )
        if not os.access(place, os.W_OK):
            raise OutputError(
                f"cannot write into {str(path)!r}: no permission to write in {str(place)!r}; choose another folder"
            )
        path.mkdir(parents=True, exist_ok=True)
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"cannot make the folder {str(path)!r}: {explain(error)}") from error


@contextmanager
def draft_of(path: Path) -> Iterator[Path]:
    """Yield a draft beside a file; it replaces the file at the end of the block, or is deleted if the block fails."""
    check_file(path)
    draft = path.with_name(f".{path.stem}.draft{path.suffix}")
    try:
        draft.unlink(missing_ok=True)  # it may be a link to another file
    except OSError as error:
        raise OutputError(f"cannot write {str(path)!r}: {explain(error)}") from error
    try:
        with named_if_full(path, draft):
            yield draft
            draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def write_json(path: Path, plain: object) -> None:
    """Write plain values as JSON, by way of a draft."""
    with draft_of(path) as draft:
        draft.write_text(json.dumps(plain, indent=2) + "\n")


@contextmanager
def named_if_full(path: Path, written: Path) -> Iterator[None]:
    """Raise an OutputError that names the file if the disk is full; `written` is the file or its draft."""
    try:
        yield
    except OSError as error:
        if error.errno not in FULL:
            raise
        size = written.stat().st_size if written.exists() else 0
        free = shutil.disk_usage(path.parent).free
        raise OutputError(
            f"cannot write {str(path)!r}: the disk is full, with {size:,} bytes of the file written and {free:,} bytes "
            "free; what was finished before is kept: make room, and run the command again"
        ) from error


def explain(error: OSError) -> str:
    """Return the message of an OSError, without its number."""
    reason = (error.strerror or str(error) or type(error).__name__).lower()
    return f"{reason}: {str(error.filename)!r}" if error.filename is not None else reason
