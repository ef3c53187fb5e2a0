"""Every script and learned tactic against uniform coverage.

`swarm-pz tournament` plays all against all.

python -m benchmarks.head_to_head --games 100 > docs/tables/head_to_head.csv
"""

from __future__ import annotations

import argparse
import csv
import sys
from typing import Any

from swarm_pz.evaluation.match import paired_difference, play_match
from swarm_pz.policy import kind_of, registered


def against_uniform(games: int) -> list[dict[str, Any]]:
    """Play all policies that send densities, except the planner, against uniform coverage on the same seeds."""
    names = sorted(
        name
        for name, point in registered().items()
        if point.module != "swarm_pz.policies.planner" and kind_of(name) == "density"
    )
    matches = {name: play_match(name, "uniform", games=games, threads=2) for name in names}
    rows = []
    for match in matches.values():
        difference, low, high = paired_difference(match, matches["uniform"])
        rows.append(match.summary() | {"share_above_uniform": [difference, low, high]})
    return sorted(rows, key=lambda row: float(row["mean_share"]), reverse=True)


def print_table(rows: list[dict[str, Any]]) -> None:
    """Print matches as CSV, as docs/tables/head_to_head.csv has them."""
    write = csv.writer(sys.stdout, lineterminator="\n").writerow
    write(["policy", "won", "drawn", "lost", "share of drones", "share above uniform (95 %)", "mean length, s"])
    for row in rows:
        above = "{:+.2f} ({:+.2f} to {:+.2f})".format(*row["share_above_uniform"])
        counts = (row["wins"], row["draws"], row["losses"])
        write([row["policy"], *counts, f"{row['mean_share']:.2f}", above, f"{row['restricted_mean_seconds']:.0f}"])


def main() -> None:
    """Play and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, default=100)
    print_table(against_uniform(parser.parse_args().games))


if __name__ == "__main__":
    main()
