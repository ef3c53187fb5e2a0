"""The table of the paper's statements: every row says where it stands, and what it names is there."""

from __future__ import annotations

import csv
from pathlib import Path

ROOT = Path(__file__).parents[1]
VERDICTS = {"as said", "differs", "ours", "not shown", "about people or other work"}
SECTIONS = {"abstract", "I", "II", "II-A", "II-B", "II-C", "III-A", "III-B", "III-C", "IV-A", "IV-B", "IV-C", "V"}
FIGURES = {f"Fig. {number}" for number in range(1, 9)}
with (ROOT / "docs/tables/statements.csv").open(newline="", encoding="utf-8") as file:
    ROWS = list(csv.DictReader(file))


def names(cell):
    return [name for name in cell.split("; ") if name]


def test_every_row_has_its_section_and_one_of_the_verdicts_and_no_section_is_left_out():
    named = [set(row["section"].split(", ")) for row in ROWS]
    assert all(one and one <= SECTIONS | FIGURES for one in named)
    assert set().union(*named) == SECTIONS | FIGURES
    assert {row["verdict"] for row in ROWS} == VERDICTS
    assert sum(row["verdict"] != "ours" for row in ROWS) >= 65


def test_what_is_as_said_is_shown_by_a_test_or_a_figure_and_what_differs_says_why():
    for row in ROWS:
        if row["verdict"] == "as said":
            assert names(row["shown by"]), row["the paper"]
            assert all(name.startswith(("tests/", "docs/")) for name in names(row["shown by"])), row["the paper"]
        elif row["verdict"] == "differs":
            assert row["here"], row["the paper"]


def test_files_and_figures_that_rows_name_are_there():
    for row in ROWS:
        for name in names(row["code"]) + names(row["shown by"]):
            path, _, heading = name.partition("#")
            assert (ROOT / path).is_file(), f"{row['the paper']}: {path}"
            assert f"\n## {heading}" in (ROOT / path).read_text() or not heading, f"{row['the paper']}: {name}"
