"""How good a person is: a level on the scale of the ladder, from games against opponents whose ratings are frozen.

The Bradley-Terry model gives a person of level l the chance 1 / (1 + 10^((r - l) / 400)) against an opponent rated r; a
draw is half a win and half a loss. Before the first game levels are normal around `PRIOR_MEAN`. The level is the
posterior's mean, its interval the middle 95 %; both are sums over a grid, exact but for its steps.

What a game tells is p (1 - p) in these units, and most at even odds: so the next opponent is the one nearest to the
level, but for those about as near that were met less lately, since who meets one opponent again and again learns that
opponent, and not the game.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from swarm_pz.evaluation.ratings import SCALE

PRIOR_MEAN, PRIOR_SD = 1000.0, 350.0
"""Levels of people before their first game: around `uniform`, and 95 of 100 between beginners whom everybody beats and
the best that there is."""
AS_NEAR = 50.0
"""Points by which an opponent may be farther off and still be about as near: ratings are not known better than that."""
_GRID = np.arange(-500.0, 3500.1, 10.0)
"""Levels, from four deviations below what is likely to the same above who beats everybody."""
_MIDDLE = (0.025, 0.975)


class Rung(NamedTuple):
    """An opponent on the ladder."""

    name: str
    rating: float


RUNGS = (
    Rung("corners", 778.0),
    Rung("centre", 823.0),
    Rung("blind_ring", 834.0),
    Rung("wavefront", 935.0),
    Rung("ring", 961.0),
    Rung("uniform", 1000.0),
    Rung("lasso", 1201.0),
    Rung("halo", 1210.0),
    Rung("selfplay", 1460.0),
    Rung("hunter", 1510.0),
    Rung("champion", 1752.0),
)
"""From docs/tables/ladder.csv, 40 games a pair, seed 0, as it was on 2026-11-23, without `veteran`.
They stay as they are when that is made anew: levels of before and after would not compare. Planners are not among them,
which see what no side may, nor are those who never come within reach (`evade`) or play as `uniform` does."""


class Met(NamedTuple):
    """One game: whom one met, and one's points, 1 for a win and a half for a draw."""

    opponent: str
    rating: float
    points: float


@dataclass(frozen=True)
class Level:
    """A level with its 95 % interval, in rating points."""

    value: float
    low: float
    high: float


def chance(level: float, rating: float) -> float:
    """Return a person's chance to win; draws are halves."""
    return float(1.0 / (1.0 + np.exp((rating - level) / SCALE)))


def level_of(games: Sequence[Met]) -> Level:
    """Return the level that games show; without any, what is likely of anybody.

    Parameters
    ----------
    games : sequence of Met
        In any order: all count alike.
    """
    logs = -0.5 * ((_GRID - PRIOR_MEAN) / PRIOR_SD) ** 2
    for game in games:
        apart = (_GRID - game.rating) / SCALE  # of which points log p + (1 - points) log(1 - p) is this:
        logs -= np.logaddexp(0.0, -apart) + (1.0 - game.points) * apart
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    # A grid point's weight lies around it: half of it is below.
    low, high = np.interp(_MIDDLE, np.cumsum(weights) - 0.5 * weights, _GRID)
    return Level(float(weights @ _GRID), float(low), float(high))


def next_rung(games: Sequence[Met], rungs: Sequence[Rung] = RUNGS) -> Rung:
    """Return who comes next: of those about as near to the level as the nearest, the one not met for longest.

    Who was never met comes before all others, the nearer first. So nobody is met three times running while another is
    about as near.

    Parameters
    ----------
    games : sequence of Met
        In the order in which they were played.
    rungs : sequence of Rung
        Whom one may meet; at least one.
    """
    level = level_of(games).value
    far = {rung.name: abs(rung.rating - level) for rung in rungs}
    near = [rung for rung in rungs if far[rung.name] <= min(far.values()) + AS_NEAR]
    last = {game.opponent: number for number, game in enumerate(games)}
    return min(near, key=lambda rung: (last.get(rung.name, -1), far[rung.name]))
