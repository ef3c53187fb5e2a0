"""Drawings as a person makes them at the table, and the commands that the table makes of them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.play.strokes import Stroke, density_of

Array = NDArray[np.float64]


class Drawing(NamedTuple):
    """The strokes of a drawing."""

    strokes: tuple[Stroke, ...]

    @property
    def density(self) -> Array:
        """The command (A, A) that the table makes of them, rounded to a thousandth."""
        asked = density_of(self.strokes, GameConfig().command_cells)
        return np.asarray(np.round(asked / asked.max(), 3))


def interpolated(density: Array, cells: int) -> Array:
    """Return the target that a command (A, A) stands for, at the centres of (cells, cells)."""
    centres, own = ((np.arange(count) + 0.5) / count for count in (cells, len(density)))
    along = np.stack([np.interp(centres, own, unit) for unit in np.eye(len(density))], axis=1)
    return np.asarray(along @ density @ along.T)


def _stroke(points: list[list[float]], **brush: Any) -> Stroke:
    return Stroke(points=tuple((x, y) for x, y in points), **brush)


DRAWINGS = {
    name: Drawing(tuple(_stroke(**stroke) for stroke in strokes))
    for name, strokes in json.loads(Path(__file__).with_suffix(".json").read_text()).items()
}
"""A ring around the middle; a large and a small spot; ground to keep away from, across the whole square."""
