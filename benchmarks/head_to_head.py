"""Every script and learned tactic against uniform coverage, and how the game itself behaves.

`swarm-pz tournament` plays everybody against everybody.

python -m benchmarks.head_to_head --games 100 --out runs/head_to_head
"""

from __future__ import annotations

import argparse
import csv
import json
import sys
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from swarm_pz.evaluation.match import MatchResult, paired_difference, play_match
from swarm_pz.policy import kind_of, registered


def against_uniform(games: int) -> list[dict[str, Any]]:
    """Play all who answer densities, but the planner, against uniform coverage on the same seeds."""
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


def self_play(games: int, path: Path) -> None:
    """Play uniform coverage against itself and say how the game fluctuates."""
    match = play_match("uniform", "uniform", games=2 * games, threads=2)
    played = match.unique
    seconds = sum(game.seconds for game in played)
    captures, recaptures = sum(game.captures for game in played), sum(game.recaptures for game in played)
    changes = sum(
        abs(after - before) for game in played for before, after in zip(game.sizes, game.sizes[1:], strict=False)
    )
    ended = sum(game.outcome != "draw" for game in played)
    print(
        f"uniform against uniform, {len(played)} games: {captures / seconds:.2f} captures a second, of which "
        f"{recaptures / seconds:.2f} taken back within a second; net changes of size from second to second "
        f"{changes / seconds:.2f} a second; {ended} ended within the limit, mean length {seconds / len(played):.0f} s"
    )
    plot_sizes(match, path)


def plot_sizes(match: MatchResult, path: Path) -> None:
    """Draw team sizes over time of every game of a match, red's share of all drones."""
    figure = Figure(figsize=(8, 4.5), layout="constrained")
    axes = figure.add_subplot()
    for game in match.unique:
        axes.plot([size / match.config.num_drones for size in game.sizes], linewidth=0.8, alpha=0.7)
    axes.axhline(0.5, color="grey", linewidth=0.8)
    axes.set(xlabel="time in s", ylabel="red's share of all drones", ylim=(-0.02, 1.02))
    axes.set_title(f"{match.policy} against {match.opponent}, {len(match.unique)} games", fontsize=10)
    figure.savefig(path, dpi=120)


def main() -> None:
    """Play, print and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, default=100)
    parser.add_argument("--out", type=Path, default=Path("runs/head_to_head"))
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    self_play(20, options.out / "sizes.png")
    rows = against_uniform(options.games)
    print_table(rows)
    (options.out / "figures.json").write_text(json.dumps({"against_uniform": rows}, indent=2) + "\n")


if __name__ == "__main__":
    main()
