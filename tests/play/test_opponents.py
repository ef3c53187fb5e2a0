"""Opponents unlock in the order of the ladder's ratings."""

import csv
from pathlib import Path

from swarm_pz.play.opponents import opponents_among

LADDER = Path(__file__).parents[2] / "docs" / "tables" / "ladder.csv"


def test_opponents_come_from_the_weakest_to_the_strongest_of_those_installed():
    with LADDER.open() as file:
        rated = {row["player"]: float(row["rating"]) for row in csv.DictReader(file)}
    order = [rated[name] for name in opponents_among(rated)]
    assert order == sorted(order) and len(order) == 12
    assert opponents_among({"halo", "mine", "ring"}) == ["ring", "halo"]
