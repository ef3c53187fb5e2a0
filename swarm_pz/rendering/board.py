"""What a picture of the board is made of: a canvas, ground, dots of targets and texts.

Every layer is a mask, laid with a colour over three planes of a byte a pixel: Pillow does that several
times faster than over one image of three bytes a pixel. Row 0 of every grid is at the bottom.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import BLUE, GRID_CELLS, RED
from swarm_pz.errors import require_extra
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import reconstruct

Colour = tuple[int, int, int]

TEAM_COLOURS: tuple[Colour, Colour] = ((214, 40, 57), (29, 98, 214))
SHADE_COLOURS: tuple[Colour, Colour] = ((84, 8, 22), (8, 30, 84))
INK: Colour = (33, 37, 41)
LEVELS = (0.5, 1.2, 2.0, 4.0, 8.0)
"""Densities at which shades change and lines run, in multiples of uniform coverage; uniform coverage is between two."""
_FAINT, _PLAIN, _HATCHED = 89, 178, 242
"""Strengths, of 255: of ground just below capture, and between and on the lines of ground that captures."""
_DOTTED, _APART = 0.4, 12
"""Strength of a target's dots, and the pixels from one to the next."""
_FINE = 2
"""Trails and arrows are drawn so many times as large and averaged, which smooths edges."""


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
        """Lay a colour over the picture, with the strength that a mask (mode L) has, its top left at a place."""
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
    """Shade the ground, the darker the stronger a team's field."""
    image_module = _image()
    bicubic, nearest = image_module.Resampling.BICUBIC, image_module.Resampling.NEAREST
    for team, colour in enumerate(SHADE_COLOURS):
        field = simulator.capture_field[row, team]
        if field.any():
            share = np.minimum(field / (field.max() * simulator.config.capture.threshold), 1.0)
            faint = image_module.fromarray((_FAINT * share[::-1] ** 2).astype(np.uint8))
            # Half as fine is fine enough for what changes so slowly.
            arena.lay(colour, faint.resize((side // 2, side // 2), bicubic).resize((side, side), nearest))


def paint_captures(arena: Canvas, simulator: Simulator, row: int, side: int) -> None:
    """Hatch the ground where teams capture, as the rule has it; smoothing only rounds the corners of its cells."""
    for team, colour in enumerate(SHADE_COLOURS):
        ground = simulator.captures_here[row, team][::-1]
        if not ground.any():
            continue
        cells, box = _around(ground, side)
        inside = _image().fromarray(cells).resize((box[2] - box[0], box[3] - box[1]), _image().Resampling.BICUBIC)
        strength = _image().new("L", inside.size)
        strength.paste(hatched(team, side, side).crop(box), (0, 0), inside.point(_IS_INSIDE))
        arena.lay(colour, strength, box[:2])


_IS_INSIDE = [255 * (value > 127) for value in range(256)]


def _around(ground: NDArray[np.bool_], side: int) -> tuple[NDArray[np.uint8], tuple[int, int, int, int]]:
    """Cut out the cells around what is True; return them as 0 or 255, and their box in pixels."""
    rows, columns = np.flatnonzero(ground.any(axis=1)), np.flatnonzero(ground.any(axis=0))
    top, bottom = max(rows[0] - 2, 0), min(rows[-1] + 3, GRID_CELLS)
    left, right = max(columns[0] - 2, 0), min(columns[-1] + 3, GRID_CELLS)
    box = tuple(round(int(edge) * side / GRID_CELLS) for edge in (left, top, right, bottom))
    return np.where(ground[top:bottom, left:right], np.uint8(255), np.uint8(0)), box  # type: ignore[return-value]


@cache
def hatched(team: int, width: int, height: int) -> Any:
    """Return a mask of ground where a team captures: hatched upwards for red, downwards for blue."""
    along, across = np.arange(width), np.arange(height)[:, None]
    lines = ((along + across) if team == RED else (along - across)) % 7 < 4
    return _image().fromarray(np.where(lines, np.uint8(_HATCHED), np.uint8(_PLAIN)))


# --- targets and lines of equal height ------------------------------------------------------------------------


def dots(team: int, coefficients: NDArray[np.floating[Any]], side: int) -> Any:
    """Return a mask of dots that are the larger the denser a target is: trails are lines, and these are none.

    Discs of red and diamonds of blue lie between one another, so that both teams' targets can be seen.
    """
    return mask_of(_DOTTED * dotted(team, reconstruct(coefficients, side, smooth=True)), side)


def dotted(team: int, density: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return dots in [0, 1] for densities (cells, cells), in multiples of uniform coverage."""
    rows, columns = (np.indices(density.shape) + 0.5 + _APART / 2 * (team == BLUE)) % _APART - _APART / 2
    away = np.hypot(rows, columns) if team == RED else np.abs(rows) + np.abs(columns)
    radius = np.minimum(_APART / 7 * np.sqrt(np.maximum(density, 0.0)), 0.45 * _APART)
    return np.asarray(np.clip(radius - away + 0.5, 0.0, 1.0) * (density > LEVELS[0] / 2))


def lines(image: NDArray[np.float64], levels: ArrayLike, widths: ArrayLike) -> NDArray[np.float64]:
    """Return 1 on the lines of an image's (cells, cells) levels, so many cells wide, and 0 elsewhere."""
    per_cell, strength = cells_per_unit(image), np.zeros_like(image)
    for level, width in np.broadcast(levels, widths):
        np.maximum(strength, width / 2 + 0.5 - np.abs((image - level) * per_cell), out=strength)
    return np.minimum(strength, 1.0)


def cells_per_unit(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return how many cells away, to first order, an image is higher by 1."""
    by_y, by_x = np.gradient(image)
    return np.asarray(1.0 / np.maximum(np.hypot(by_x, by_y), 1e-6))


def mask_of(strength: NDArray[np.floating[Any]], side: int) -> Any:
    """Turn strengths (cells, cells) in [0, 1], row 0 at the bottom, into a mask of so many pixels a side."""
    image_module = _image()
    mask = image_module.fromarray(np.round(255 * strength[::-1]).astype(np.uint8))
    return mask.resize((side, side), image_module.Resampling.BICUBIC)


@contextmanager
def smoothly(arena: Canvas, colour: Colour, side: int) -> Iterator[tuple[Any, int]]:
    """Give a pen (of Pillow) whose strokes of 255 are laid with a colour, and how much finer its pixels are."""
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
    """Write a text into a mask of its size; return that and where it lies, seen from the anchor."""
    left, top, right, bottom = (int(edge) for edge in font(size).getbbox(text, anchor=anchor))
    mask = _image().new("L", (max(right - left, 1), max(bottom - top, 1)))
    require_extra("PIL.ImageDraw", "render").Draw(mask).text(
        (-left, -top), text, fill=255, font=font(size), anchor=anchor
    )
    return mask, (left, top)


def shorten(text: str, size: float, width: float) -> str:
    """Cut a text until it is no wider than so many pixels."""
    if font(size).getlength(text) <= width:
        return text
    while text and font(size).getlength(text + "…") > width:
        text = text[:-1]
    return text + "…"


def _image() -> Any:
    return require_extra("PIL.Image", "render")
