"""Write the cards of the policies on the ladder: ratings from docs/tables/ladder.csv, and a picture of one game each.

python -m benchmarks.policy_cards
"""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np

from swarm_pz import policies
from swarm_pz.config import BLUE, TEAM_NAMES
from swarm_pz.evaluation.rollout import Rollout, game_number
from swarm_pz.simulator.ergodicity import reconstruct

FILE = Path(policies.__file__).with_name("cards.json")
LADDER = Path(__file__).parents[1] / "docs" / "tables" / "ladder.csv"
CELLS = 10
SECONDS = 6.0
"""Seconds of a game after which its picture is taken: swarms have left their corners, and none has won."""


def ratings(table: str) -> dict[str, float]:
    """Return the ladder's ratings by name, without policies that take an argument: these have no cards."""
    rows = csv.DictReader(table.splitlines())
    return {row["player"]: float(row["rating"]) for row in rows if ":" not in row["player"]}


def picture(name: str) -> dict[str, object]:
    """Return a policy's target and drones in a game that it plays as blue against `uniform`."""
    rollout = Rollout(name, "uniform", [game_number(0, TEAM_NAMES[BLUE])])
    rollout.play(SECONDS)
    simulator = rollout.simulator
    target = np.maximum(reconstruct(simulator.games.coefficients[0, BLUE], CELLS), 0.0)
    digits = np.rint(9 * target / target.max()).astype(int)
    places = simulator.positions[0][simulator.teams[0] == BLUE]
    rollout.close()
    return {"target": ["".join(map(str, row)) for row in digits], "drones": np.rint(100 * places).astype(int).tolist()}


def main() -> None:
    """Write the file."""
    lines = [
        f"  {json.dumps(name)}: {json.dumps({'rating': rating} | picture(name))}"
        for name, rating in sorted(ratings(LADDER.read_text()).items())
    ]
    FILE.write_text("{\n" + ",\n".join(lines) + "\n}\n")
    print(FILE)


if __name__ == "__main__":
    main()
