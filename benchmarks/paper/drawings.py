"""Drawings of a person, and the commands that the server makes of them."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.play.strokes import Mapping, Stroke, density_of

Array = NDArray[np.float64]
CELLS = GameConfig().command_cells


class Drawing(NamedTuple):
    """The strokes of a drawing."""

    strokes: tuple[Stroke, ...]

    def density(self, mapping: Mapping) -> Array:
        """Return the command (A, A) that the server makes of the strokes, rounded to a thousandth."""
        density = density_of(self.strokes, CELLS, mapping)
        return np.asarray(np.round(density / density.max(), 3))


def dot(place: tuple[float, float], width: float) -> Drawing:
    """Return one touch of the brush Attract."""
    return Drawing((_stroke([[*place]], brush="attract", width=width),))


def painted(density: Array, mapping: Mapping, *, repels: bool = False) -> Array:
    """Return the command (A, A) of a drawing that paints Attract where a density is at least half of its maximum.

    All other ground is left alone, or painted with Repel.
    """
    attracts = density >= 0.5 * density.max()
    return _painted(attracts.tobytes(), len(density), mapping, repels).copy()


@cache
def _painted(attracts: bytes, cells: int, mapping: Mapping, repels: bool) -> Array:
    ground = np.frombuffer(attracts, np.bool_).reshape(cells, cells)
    if ground.all():
        return np.ones((cells, cells))  # nothing is drawn: spread out
    brushes = {True: "attract", False: "repel"} if repels else {True: "attract"}
    strokes = [
        # Dots are round, so they are a little wider than a cell.
        _stroke([[(column + 0.5) / cells, (row + 0.5) / cells]], brush=brushes[bool(ground[row, column])], width=0.12)
        for row, column in np.ndindex(ground.shape)
        if bool(ground[row, column]) in brushes
    ]
    return Drawing(tuple(strokes)).density(mapping)


def interpolated(density: Array, cells: int) -> Array:
    """Return a command (A, A), interpolated at the centres of (cells, cells)."""
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
