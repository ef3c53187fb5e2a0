"""The table of the paper's statements: what its rows name is there."""

import csv
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_files_and_figures_that_rows_name_are_there():
    with (ROOT / "docs/tables/statements.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        for name in filter(None, f"{row['code']}; {row['shown by']}".split("; ")):
            path, _, heading = name.partition("#")
            assert (ROOT / path).is_file(), f"{row['the paper']}: {path}"
            assert f"\n## {heading}" in (ROOT / path).read_text() or not heading, f"{row['the paper']}: {name}"
