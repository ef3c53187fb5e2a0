"""Plays every opponent of the page against a ring, drawn once, and against the idea that the page teaches.

Ideas are drawn as a person would: a second late, and with a random error of a fortieth of the board.

python -m benchmarks.page_levels > docs/tables/page_levels.csv
"""

from __future__ import annotations

import argparse
import csv
import json
import re
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.evaluation.rollout import Rollout, game_number
from swarm_pz.play.opponents import LEARNED, SCRIPTED
from swarm_pz.play.site import STATIC
from swarm_pz.play.strokes import Stroke, density_of
from swarm_pz.simulator.spawn import Seed

MIDDLE = np.array([0.5, 0.5])
SIGMA = 0.025
"""Standard deviation of the hand's error, in map widths."""
IDEAS: dict[str, dict[str, Any]]
LEVELS: dict[str, str]
"""The idea that the page teaches against each opponent."""
_TEXT = (STATIC / "levels.js").read_text()
IDEAS = json.loads(_TEXT[_TEXT.index("IDEAS = ") + 8 : _TEXT.rindex(";")])
LEVELS = dict(re.findall(r"^  (\w+): \{ face.*idea: \"(\w+)\"", _TEXT, re.MULTILINE))


def drawing(idea: dict[str, Any], number: int, they: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the points (60, 2) of an idea's drawing `number`; `they` is the opponents' mean position."""
    middle, half = idea.get("begins", 0) + idea.get("turn", 0) * number, idea.get("length", 360) / 2
    centre = {"they": they, "across": 1 - they}.get(idea.get("centre"), MIDDLE)
    angles = np.radians(np.linspace(middle - half, middle + half, 60))
    return centre + idea["radii"][number % len(idea["radii"])] * np.stack([np.cos(angles), np.sin(angles)], axis=1)


class Person:
    """Draws an idea; the first command of a game is uniform."""

    name, answers = "person", "density"
    observation = ObservationConfig(grid=25, channels=("opposing_positions",))

    def __init__(self, idea: str, sigma: float) -> None:
        self._idea, self._sigma = IDEAS[idea], sigma

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games."""
        self._generators = {row: np.random.default_rng(seed) for row, seed in zip(rows.tolist(), seeds, strict=True)}
        self._middles: dict[int, list[NDArray[np.float64]]] = {row: [] for row in rows.tolist()}
        self._command = dict.fromkeys(rows.tolist(), np.ones((10, 10)))

    def act(self, observations: NDArray[np.uint8], rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Answer observations (n, 1, 25, 25) with densities (n, 10, 10)."""
        centres = (np.arange(25) + 0.5) / 25
        for image, row in zip(observations[:, 0].astype(np.float64), rows.tolist(), strict=True):
            total, middles = image.sum(), self._middles[row]
            middles.append(
                np.array([image.sum(axis=0) @ centres, image.sum(axis=1) @ centres]) / total if total else MIDDLE
            )
            number, rest = divmod(len(middles) - 2, self._idea["every_s"])
            if number >= 0 and rest == 0:
                drawn = drawing(self._idea, number, middles[-2]) + self._generators[row].normal(0.0, self._sigma, 2)
                points = tuple((float(x), float(y)) for x, y in np.clip(drawn, -0.5, 1.5))
                stroke = Stroke(brush="attract", width=self._idea.get("width", 0.1), points=points)
                self._command[row] = density_of([stroke], 10)
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
    write = csv.writer(sys.stdout, lineterminator="\n").writerow
    write(["opponent", "one ring: won", "drawn", "lost", "idea", "won", "drawn", "lost", "median s"])
    for opponent in (*SCRIPTED, *LEARNED):
        ring, _ = rounds("surround", 0.0, opponent, games)
        counts, seconds = rounds(LEVELS[opponent], SIGMA, opponent, games)
        write([opponent, *ring, LEVELS[opponent], *counts, round(seconds)])


if __name__ == "__main__":
    main()
