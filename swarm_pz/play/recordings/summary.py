"""What recorded games were, by their first and last lines alone: a folder of them is listed without reading them."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path

import msgspec
from msgspec import Struct

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.errors import RecordingError
from swarm_pz.play.protocol import EndedBy, EndMessage, Header, Outcome, RecordedSeat, decode_log
from swarm_pz.play.recordings.folder import read_ends

END_BYTES = 8 * 2**10
"""Of a file's beginning and of its end that are read: its first and its last line have less."""


class Summary(Struct):
    """What a recorded game was; a file that is no game, or unfinished, does not tell all of it."""

    name: str
    started: str | None = None
    """In UTC, ISO 8601."""
    red: RecordedSeat | None = None
    blue: RecordedSeat | None = None
    lesson: bool = False
    outcome: Outcome | None = None
    ended_by: EndedBy | None = None
    seconds: float | None = None
    """Of game."""
    sizes: tuple[int, int] | None = None
    """Drones of red and blue at its end."""


def summary_of(path: Path) -> Summary:
    """Return what a file tells of its game: as much as can be read."""
    summary = Summary(path.name)
    with contextlib.suppress(RecordingError, msgspec.DecodeError, UnicodeDecodeError, RecursionError):
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


class Summaries:
    """What files tell of their games, each read once for as long as it stays as it is; for one thread."""

    def __init__(self) -> None:
        self._known: dict[tuple[Path, int, int], Summary] = {}

    def of(self, paths: Sequence[Path]) -> list[Summary]:
        """Return what files tell, in order, without those that are gone; only these are kept in mind."""
        known: dict[tuple[Path, int, int], Summary] = {}
        for path in paths:
            with contextlib.suppress(OSError):
                status = path.lstat()
                stamp = path, status.st_mtime_ns, status.st_size
                known[stamp] = self._known.get(stamp) or summary_of(path)
        self._known = known
        return list(known.values())
