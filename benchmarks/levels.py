"""How soon a person's level is known: the width of its interval game by game, and how often it holds.

python -m benchmarks.levels --people 2000 --picture docs/images/levels.png

People are simulated: as good as the prior has them, their games drawn from the model, without draws or with. Chosen
opponents are compared with opponents at random, and with the same one all the time.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from swarm_pz.play.levels import PRIOR_MEAN, PRIOR_SD, RUNGS, Met, Rung, chance, level_of, next_rung

GAMES = (1, 2, 3, 5, 8, 12, 16, 20, 25, 30)
UNIFORM = next(rung for rung in RUNGS if rung.name == "uniform")


def play(
    level: float, choose: Callable[[Sequence[Met]], Rung], draws: float, generator: np.random.Generator
) -> list[Met]:
    """Return somebody's games; `draws` is the share of games that nobody wins, at even odds."""
    games: list[Met] = []
    while len(games) < GAMES[-1]:
        rung = choose(games)
        won = chance(level, rung.rating)
        drawn = 2.0 * draws * min(won, 1.0 - won)
        points = generator.choice([0.0, 0.5, 1.0], p=[1.0 - won - drawn / 2, drawn, won - drawn / 2])
        games.append(Met(rung.name, rung.rating, float(points)))
    return games


def main() -> None:
    """Print a row for each number of games and each way to choose, and perhaps draw them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--people", type=int, default=2000)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    generator = np.random.default_rng(0)
    ways: dict[str, tuple[Callable[[Sequence[Met]], Rung], float]] = {
        "chosen": (next_rung, 0.0),
        "chosen, 30 % draws": (next_rung, 0.3),
        "at random": (lambda _: RUNGS[generator.integers(len(RUNGS))], 0.0),
        "always uniform": (lambda _: UNIFORM, 0.0),
    }
    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.subplots()
    print(f"{options.people} people: mean width of the 95 % interval, share of people in it, mean error")
    for name, (choose, draws) in ways.items():
        levels = generator.normal(PRIOR_MEAN, PRIOR_SD, options.people)
        played = [play(level, choose, draws, generator) for level in levels]
        widths = []
        for count in GAMES:
            found = [level_of(games[:count]) for games in played]
            widths.append(float(np.mean([one.high - one.low for one in found])))
            held = np.mean([one.low <= level <= one.high for one, level in zip(found, levels, strict=True)])
            error = np.mean([abs(one.value - level) for one, level in zip(found, levels, strict=True)])
            print(f"{name:>20} {count:3d} games: {widths[-1]:5.0f} points, {held:.3f}, {error:4.0f} points", flush=True)
        if not draws:  # with draws it is as wide
            axes.plot(GAMES, widths, marker="o", markersize=3, label=name)
    if options.picture is not None:
        axes.set(xlabel="games", ylabel="width of the 95 % interval, rating points", ylim=(0, None))
        axes.legend(frameon=False)
        figure.savefig(options.picture, dpi=120)


if __name__ == "__main__":
    main()
