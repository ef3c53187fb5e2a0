"""Every opponent of the page against one ring, drawn once, and against the idea that the page teaches.

Ideas are drawn as a person draws: what they answer is a second old, and the hand is off by a fortieth of the board.

python -m benchmarks.page_levels > docs/tables/page_levels.csv
"""

from __future__ import annotations

import argparse
import csv
import math
import re
import sys
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.evaluation.rollout import Rollout, game_number
from swarm_pz.play.opponents import LEARNED, SCRIPTED
from swarm_pz.play.site import STATIC
from swarm_pz.play.strokes import Stroke, density_of
from swarm_pz.simulator.spawn import Seed

Point = tuple[float, float]
Points = list[Point]
Idea = Callable[[int, Point, Point], Points | None]
"""From the second, the opponents' mean place and where that was at first, to a line that is drawn."""
MIDDLE = (0.5, 0.5)
SIGMA = 0.025
"""Of the hand, in map widths."""
WIDE = {"lap": 0.3}
"""Brushes that are wider than 0.1."""


def arc(radius: float, begin: float = 0.0, end: float = 2.0 * math.pi, centre: Point = MIDDLE) -> Points:
    """Return points of an arc."""
    angles = np.linspace(begin, end, 40)
    return [(centre[0] + radius * math.cos(angle), centre[1] + radius * math.sin(angle)) for angle in angles]


def lap(second: int, _: Point, first: Point) -> Points:
    """Run around the middle in six seconds, from across where the opponents were."""
    angle = math.atan2(0.5 - first[1], 0.5 - first[0]) + 2.0 * math.pi * second / 6
    return arc(0.24, angle - 0.4, angle + 0.4)


IDEAS: dict[str, Idea] = {
    "surround": lambda second, _, __: None if second else arc(0.33),
    "breathe": lambda second, _, __: None if second % 4 else arc(0.15 if second % 8 else 0.3),
    "sides": lambda second, _, __: None if second % 4 else [(x := 0.75 if second % 8 else 0.25, 0.2), (x, 0.8)],
    "follow": lambda second, place, _: None if second % 2 else arc(0.3, centre=place),
    "opposite": lambda second, place, _: None if second % 2 else [(1.0 - place[0], 1.0 - place[1])],
    "lap": lap,
}
"""As `static/ideas.js` has them."""


class Person:
    """Draws an idea, from the second second of a game on."""

    name, answers = "person", "density"
    observation = ObservationConfig(grid=25, channels=("opposing_positions",))

    def __init__(self, idea: str, sigma: float) -> None:
        self._draw, self._width, self._sigma = IDEAS[idea], WIDE.get(idea, 0.1), sigma

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games."""
        self._generators = {row: np.random.default_rng(seed) for row, seed in zip(rows.tolist(), seeds, strict=True)}
        self._seen: dict[int, Points] = {row: [] for row in rows.tolist()}
        self._command = dict.fromkeys(rows.tolist(), np.ones((10, 10)))

    def act(self, observations: NDArray[np.uint8], rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Answer observations (n, 1, 25, 25) with densities (n, 10, 10)."""
        centres = (np.arange(25) + 0.5) / 25
        for image, row in zip(observations[:, 0].astype(np.float64), rows.tolist(), strict=True):
            total, seen = image.sum(), self._seen[row]
            mean = (image.sum(axis=0) @ centres / total, image.sum(axis=1) @ centres / total) if total else MIDDLE
            seen.append(mean)
            drawn = self._draw(len(seen) - 2, seen[-2], seen[0]) if len(seen) > 1 else None
            if drawn is not None:
                aside = self._generators[row].normal(0.0, self._sigma, 2)
                points = tuple((float(x), float(y)) for x, y in np.clip(np.array(drawn) + aside, -0.5, 1.5))
                self._command[row] = density_of([Stroke(brush="attract", width=self._width, points=points)], 10)
        return np.stack([self._command[row] for row in rows.tolist()])


def rounds(idea: str, sigma: float, opponent: str, games: int) -> tuple[list[int], float]:
    """Return how many of a person's rounds were won, drawn and lost, and their median seconds."""
    numbers = [game_number(pair) for pair in range(games)]
    rollout = Rollout(Person(idea, sigma), opponent, numbers, config=GameConfig(time_limit=120.0))
    rollout.play()
    played = rollout.games()
    rollout.close()
    signs = np.sign(np.array([game.share for game in played]) - 0.5)
    return [int((signs == sign).sum()) for sign in (1, 0, -1)], float(np.median([game.seconds for game in played]))


def main() -> None:
    """Play and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, default=50)
    games = parser.parse_args().games
    levels = dict(re.findall(r"^  (\w+): \{ face.*idea: \"(\w+)\"", (STATIC / "levels.js").read_text(), re.MULTILINE))
    write = csv.writer(sys.stdout, lineterminator="\n").writerow
    write(["opponent", "one ring: won", "drawn", "lost", "idea", "won", "drawn", "lost", "median s"])
    for opponent in (*SCRIPTED, *LEARNED):
        ring, _ = rounds("surround", 0.0, opponent, games)
        counts, seconds = rounds(levels[opponent], SIGMA, opponent, games)
        write([opponent, *ring, levels[opponent], *counts, round(seconds)])


if __name__ == "__main__":
    main()
