"""Parts of a picture of the board: a canvas, ground, outlines of targets and texts.

Every layer is a mask, laid with a colour over three planes of a byte a pixel: Pillow does that several
times faster than over one image of three bytes a pixel. Row 0 of every grid is at the bottom.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import BLUE, GRID_CELLS, RED
from swarm_pz.errors import require_extra
from swarm_pz.simulator import Simulator

Colour = tuple[int, int, int]

TEAM_COLOURS: tuple[Colour, Colour] = ((214, 40, 57), (29, 98, 214))
SHADE_COLOURS: tuple[Colour, Colour] = ((84, 8, 22), (8, 30, 84))
GROUND_COLOURS: tuple[Colour, Colour] = ((248, 195, 199), (189, 211, 246))
ASKED: Colour = (11, 110, 79)
"""Colour of targets. The page has the same colours and signs."""
INK: Colour = (33, 37, 41)
LEVELS = (0.5, 1.2, 2.0, 4.0, 8.0)
"""Densities at which shades change and lines run, in multiples of uniform coverage; uniform coverage is between two."""
_FAINT, _SIGNED, _TINTED = 200, 191, 0.13
"""Strengths of ground just below capture and of signs on capturing ground (of 255), and of a target's inside (of 1)."""
_APART, _DASH, _LARGEST = 7, 6, 1024
"""Pixels from one such sign to the next, of a dash, and of the side of the largest arena with signs."""
_FINE = 2
"""Trails and arrows are drawn this many times larger and averaged, which smooths edges."""


class Canvas:
    """A picture as three planes (of Pillow, mode L), one a colour."""

    def __init__(self, planes: Any) -> None:
        self._planes = tuple(planes)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height."""
        width, height = self._planes[0].size
        return int(width), int(height)

    def copy(self) -> Canvas:
        """Return the same picture again."""
        return Canvas(plane.copy() for plane in self._planes)

    def lay(self, colour: Colour, mask: Any, place: tuple[int, int] = (0, 0)) -> None:
        """Lay a colour over the picture, with the strength of a mask (mode L), whose top left is at a place."""
        for plane, value in zip(self._planes, colour, strict=True):
            plane.paste(value, place, mask)

    def put(self, picture: Canvas, place: tuple[int, int], mask: Any = None) -> None:
        """Put another picture onto this one."""
        for plane, other in zip(self._planes, picture._planes, strict=True):
            plane.paste(other, place, mask)

    def fill(self, colour: Colour, box: tuple[int, int, int, int]) -> None:
        """Fill a box of left, top, right and bottom."""
        for plane, value in zip(self._planes, colour, strict=True):
            plane.paste(value, box)

    def write(self, text: str, place: tuple[int, int], size: float, colour: Colour, anchor: str = "lm") -> None:
        """Write a text; the anchor is Pillow's."""
        mask, (left, top) = _written(text, size, anchor)
        self.lay(colour, mask, (place[0] + left, place[1] + top))

    def array(self) -> NDArray[np.uint8]:
        """Return the picture as uint8 (height, width, 3)."""
        return np.asarray(_image().merge("RGB", self._planes))


def planes_of(picture: Any) -> Canvas:
    """Return a picture (of Pillow, mode RGB) as planes."""
    return Canvas(picture.split())


def blank(width: int, height: int) -> Canvas:
    """Return a white picture."""
    return Canvas(_image().new("L", (width, height), 255) for _ in range(3))


# --- the ground -----------------------------------------------------------------------------------


def paint_fields(arena: Canvas, simulator: Simulator, row: int, side: int) -> None:
    """Shade the ground, more where a team's field is stronger."""
    image_module = _image()
    bicubic, nearest = image_module.Resampling.BICUBIC, image_module.Resampling.NEAREST
    for team, colour in enumerate(GROUND_COLOURS):
        field = simulator.capture_field[row, team]
        if field.any():
            share = np.minimum(field / (field.max() * simulator.config.capture.threshold), 1.0)
            faint = image_module.fromarray((_FAINT * share[::-1] ** 2).astype(np.uint8))
            # Half the resolution is enough: fields vary slowly.
            arena.lay(colour, faint.resize((side // 2, side // 2), bicubic).resize((side, side), nearest))


def paint_captures(
    arena: Canvas, simulator: Simulator, row: int, side: int, teams: Sequence[int] = (RED, BLUE)
) -> None:
    """Paint the ground where teams capture, cell by cell, as the rule says."""
    for team in teams:
        ground = simulator.captures_here[row, team][::-1]
        if not ground.any():
            continue
        rows, columns = np.flatnonzero(ground.any(axis=1)), np.flatnonzero(ground.any(axis=0))
        edges = (max(columns[0] - 1, 0), max(rows[0] - 1, 0), columns[-1] + 2, rows[-1] + 2)
        left, top, right, bottom = (min(int(edge), GRID_CELLS) for edge in edges)
        box = [round(edge * side / GRID_CELLS) for edge in (left, top, right, bottom)]
        cells = _image().fromarray(np.where(ground[top:bottom, left:right], np.uint8(255), np.uint8(0)))
        paint_ground(arena, team, cells.resize((box[2] - box[0], box[3] - box[1]), 0), (box[0], box[1]))


def paint_ground(picture: Canvas, team: int, inside: Any, place: tuple[int, int]) -> None:
    """Paint ground where a team captures (a mask of 255): tinted, striped or dotted, and edged."""
    chops, filters = require_extra("PIL.ImageChops", "render"), require_extra("PIL.ImageFilter", "render")
    edge = chops.subtract(inside, inside.filter(filters.MinFilter(5)))
    left, top = (edge % _APART for edge in place)
    signs = hatched(team).crop((left, top, left + inside.width, top + inside.height))
    picture.lay(GROUND_COLOURS[team], inside, place)
    picture.lay(TEAM_COLOURS[team], chops.lighter(chops.multiply(inside, signs), edge), place)


@cache
def hatched(team: int) -> Any:
    """Return a mask, as large as an arena, of a team's sign: stripes upwards for red, dots for blue."""
    y, x = np.indices((_LARGEST, _LARGEST)) % _APART
    across = np.abs((x + y + _APART // 2) % _APART - _APART // 2) - 0.2 if team == RED else np.hypot(x - 3, y - 3) - 1.2
    return _image().fromarray(np.round(_SIGNED * np.clip(0.8 - across, 0.0, 1.0)).astype(np.uint8))


# --- targets and lines of equal height ------------------------------------------------------------------------


def outline(team: int, density: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return strengths (cells, cells) of a target's outline: a line at half its maximum, and a tint inside.

    Red's line is whole, blue's is dashed, and a target that is the whole square has none.
    """
    half = density.max() / 2
    if density.min() > half:
        return np.zeros_like(density)
    rows, columns = np.indices(density.shape) // _DASH
    dashes = np.where((rows + columns) % 2 * team, 0.25, 1.0)
    return np.asarray(np.maximum(dashes * lines(density, (half,), (2.0,)), _TINTED * (density > half)))


def lines(image: NDArray[np.float64], levels: ArrayLike, widths: ArrayLike) -> NDArray[np.float64]:
    """Return 1 on contour lines of an image (cells, cells) at `levels`, `widths` cells wide, and 0 elsewhere."""
    per_cell, strength = cells_per_unit(image), np.zeros_like(image)
    for level, width in np.broadcast(levels, widths):
        np.maximum(strength, width / 2 + 0.5 - np.abs((image - level) * per_cell), out=strength)
    return np.minimum(strength, 1.0)


def cells_per_unit(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the distance in cells, to first order, over which an image rises by 1."""
    by_y, by_x = np.gradient(image)
    return np.asarray(1.0 / np.maximum(np.hypot(by_x, by_y), 1e-6))


def mask_of(strength: NDArray[np.floating[Any]], side: int) -> Any:
    """Turn strengths (cells, cells) in [0, 1], row 0 at the bottom, into a mask of `side` pixels a side."""
    image_module = _image()
    mask = image_module.fromarray(np.round(255 * strength[::-1]).astype(np.uint8))
    return mask.resize((side, side), image_module.Resampling.BICUBIC)


@contextmanager
def smoothly(arena: Canvas, colour: Colour, side: int) -> Iterator[tuple[Any, int]]:
    """Yield a Pillow pen, whose strokes of 255 are laid in a colour, and its scale."""
    mask = _image().new("L", (side * _FINE, side * _FINE))
    yield require_extra("PIL.ImageDraw", "render").Draw(mask), _FINE
    arena.lay(colour, mask.reduce(_FINE))


# --- texts ----------------------------------------------------------------------------------------


@cache
def font(size: float) -> Any:
    """Return the typeface of pictures."""
    return require_extra("PIL.ImageFont", "render").load_default(size)


@lru_cache(maxsize=64)
def _written(text: str, size: float, anchor: str) -> tuple[Any, tuple[int, int]]:
    """Write a text into a mask of its size; return it and its offset from the anchor."""
    left, top, right, bottom = (int(edge) for edge in font(size).getbbox(text, anchor=anchor))
    mask = _image().new("L", (max(right - left, 1), max(bottom - top, 1)))
    pen = require_extra("PIL.ImageDraw", "render").Draw(mask)
    pen.text((-left, -top), text, fill=255, font=font(size), anchor=anchor)
    return mask, (left, top)


def shorten(text: str, size: float, width: float) -> str:
    """Cut a text until it is at most `width` pixels wide."""
    if font(size).getlength(text) <= width:
        return text
    while text and font(size).getlength(text + "…") > width:
        text = text[:-1]
    return text + "…"


def _image() -> Any:
    return require_extra("PIL.Image", "render")
