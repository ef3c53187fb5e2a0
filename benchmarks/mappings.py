"""How much of a swarm's time a drawing holds, by the rules and by what becomes of the drawing.

python -m benchmarks.mappings > docs/tables/mappings.csv
"""

from __future__ import annotations

import csv
import sys
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper.coverage import Flight, lone_team, start
from benchmarks.paper.drawings import interpolated
from swarm_pz.config import GameConfig
from swarm_pz.play.ros.commands import coarse
from swarm_pz.play.strokes import MAPPINGS, Stroke, density_of, mapping_of

DRONES, GAMES, CELLS = 10, 20, 10
PLACE, MIDDLE, RADIUS = (0.3, 0.6), (0.5, 0.5), 0.25
ANGLES = np.linspace(0.0, 2.0 * np.pi, 60)
ROUND = tuple((0.5 + RADIUS * np.cos(angle), 0.5 + RADIUS * np.sin(angle)) for angle in ANGLES)

Array = NDArray[np.float64]
DRAWN: dict[str, tuple[Stroke, tuple[float, float], float, float]] = {
    "dot 0.1 wide: within 0.15": (Stroke(brush="attract", width=0.1, points=(PLACE,)), PLACE, 0.0, 0.15),
    "dot 0.3 wide: within 0.15": (Stroke(brush="attract", width=0.3, points=(PLACE,)), PLACE, 0.0, 0.15),
    "ring of radius 0.25: within 0.08": (Stroke(brush="attract", width=0.1, points=ROUND), MIDDLE, RADIUS, 0.08),
    "keep away, 0.3 wide: within 0.15": (Stroke(brush="repel", width=0.3, points=(PLACE,)), PLACE, 0.0, 0.15),
}
"""A stroke, and the ground that counts: its middle, and how far from which distance to it."""


def tablet(stroke: Stroke, rules: GameConfig) -> Array:
    """Return the command that the rosbridge makes of what the tablet app sends: 8 bits, and a sum of 10."""
    image = np.rint(interpolated(np.rint(255.0 * density_of([stroke], CELLS, "paper")), 50))
    return coarse((10.0 * image / image.sum()).ravel(), CELLS, is_weak=mapping_of(rules) != "paper")


def shares(places: Iterable[Array]) -> list[str]:
    """Return the share of places (..., 2), those of each drawing, that are on the ground that counts."""
    found = []
    for these, (_, middle, distance, reach) in zip(places, DRAWN.values(), strict=True):
        away = np.linalg.norm(these - middle, axis=-1)
        found.append(f"{(np.abs(away - distance) <= reach).mean():.3f}")
    return found


def main() -> None:
    """Fly and print."""
    write = csv.writer(sys.stdout, lineterminator="\n").writerow
    write(["rules", "drawn by", *DRAWN])
    grid = np.stack(np.meshgrid(*[(np.arange(500) + 0.5) / 500] * 2), axis=-1)
    write(["any", "even cover", *shares([grid] * len(DRAWN))])
    strokes = [stroke for stroke, *_ in DRAWN.values()]
    for name in ("paper", "released"):
        rules = GameConfig.preset(name)
        made = {by: [density_of([stroke], CELLS, by) for stroke in strokes] for by in MAPPINGS}
        for how, commands in (made | {"tablet": [tablet(stroke, rules) for stroke in strokes]}).items():
            flown = (start(lone_team(DRONES, rules), range(GAMES), command) for command in commands)
            write([name, how, *shares(Flight(simulator).places for simulator in flown)])
            sys.stdout.flush()


if __name__ == "__main__":
    main()
