"""Tables as files: CSV and Parquet, and the codebook that goes with them."""

from __future__ import annotations

import csv
import re
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import astuple
from pathlib import Path
from typing import Any

from swarm_pz.errors import require_extra
from swarm_pz.play.recordings.study import plain
from swarm_pz.play.studies.rows import Row, codebook, columns, type_of

NOTES = {
    "empty": "An empty cell of a CSV file, or null in Parquet: it is not known, or there is none.",
    "text": "In CSV, text that begins with = + - @ TAB or CR has an apostrophe before it, so that no spreadsheet "
    "takes it for a formula; numbers have at most 6 decimals.",
    "time": "A tick is 1/30 s of game. ms is the server's clock since the game began; that of game and of the clock "
    "differ where a game runs faster or slower (speed).",
}
"""What holds for all tables."""


def write_csv(rows: Sequence[Row], kind: type[Row], path: Path) -> None:
    """Write a table as CSV, in UTF-8."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([column.name for column in columns(kind)])
        writer.writerows([[_cell(value) for value in astuple(row)] for row in rows])


def _cell(value: Any) -> Any:
    return str(value).lower() if isinstance(value, bool) else plain(value)


def write_parquet(rows: Sequence[Row], kind: type[Row], path: Path) -> None:
    """Write a table as Parquet: columns of the same types even where they are empty.

    Raises
    ------
    MissingExtraError
        If pyarrow is not installed.
    """
    arrow = require_extra("pyarrow", "lab")
    types = {"str": arrow.string(), "int": arrow.int64(), "float": arrow.float64(), "bool": arrow.bool_()}
    schema = arrow.schema([(column.name, types[type_of(column)]) for column in columns(kind)])
    values = {column.name: [getattr(row, column.name) for row in rows] for column in columns(kind)}
    require_extra("pyarrow.parquet", "lab").write_table(arrow.table(values, schema=schema), path)


def markdown(text: str) -> str:
    """Return a line of somebody's text as Markdown shows it: no sign of it makes a link, a table's edge or HTML."""
    return re.sub(r"([\\`*_{}\[\]<>#|!~&])", r"\\\1", " ".join(text.split()))


def codebook_text(title: str) -> str:
    """Return the codebook in Markdown."""
    parts = [f"# Codebook: {markdown(title)}\n", *(f"- {note}" for note in NOTES.values())]
    for name, table in codebook().items():
        parts += [f"\n## {name}\n", f"A row is: {table['row'][0].lower()}{table['row'][1:]}.\n"]
        parts += ["| column | type | unit | what it is |", "|---|---|---|---|"]
        for column, told in table["columns"].items():
            kind = told["type"] + (", or empty" if told["may_be_empty"] else "")
            parts.append(f"| `{column}` | {kind} | {told['unit']} | {told['about']} |")
    return "\n".join(parts) + "\n"


def labels(names: Iterable[str], otherwise: str) -> dict[str, str]:
    """Return labels of ASCII letters and digits, as names of data files have them, a different one for each name.

    They differ by more than upper and lower case, since files of some systems must.
    """
    found: dict[str, str] = {}
    for name in dict.fromkeys(names):
        words = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
        stem = "".join(filter(str.isalnum, words)) or otherwise
        label, count, taken = stem, 1, {one.lower() for one in found.values()}
        while label.lower() in taken:
            count += 1
            label = f"{stem}x{count}"
        found[name] = label
    return found
