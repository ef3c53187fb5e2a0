"""Opponents unlock in the order of the ladder's ratings: scripts, then learned players."""

import csv
from pathlib import Path

from benchmarks.page_levels import IDEAS, LEVELS
from swarm_pz.play.opponents import LEARNED, SCRIPTED, opponents_among

LADDER = Path(__file__).parents[2] / "docs" / "tables" / "ladder.csv"


def test_opponents_come_from_the_weakest_to_the_strongest_of_those_installed():
    with LADDER.open() as file:
        rated = {row["player"]: float(row["rating"]) for row in csv.DictReader(file)}
    for names in (SCRIPTED, LEARNED):
        order = [rated[name] for name in names]
        assert order == sorted(order)
    assert opponents_among(rated) == [*SCRIPTED, *LEARNED]
    assert opponents_among({"halo", "mine", "lasso"}) == ["halo", "lasso"]


def test_the_page_has_a_face_and_an_idea_for_each_and_no_other():
    assert list(LEVELS) == [*SCRIPTED, *LEARNED]
    assert set(LEVELS.values()) == set(IDEAS)
