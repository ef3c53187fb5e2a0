"""The attack that learns nothing: a family of commands with ten numbers, and a search for the best of them.

One command of the family is a ring around any place of the square, which leans to or from the opponents and the own
drones, and which goes round a circle with time, on some ground. `ring`, `lasso`, `halo` and `chase` are all of it, and
so is a swarm that hides in a corner, or runs round the middle. The search is CMA-ES (Hansen, "The CMA evolution
strategy: a tutorial", arXiv 1604.00772), by the package cma.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import ObservationConfig
from swarm_pz.errors import require_extra
from swarm_pz.policies.scripted import Tactic, View

Array = NDArray[np.float64]

LOW = (-0.2, -0.2, -0.5, -0.1, 0.0, 0.06, 0.0, 2.0, 0.0, 0.0)
HIGH = (1.2, 1.2, 1.5, 0.9, 0.6, 0.30, 0.4, 30.0, 0.5, 0.5)
"""Bounds of x and y (the place is cut to the square, so walls and corners are often tried), lean to the opponents, lean
to the own drones, radius, width, radius of the circle that the place goes round, its period in s, ground, and a disc in
the middle."""
NUMBERS = len(LOW)
Score = Callable[[Sequence[str]], list[float]]


def siege(numbers: tuple[float, ...]) -> Tactic:
    """Return the tactic of the family with these numbers; raise a ValueError if they are not in its bounds."""
    inside = len(numbers) == NUMBERS and all(
        low - 1e-5 <= number <= high + 1e-5 for low, number, high in zip(LOW, numbers, HIGH, strict=True)
    )
    if not inside:
        raise ValueError(f"expected {NUMBERS} numbers between {LOW} and {HIGH}, got {numbers}")
    x, y, lean, home, radius, width, orbit, period, ground, core = numbers

    def play(view: View) -> Array:
        """Besiege by the numbers."""
        towards, back = view.mean_position("opposing") - 0.5, view.mean_position("own") - 0.5
        angle = 2.0 * np.pi * view.steps / period
        round_it = orbit * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        distance = view.distance_from(np.clip([x, y] + lean * towards + home * back + round_it, 0.0, 1.0))
        ring = np.exp(-(((distance - radius) / width) ** 2))
        return np.asarray(ground + core * np.exp(-((distance / width) ** 2)) + ring)

    return Tactic(play, ObservationConfig(grid=25, channels=("own_positions", "opposing_positions")))


def named(point: Array, prefix: str) -> str:
    """Return the name of a tactic, which holds its numbers; `point` is in the unit cube."""
    numbers = np.asarray(LOW) + np.clip(point, 0.0, 1.0) * (np.asarray(HIGH) - np.asarray(LOW))
    return " ".join([prefix, *(f"{number:.5f}" for number in numbers)])


def search(score: Score, *, prefix: str, generations: int, candidates: int, seed: int) -> str:
    """Return the name, which begins with a prefix, of the best tactic that a search finds.

    `score` returns the scores of a generation's names: always the same, so that a stopped search can be repeated.
    """
    cma = require_extra("cma", "train")
    bounds = {"bounds": [0.0, 1.0], "popsize": candidates, "seed": seed, "verbose": -9, "CMA_stds": None}
    strategy = cma.CMAEvolutionStrategy(np.full(NUMBERS, 0.4), 0.3, bounds)
    best, highest = "", -np.inf
    for _ in range(generations):
        asked = strategy.ask()
        names = [named(np.asarray(point), prefix) for point in asked]
        scores = score(names)
        strategy.tell(asked, [-value for value in scores])
        place = int(np.argmax(scores))
        if scores[place] > highest:
            best, highest = names[place], scores[place]
    return best
