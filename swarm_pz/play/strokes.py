"""Drawings as commands: strokes are painted on an image, later ones over earlier ones, and the image is smoothed.

The command holds the image's mean over each cell.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GRID_CELLS, GameConfig
from swarm_pz.errors import CommandError, nearest
from swarm_pz.kernels.painting import paint

Brush = Literal["attract", "repel", "erase"]
BRUSHES: tuple[Brush, ...] = ("attract", "repel", "erase")
Mapping = Literal["firm", "paper"]
NARROWEST, WIDEST = 0.05, 0.30
"""Widths of a brush, in map widths."""
MOST_POINTS = 4096
"""Points of all strokes of a drawing together."""
MOST_INK = 100.0
"""Largest length times width of all lines, in map areas: it bounds the cost of painting. People's stay below 5."""
_PIXELS = 2 * GRID_CELLS
"""Pixels a side of the painted image."""


@dataclass(frozen=True, kw_only=True)
class Stroke:
    """One line of a drawing; CommandError if it cannot be drawn.

    Attributes
    ----------
    brush : {"attract", "repel", "erase"}
        "erase" makes ground untouched again.
    width : float
        In map widths.
    points : tuple of (float, float)
        x and y in map widths, from -0.5 to 1.5. One point is a dot.
    """

    brush: Brush
    width: float
    points: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        if self.brush not in BRUSHES:
            raise CommandError(f"there is no brush {self.brush!r}; {nearest(str(self.brush), BRUSHES)}")
        if not NARROWEST <= self.width <= WIDEST:
            raise CommandError(f"a brush must be {NARROWEST} to {WIDEST} map widths wide, got {self.width!r}")
        if not 1 <= len(self.points) <= MOST_POINTS:
            raise CommandError(f"a stroke must have 1 to {MOST_POINTS} points, got {len(self.points)}")
        points = np.array(self.points, np.float64)
        if points.shape != (len(self.points), 2) or not (np.abs(points - 0.5) <= 1.0).all():
            raise CommandError("a stroke's points must be pairs x, y between -0.5 and 1.5")


# A recorded game names its mapping, so these never change: another mapping gets another name.
SMOOTHING: dict[Mapping, float] = {"firm": 0.05, "paper": 0.2}
"""Standard deviation, in map widths, of the Gaussian that smooths the image."""


def mapping_of(game: GameConfig) -> Mapping:
    """Return the mapping that suits the rules: `paper` for targets of mass above 1, else `firm`."""
    return "paper" if game.controller.target_mass > 1.0 else "firm"


def density_of(strokes: Sequence[Stroke], cells: int, mapping: Mapping = "firm") -> NDArray[np.float64]:
    """Return the density that a drawing asks for: 1 where it attracts, 0 where it repels, else one half.

    With "firm", untouched ground is 0 if any ground attracts, and ground that repels stays empty when smoothed.
    "paper" is for targets of mass 10: with mass 1, strokes would weigh little compared with ground at one half.

    Parameters
    ----------
    strokes : sequence of Stroke
        In the order of drawing; without any, the density is uniform.
    cells : int
        Cells A a side of the command.
    mapping : str
        One of `SMOOTHING`.

    Returns
    -------
    float64 array (A, A)
        Values in [0, 1], `[row = y, column = x]`.

    Raises
    ------
    CommandError
        For too many points or too much ink.
    """
    painted, smoothing, is_firm = _painted(strokes), SMOOTHING[mapping], mapping == "firm"
    attracts, repels = (painted == BRUSHES.index(brush) for brush in BRUSHES[:2])
    untouched = 0.0 if is_firm and attracts.any() else 0.5
    image = np.where(attracts, 1.0, np.where(repels, 0.0, untouched))
    if not (is_firm and repels.any()):
        return _smooth(image, smoothing, cells)
    # Repelling ground is empty up to its edge; this effect fades beyond the edge.
    empty = np.minimum(2.0 * _smooth(repels * 1.0, smoothing, _PIXELS), 1.0)  # one half at an edge
    means, smoothed = _averaging_matrix(cells), _smooth(image, smoothing, _PIXELS)
    return np.asarray(means @ (smoothed - empty * smoothed) @ means.T)


def attraction_of(strokes: Sequence[Stroke], cells: int, mapping: Mapping = "firm") -> NDArray[np.float64]:
    """Return images of attracting and of repelling ground (2, A, A); arguments and errors as in `density_of`."""
    painted, smoothing = _painted(strokes), SMOOTHING[mapping]
    return np.stack([_smooth((painted == BRUSHES.index(brush)) * 1.0, smoothing, cells) for brush in BRUSHES[:2]])


def _painted(strokes: Sequence[Stroke]) -> NDArray[np.int8]:
    """Return the index of the last brush at each pixel."""
    if (count := sum(len(stroke.points) for stroke in strokes)) > MOST_POINTS:
        raise CommandError(f"a drawing may have {MOST_POINTS} points, got {count}")
    lines = [np.array(stroke.points, np.float64) for stroke in strokes]
    lengths = [float(np.hypot(*np.diff(line, axis=0).T).sum()) for line in lines]
    ink = sum(stroke.width * length for stroke, length in zip(strokes, lengths, strict=True))
    if ink > MOST_INK:
        raise CommandError(
            f"a drawing's lines may cover the map {MOST_INK:g} times, length times width, got {ink:.1f} times; "
            "draw shorter or thinner lines, or fewer"
        )
    painted = np.full((_PIXELS, _PIXELS), BRUSHES.index("erase"), np.int8)
    for stroke, line in zip(strokes, lines, strict=True):
        paint(painted, line * _PIXELS, stroke.width / 2 * _PIXELS, BRUSHES.index(stroke.brush))
    return painted


def _smooth(image: NDArray[np.float64], smoothing: float, cells: int) -> NDArray[np.float64]:
    along = _smoothing_matrix(smoothing, cells)
    return np.asarray(np.clip(along @ image @ along.T, 0.0, 1.0))


@cache
def _smoothing_matrix(smoothing: float, cells: int) -> NDArray[np.float64]:
    """Return weights (cells, pixels) that smooth along an axis, mirrored at the walls, and average over the cells."""
    centres = (np.arange(_PIXELS) + 0.5) / _PIXELS
    mirrored = np.concatenate([-centres, centres, 2.0 - centres])
    weights = np.exp(-((centres[:, None] - mirrored) ** 2) / (2 * smoothing**2))
    weights = weights.reshape(_PIXELS, 3, _PIXELS).sum(axis=1)
    weights /= weights.sum(axis=1, keepdims=True)
    return np.asarray(_averaging_matrix(cells) @ weights)


@cache
def _averaging_matrix(cells: int) -> NDArray[np.float64]:
    """Return weights of means over the cells (cells, pixels); a cell may cover parts of pixels."""
    edges = np.arange(cells + 1)[:, None] / cells * _PIXELS
    overlap = np.diff(np.clip(edges - np.arange(_PIXELS), 0.0, 1.0), axis=0)
    return np.asarray(overlap * cells / _PIXELS)
