"""Summaries of recorded games from their first and last lines alone, so that a folder is listed without reading it."""

from __future__ import annotations

import contextlib
from pathlib import Path

from msgspec import Struct

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.errors import ProtocolError, RecordingError
from swarm_pz.play.protocol import EndedBy, EndMessage, Header, Outcome, RecordedSeat, decode_log
from swarm_pz.play.recordings.folder import read_ends

END_BYTES = 8 * 2**10
"""Bytes of a file's beginning and of its end that are read: its first and its last line have less."""


class Summary(Struct):
    """A recorded game; a file that is no game, or unfinished, leaves fields empty.

    `seconds` are of game, `sizes` the drones of red and blue at its end.
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
    """Return the summary of a file, with as much as can be read."""
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
