"""Tables of recorded games: rows as CSV files, with a description of every column."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import astuple, fields
from pathlib import Path
from typing import Any

from swarm_pz.errors import RecordingError
from swarm_pz.evaluation.provenance import versions
from swarm_pz.play.recordings.folder import SUFFIX
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.recordings.seats import SeatRow, seat_rows

NOTES = {
    "empty": "An empty cell is unknown, or does not apply.",
    "text": "Text that begins with = + - @ TAB or CR has an apostrophe before it, so that no spreadsheet takes it for "
    "a formula; numbers have at most 6 decimals.",
}
_FORMULA = ("=", "+", "-", "@", "\t", "\r")


def read_folder(folder: Path) -> tuple[list[SeatRow], list[str]]:
    """Return the seats of all games of a folder, oldest first, and the errors of files that could not be read.

    Raises RecordingError if there is no recorded game in it.
    """
    paths = sorted(folder.glob(f"*{SUFFIX}"))
    if not paths:
        raise RecordingError(f"there are no recorded games (*{SUFFIX}) in {folder}")
    rows, faults = [], []
    for path in paths:
        try:
            rows += seat_rows(Recording.read(path))
        except RecordingError as error:
            faults.append(str(error))
    return rows, faults


def write_tables(rows: Sequence[SeatRow], folder: Path, command: str = "") -> list[Path]:
    """Write ``seats.csv``, and ``schema.json`` with the command, the versions and the columns; return both paths."""
    folder.mkdir(parents=True, exist_ok=True)
    table, schema = folder / "seats.csv", folder / "schema.json"
    write_table(rows, SeatRow, table)
    described = {"versions": versions(), "command": command, "notes": NOTES, "columns": columns_of(SeatRow)}
    schema.write_text(json.dumps(described, indent=2) + "\n")
    return [table, schema]


def columns_of(kind: type[Any]) -> dict[str, dict[str, str]]:
    """Return the meaning (`about`) and unit of each column of a table; columns without them have those of `SeatRow`."""
    known = {entry.name: entry.metadata for entry in fields(SeatRow)}
    return {entry.name: dict(entry.metadata or known[entry.name]) for entry in fields(kind)}


def write_table(
    rows: Sequence[Any], kind: type[Any], path: Path, more: Mapping[str, Callable[[Any], Any]] | None = None
) -> None:
    """Write rows of a dataclass as CSV in UTF-8; `more` makes further columns from a row."""
    more = more or {}
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*(entry.name for entry in fields(kind)), *more])
        writer.writerows([_plain(one) for one in (*astuple(row), *(of(row) for of in more.values()))] for row in rows)


def _plain(value: Any) -> Any:
    """Return a value for CSV; text that a spreadsheet would take for a formula gets an apostrophe."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return round(value, 6)
    return f"'{value}" if isinstance(value, str) and value.startswith(_FORMULA) else value
