"""The table of the paper's statements: what a row names is there."""

from __future__ import annotations

import csv
import inspect
import re
from pathlib import Path

from swarm_pz.cli import play
from swarm_pz.play.ros.commands import INPUTS

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "swarm_pz/play/static/index.html").read_text()
with (ROOT / "docs/tables/statements.csv").open(newline="", encoding="utf-8") as file:
    ROWS = list(csv.DictReader(file))


def names(cell):
    return [name for name in cell.split("; ") if name]


def test_files_and_figures_that_rows_name_are_there():
    for row in ROWS:
        for name in names(row["code"]) + names(row["shown by"]):
            path, _, heading = name.partition("#")
            assert (ROOT / path).is_file(), f"{row['the paper']}: {path}"
            assert f"\n## {heading}" in (ROOT / path).read_text() or not heading, f"{row['the paper']}: {name}"


def test_options_topics_and_buttons_that_rows_name_are_there():
    told = " ".join(row["here"] for row in ROWS)
    options = {name.replace("-", "_") for name in re.findall(r"--([a-z-]+)", told)}
    assert "rosbridge" in options <= set(inspect.signature(play.play).parameters)
    topics = set(re.findall(r"(?<= )(/[a-z_/]+)", told))
    assert topics and topics <= set(INPUTS)
    for words in ("Go here", "Keep away", "Clear", "Undo", *re.findall(r'switch "([^"]+)"', told)):
        assert words in told and words in PAGE, words
