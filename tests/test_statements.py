"""The table of the paper's statements: what a row names is there, and its numbers are the software's."""

from __future__ import annotations

import csv
import inspect
import re
from pathlib import Path

import msgspec.inspect as inspect_types
import pytest

from swarm_pz.cli import play
from swarm_pz.config import CONTROL_PERIOD, GameConfig
from swarm_pz.play.game import TableConfig
from swarm_pz.play.protocol import Settings
from swarm_pz.play.ros.commands import INPUTS
from swarm_pz.play.strokes import MAPPINGS
from swarm_pz.policies.open_loop import BESTS
from swarm_pz.spaces.densities import COMMAND_NAMES

ROOT = Path(__file__).parents[1]
PAGE, ROUNDS = ((ROOT / "swarm_pz/play/static" / name).read_text() for name in ("index.html", "progress.js"))
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


COUNTS = {
    r"(\d+) densities have names": len(COMMAND_NAMES),
    r"Up to (\d+) drones a side": inspect_types.type_info(Settings).fields[0].type.le,
    r"([0-9.]+) each, or as the room": GameConfig().team_sizes[0],
    r"after ([0-9.]+) s it is a draw": GameConfig().time_limit,
    r"within ([0-9.]+) of a corner": GameConfig().spawn.radius,
    r"Of the last ([0-9.]+) s, the time": GameConfig().memory.trail,
    r"At most ([0-9.]+) map width per second": GameConfig().controller.max_acceleration,
    r"τ = ([0-9.]+) s": GameConfig().memory.controller,
    r"R = ([0-9.]+) on": GameConfig().controller.control_weight,
    r"([0-9.]+) times the squared distance": GameConfig().controller.wall_weight,
    r"distance beyond \[([0-9.]+),": GameConfig().controller.wall_margin,
    r"lowest ([0-9]+) \S 10 modes": GameConfig().controller.modes,
    r"deviation is ([0-9.]+) map widths": MAPPINGS["firm"].smoothing,
    r"and ([0-9.]+) with the mapping paper": MAPPINGS["paper"].smoothing,
    r"Every ([0-9.]+) s\. Of commands": TableConfig().min_command_interval,
    r"Weights are ([0-9.]+) to": GameConfig().flocking.migration[0],
    r"so does ([0-9.]+) s of coasting": GameConfig().controller.horizon * CONTROL_PERIOD,
    r"page end after ([0-9.]+) s, by majority": sum(map(int, re.findall(r"limit: (\d+), majority", ROUNDS))),
    r"sequence of ([0-9]+) images": len(BESTS["uniform"]["sequence"]["images"]),
}
"""Numbers that rows say of the software, and what they are."""


@pytest.mark.parametrize("words", COUNTS)
def test_a_number_of_the_software_is_what_its_row_says(words):
    found = [match[1] for row in ROWS if (match := re.search(words, row["here"]))]
    assert found and {float(number) for number in found} == {float(COUNTS[words])}


def test_options_topics_and_buttons_that_rows_name_are_there():
    told = " ".join(row["here"] for row in ROWS)
    options = {name.replace("-", "_") for name in re.findall(r"--([a-z-]+)", told)}
    assert "rosbridge" in options <= set(inspect.signature(play.play).parameters)
    topics = set(re.findall(r"(?<= )(/[a-z_/]+)", told))
    assert topics and topics <= set(INPUTS)
    for words in ("Go here", "Keep away", "Clear", "Undo", *re.findall(r'switch "([^"]+)"', told)):
        assert words in told and words in PAGE, words
