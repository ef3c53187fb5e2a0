"""Every script against every other: who beats whom, and how the game itself behaves.

python -m benchmarks.head_to_head --games 100 --out runs/head_to_head
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from swarm_pz.match import paired_difference, play_match
from swarm_pz.policy import registered
from training.report import plot_sizes

SCRIPTS = sorted(name for name, point in registered().items() if point.module == "policies.scripted")


def against_uniform(games: int) -> list[dict[str, Any]]:
    """Play every script against uniform coverage on the same seeds, with differences of share."""
    matches = {name: play_match(name, "uniform", games=games, threads=2) for name in SCRIPTS}
    rows = []
    for match in matches.values():
        difference, low, high = paired_difference(match, matches["uniform"])
        rows.append(match.summary() | {"share_above_uniform": [difference, low, high]})
    return sorted(rows, key=lambda row: float(row["mean_share"]), reverse=True)


def print_table(rows: list[dict[str, Any]]) -> None:
    """Print a Markdown table of matches."""
    print("| policy | won | drawn | lost | share | share above `uniform` (95 %) | restricted mean |")
    print("|---|---|---|---|---|---|---|")
    for row in rows:
        difference, low, high = row["share_above_uniform"]
        print(
            f"| `{row['policy']}` | {row['wins']} | {row['draws']} | {row['losses']} | {row['mean_share']:.2f} "
            f"| {difference:+.2f} ({low:+.2f} to {high:+.2f}) | {row['restricted_mean_seconds']:.0f} s |"
        )


def matrix(games: int) -> NDArray[np.float64]:
    """Return what fraction of its decided games each script (row) won against each other (column)."""
    won = np.full((len(SCRIPTS), len(SCRIPTS)), np.nan)
    for i, one in enumerate(SCRIPTS):
        for j in range(i + 1, len(SCRIPTS)):
            summary = play_match(one, SCRIPTS[j], games=games, threads=2).summary()
            decided = summary["wins"] + summary["losses"]
            if decided:
                won[i, j] = summary["wins"] / decided
                won[j, i] = summary["losses"] / decided
            print(f"{one} against {SCRIPTS[j]}: {summary['wins']}-{summary['draws']}-{summary['losses']}", flush=True)
    return won


def plot_matrix(won: NDArray[np.float64], path: Path) -> None:
    """Draw the matrix, rows against columns."""
    figure = Figure(figsize=(8, 7), layout="constrained")
    axes = figure.add_subplot()
    image = axes.imshow(won, cmap="RdBu", vmin=0, vmax=1)
    axes.set_xticks(range(len(SCRIPTS)), SCRIPTS, rotation=45, ha="right")
    axes.set_yticks(range(len(SCRIPTS)), SCRIPTS)
    for (i, j), value in np.ndenumerate(won):
        if np.isfinite(value):
            dark = abs(value - 0.5) > 0.3
            axes.text(j, i, f"{100 * value:.0f}", ha="center", va="center", color="white" if dark else "black")
    axes.set_title("percent of decided games that the row won against the column")
    figure.colorbar(image)
    figure.savefig(path, dpi=120)


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
    won = matrix(options.games)
    plot_matrix(won, options.out / "matrix.png")
    figures = {"against_uniform": rows, "scripts": list(SCRIPTS), "won_of_decided": np.nan_to_num(won, nan=-1).tolist()}
    (options.out / "figures.json").write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
