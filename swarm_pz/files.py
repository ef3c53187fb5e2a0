"""Files that are whole or not there, and words for what keeps one from being written."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from swarm_pz.errors import OutputError


def check_file(path: Path) -> None:
    """Make the folder of a file that is to be written, before the work that it is for.

    Raises
    ------
    OutputError
        If the file could not be written: it is a folder, or its folder cannot be made or written to.
    """
    check_folder(path.parent)
    if path.is_dir():
        raise OutputError(f"expected the name of a file to write, got the folder {str(path)!r}")
    if path.exists() and not os.access(path, os.W_OK):
        raise OutputError(f"cannot write {str(path)!r}: the file is read-only")


def check_folder(path: Path) -> None:
    """Make a folder that is to be written to.

    Raises
    ------
    OutputError
        If that cannot be: it, or what it would lie in, is a file, or may not be written to.
    """
    try:
        place = next(place for place in (path, *path.absolute().parents) if place.exists())
        if not place.is_dir():
            raise OutputError(f"cannot write into {str(path)!r}: {str(place)!r} is a file, not a folder")
        if not os.access(place, os.W_OK):
            raise OutputError(f"cannot write into {str(path)!r}: no permission to write in {str(place)!r}")
        path.mkdir(parents=True, exist_ok=True)
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"cannot make the folder {str(path)!r}: {explain(error)}") from error


@contextmanager
def draft_of(path: Path) -> Iterator[Path]:
    """Give a draft beside a file, which takes the file's name when the block ends and is gone if it fails.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    check_file(path)
    draft = path.with_name(f".{path.stem}.draft{path.suffix}")
    try:
        yield draft
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def explain(error: OSError) -> str:
    """Return what an error of the system says, in words without its number."""
    reason = (error.strerror or str(error) or type(error).__name__).lower()
    return f"{reason}: {str(error.filename)!r}" if error.filename is not None else reason
