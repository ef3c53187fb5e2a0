"""Tables of a study as files, their codebook, and what all texts of an export have in common."""

from __future__ import annotations

import functools
import json
import math
import re
import unicodedata
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from swarm_pz.errors import require_extra
from swarm_pz.play.recordings.tables import plain, write_table
from swarm_pz.play.studies.rows import Row, codebook

NOTES = {
    "empty": "An empty cell of a CSV file, or null in Parquet: it is not known, or there is none.",
    "text": "In CSV, text that begins with = + - @ TAB or CR has an apostrophe before it, so that no spreadsheet "
    "takes it for a formula; numbers have at most 6 decimals.",
    "time": "A tick is 1/30 s of game. ms is the server's clock since the game began; that of game and of the clock "
    "differ where a game runs faster or slower (speed).",
}
"""What holds for all tables."""


def write_rows(rows: Sequence[Row], kind: type[Row], path: Path) -> None:
    """Write a table as CSV or Parquet, by the path's suffix."""
    write_table(rows, kind, path, lambda value: str(value).lower() if isinstance(value, bool) else plain(value))


def write_json(content: Any, path: Path) -> None:
    """Write plain values as a file that people read, too."""
    path.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def markdown(text: str) -> str:
    """Return a line of somebody's text as Markdown shows it: no sign of it makes a link, a table's edge or HTML."""
    return re.sub(r"([\\`*_{}\[\]<>#|!~&])", r"\\\1", " ".join(text.split()))


def signed(value: float, scale: float) -> str:
    """Return a difference, or an end of its interval, as the report shows it."""
    return f"{scale * value:+.1f}" if math.isfinite(value) else "any"


@functools.cache
def _templates() -> Any:
    jinja2 = require_extra("jinja2", "lab")
    # Of Markdown: not HTML, but the filter `markdown` escapes what somebody wrote.
    found = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    found.filters |= {"markdown": markdown, "signed": signed}
    return found


def render(template: str, **values: Any) -> str:
    """Return a text that one of this folder's templates makes of values."""
    return str(_templates().get_template(f"{template}.jinja").render(**values))


def codebook_text(title: str) -> str:
    """Return the codebook in Markdown."""
    return render("codebook.md", title=title, notes=NOTES.values(), tables=codebook())


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
