"""Patterns: a family of players without learning, each described by 13 numbers.

Each command of a pattern is a ring or a spot around a place, on a uniform background. The place may move along an
ellipse, from a fixed angle or from the opponents' direction at the first observation. It may also shift towards the
opponents and the own drones. Patterns include laps, spots, rings, sweeps, hiding, chasing and most scripts.
`swarm_pz.training.search` finds patterns that beat a policy.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.errors import PolicyError
from swarm_pz.policies.scripted import View
from swarm_pz.simulator.spawn import Seed

Array = NDArray[np.float64]

BOUNDS = {
    "x": (-0.2, 1.2),
    "y": (-0.2, 1.2),
    "lean": (-0.5, 1.5),
    "home": (-0.1, 0.9),
    "radius": (0.0, 0.6),
    "width": (0.02, 0.4),
    "along": (0.0, 0.45),
    "across": (-0.45, 0.45),
    "period": (2.0, 40.0),
    "start": (0.0, 1.0),
    "look": (0.0, 1.0),
    "ground": (0.0, 0.5),
    "core": (0.0, 0.5),
}
"""Bounds of a player's numbers: its place (clipped to the square, so walls and corners are often tried), its shift
towards the opponents' and the own mean, radius and width of the ring, half axes of the ellipse, its period in s, the
fraction of a turn at which it begins, whether (0.5 or more) that is counted from the opponents' direction at the first
observation, the background, and a spot in the ring's middle."""
_LOW, _HIGH = np.array(list(BOUNDS.values())).T
_LOGARITHMIC = np.isin(list(BOUNDS), ("width", "period"))
_SPOT = {"x": 0.5, "y": 0.5, "lean": 0.0, "home": 0.0, "radius": 0.0, "width": 0.1, "along": 0.0, "across": 0.0}
_SPOT |= {"period": 6.0, "start": 0.0, "look": 0.0, "ground": 0.0, "core": 0.0}
KINDS = {
    "spot": _SPOT | {"x": 0.35, "y": 0.4, "width": 0.03},
    "hiding": _SPOT | {"x": 0.04, "y": 0.04, "width": 0.06},
    "ring": _SPOT | {"radius": 0.33, "width": 0.12},
    "lap": _SPOT | {"width": 0.25, "along": 0.24, "across": 0.24},
    "lap begun opposite": _SPOT | {"width": 0.18, "along": 0.24, "across": 0.24, "start": 0.5, "look": 1.0},
    "lap beside the middle": _SPOT | {"x": 0.3, "y": 0.3, "along": 0.1, "across": 0.1},
    "sweep": _SPOT | {"width": 0.15, "along": 0.35, "period": 20.0},
    "chase": _SPOT | {"lean": 1.0, "width": 0.12},
    "lasso": _SPOT | {"lean": 1.0, "radius": 0.25, "width": 0.08},
}
"""Named patterns, from which a search begins."""
NAME = "pattern"
_CHANNELS = ("own_positions", "opposing_positions")
_LOG_LOW, _LOG_HIGH = (np.log(ends, where=_LOGARITHMIC, out=np.zeros_like(ends)) for ends in (_LOW, _HIGH))


class PatternPlayer:
    """Plays patterns by their numbers (k, 13), which are dealt to the games in turn."""

    name, answers = NAME, "density"
    observation = ObservationConfig(grid=25, channels=_CHANNELS)

    def __init__(self, numbers: Array, game: GameConfig) -> None:
        fits = numbers.shape[1:] == _LOW.shape
        if not fits or not ((numbers >= _LOW - 1e-5) & (numbers <= _HIGH + 1e-5)).all():
            raise PolicyError(f"expected {len(BOUNDS)} numbers within {BOUNDS}, got {numbers.tolist()}")
        self._numbers, self._game = numbers, game
        self._steps: dict[int, int] = {}
        self._angles: dict[int, float] = {}

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games."""
        self._steps |= dict.fromkeys(rows.tolist(), 0)

    def act(self, observations: NDArray[np.uint8], rows: NDArray[np.int64]) -> Array:
        """Return densities (n, A, A) for observations (n, 2, 25, 25)."""
        games = rows.tolist()
        own = dict(zip(BOUNDS, self._numbers[rows % len(self._numbers)].T, strict=True))
        steps = np.array([self._steps[row] for row in games])
        view = View(observations, _CHANNELS, self._game.command_cells, steps, [], np.zeros((len(rows), 1)))
        towards, back = view.mean_position("opposing") - 0.5, view.mean_position("own") - 0.5
        for row, (x, y) in zip(games, towards.tolist(), strict=True):
            if self._steps[row] == 0:
                self._angles[row] = float(np.arctan2(y, x))
            self._steps[row] += 1
        begun = 2.0 * np.pi * own["start"] + np.where(own["look"] >= 0.5, [self._angles[row] for row in games], 0.0)
        turn = 2.0 * np.pi * steps * self._game.command_period / own["period"]
        u, v = own["along"] * np.cos(turn), own["across"] * np.sin(turn)
        ellipse = np.stack([u * np.cos(begun) - v * np.sin(begun), u * np.sin(begun) + v * np.cos(begun)], axis=1)
        place = np.stack([own["x"], own["y"]], axis=1) + own["lean"][:, None] * towards + own["home"][:, None] * back
        distance = view.distance_from(np.clip(place + ellipse, 0.0, 1.0))
        radius, width, ground, core = (own[name][:, None, None] for name in ("radius", "width", "ground", "core"))
        found = np.exp(-(((distance - radius) / width) ** 2)) + core * np.exp(-((distance / width) ** 2))
        found = ground + found / np.maximum(found.max(axis=(1, 2), keepdims=True), 1e-30)
        return np.asarray(found / found.max(axis=(1, 2), keepdims=True))


def pattern(config: GameConfig, which: str = "lap begun opposite") -> PatternPlayer:
    """Play a pattern, given by its name or 13 numbers, such as `pattern:lap`."""
    if which in KINDS:
        return PatternPlayer(np.array([list(KINDS[which].values())]), config)
    try:
        return PatternPlayer(numbers_in(f"{NAME}:{which}")[None], config)
    except ValueError as error:
        numbers = f"{len(BOUNDS)} numbers with spaces between them ({' '.join(BOUNDS)})"
        raise PolicyError(f"expected {numbers}, or one of {', '.join(KINDS)}; got {which!r}") from error


def name_of(numbers: Array) -> str:
    """Return the name of a pattern, which holds its numbers."""
    return f"{NAME}:" + " ".join(f"{number:.5f}" for number in numbers)


def numbers_in(name: str) -> Array:
    """Return the numbers (13,) that a pattern's name holds."""
    return np.array([float(word) for word in name.partition(":")[2].split()])


def numbers_of(points: Array) -> Array:
    """Return the numbers (n, 13) of points (n, 13) of the unit cube."""
    points = np.clip(points, 0.0, 1.0)
    logarithmic = np.exp(_LOG_LOW + points * (_LOG_HIGH - _LOG_LOW))
    return np.asarray(np.where(_LOGARITHMIC, logarithmic, _LOW + points * (_HIGH - _LOW)))


def points_of(numbers: Array) -> Array:
    """Return the points of the unit cube that numbers (n, 13) stand for."""
    with np.errstate(divide="ignore", invalid="ignore"):
        logarithmic = np.log(numbers / _LOW) / np.log(_HIGH / _LOW)
    return np.asarray(np.where(_LOGARITHMIC, logarithmic, (numbers - _LOW) / (_HIGH - _LOW)))
