"""Tables of the documentation, as CSV files."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from swarm_pz.files import draft_of


def write_csv(path: Path, rows: Iterable[Sequence[Any]]) -> None:
    """Write the rows of a table, including its header."""
    with draft_of(path) as draft, draft.open("w", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)
