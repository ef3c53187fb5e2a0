"""Overlays: a team's target, its coverage, its capture ground, and the potential that pushes its drones.

Densities are in multiples of uniform coverage. Targets and coverage have the same levels, so that lines of a
team's coverage can be laid over the shades of its target.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import TEAM_NAMES
from swarm_pz.errors import RenderError, nearest, require_extra
from swarm_pz.rendering.board import (
    INK,
    LEVELS,
    SHADE_COLOURS,
    TEAM_COLOURS,
    Canvas,
    cells_per_unit,
    font,
    lines,
    mask_of,
    paint_captures,
    paint_ground,
    planes_of,
    smoothly,
)
from swarm_pz.rendering.painter import ENTRY_HEIGHT, Overlay
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import at_work, potential, reconstruct, shared_coefficients

_CELLS = 300
"""Cells a side in which layers are computed; they are interpolated to pixels."""
_STRENGTHS = (0.1, 0.22, 0.34, 0.46, 0.58)
_WIDTHS = (0.8, 1.4, 2.2, 3.2, 4.4)
"""Pixels, of 600; interpolated lines look thinner by 0.6."""
_GREY = (120, 126, 132)
_ARROWS = 13
"""Arrows a side."""
_ISOLINES = 8
_BOX = 25
"""Pixels of a box in the legend."""


@dataclass
class _OfTeam:
    team: int

    def __post_init__(self) -> None:
        self._name, self._dark = TEAM_NAMES[self.team], SHADE_COLOURS[self.team]


class Target(_OfTeam):
    """Shades of a team's target, from the controller's modes."""

    def paint(self, arena: Canvas, simulator: Simulator, row: int, side: int) -> None:
        """Shade the target in force."""
        density = reconstruct(simulator.target_coefficients[row, self.team], _CELLS, smooth=True)
        arena.lay(TEAM_COLOURS[self.team], mask_of(_shades(density, LEVELS, _STRENGTHS), side))

    def explain(self, picture: Any, x: int, y: int) -> None:
        """Show the shades and their densities."""
        pen = _pen(picture)
        for number, (level, strength) in enumerate(zip(LEVELS, _STRENGTHS, strict=True)):
            fill = (*TEAM_COLOURS[self.team], round(255 * strength))
            _box(pen, x + number * _BOX, y, f"{level:g}", fill=fill)
        _say(pen, x + len(LEVELS) * _BOX, y, f"{self._name}'s target (uniform: 1)")


class Coverage(_OfTeam):
    """Lines of a team's coverage in its controller's memory and look-ahead."""

    def paint(self, arena: Canvas, simulator: Simulator, row: int, side: int) -> None:
        """Draw a line at each level, wider where it is denser."""
        if not len(at_work(simulator, row, self.team)):
            return
        density = reconstruct(shared_coefficients(simulator, row, self.team), _CELLS, smooth=True)
        arena.lay(self._dark, mask_of(lines(density, LEVELS, np.add(_WIDTHS, 0.6) / 2), side))

    def explain(self, picture: Any, x: int, y: int) -> None:
        """Show the lines and their densities."""
        pen = _pen(picture)
        for number, (level, width) in enumerate(zip(LEVELS, _WIDTHS, strict=True)):
            left = x + number * _BOX
            _box(pen, left, y - 3, f"{level:g}")
            bottom = y + ENTRY_HEIGHT - 7
            pen.rectangle((left, bottom - width, left + _BOX - 4, bottom), fill=self._dark)
        _say(pen, x + len(LEVELS) * _BOX, y, f"{self._name}'s coverage (uniform: 1)")


class Captures(_OfTeam):
    """The ground where a team captures, as the board without overlays shows it."""

    def paint(self, arena: Canvas, simulator: Simulator, row: int, side: int) -> None:
        """Paint the ground cell by cell."""
        paint_captures(arena, simulator, row, side, [self.team])

    def explain(self, picture: Any, x: int, y: int) -> None:
        """Show a piece of such ground."""
        image = require_extra("PIL.Image", "render")
        size = 2 * _BOX - 4, ENTRY_HEIGHT - 11
        swatch = planes_of(image.new("RGB", size, "white"))
        paint_ground(swatch, self.team, image.new("L", size, 255), (0, 0))
        picture.paste(image.fromarray(swatch.array()), (x, y + 3))
        _say(_pen(picture), x + 2 * _BOX, y, f"where {self._name} captures")


class Potential(_OfTeam):
    """Grey hills with contour lines, and arrows along which a team's drones are pushed."""

    def paint(self, arena: Canvas, simulator: Simulator, row: int, side: int) -> None:
        """Draw the landscape, and arrows down its gradient, longer where it is steeper."""
        if not len(at_work(simulator, row, self.team)):
            return
        heights, _ = potential(simulator, row, self.team, _CELLS)
        low, high = float(heights.min()), float(heights.max())
        if high - low < 1e-9:
            return
        arena.lay(_GREY, mask_of(0.5 * (heights - low) / (high - low), side))
        levels = np.linspace(low, high, _ISOLINES + 2)[1:-1]
        arena.lay(_GREY, mask_of(0.8 * lines(heights, levels, np.full(_ISOLINES, 0.8)), side))
        _, gradient = potential(simulator, row, self.team, _ARROWS)
        steepness = np.linalg.norm(gradient, axis=-1)
        with smoothly(arena, self._dark, side) as (pen, scale):
            step = side * scale / _ARROWS
            for cell in np.argwhere(steepness > 0.02 * steepness.max()):
                slope = gradient[tuple(cell)]
                length = 0.85 * step * np.sqrt(steepness[tuple(cell)] / steepness.max())
                way = -slope / steepness[tuple(cell)] * [1.0, -1.0]  # y grows downwards in an image
                centre = np.array([cell[1] + 0.5, _ARROWS - cell[0] - 0.5]) * step
                _arrow(pen, centre - way * length / 2, centre + way * length / 2, 255, 2 * scale)

    def explain(self, picture: Any, x: int, y: int) -> None:
        """Show a slope and an arrow down it."""
        pen = _pen(picture)
        right = x + 2 * _BOX - 4
        for place in range(x, right):
            strength = round(127 * (right - place) / (right - x))
            pen.line([(place, y + 3), (place, y + ENTRY_HEIGHT - 8)], fill=(*_GREY, strength))
        middle = y + ENTRY_HEIGHT / 2 - 2.5
        _arrow(pen, np.array([x + 12, middle]), np.array([right - 8, middle]), self._dark, 2)
        _say(pen, x + 2 * _BOX, y, f"the way {self._name} is pushed")


KINDS: dict[str, Callable[[int], Overlay]] = {
    "potential": Potential,
    "target": Target,
    "coverage": Coverage,
    "captures": Captures,
}
"""All kinds, the lowest first."""


def make_overlays(kinds: Sequence[str], teams: Sequence[int]) -> list[Overlay]:
    """Return overlays of teams (0 red, 1 blue), the lowest first; kinds are any of `KINDS`.

    Raises RenderError if a kind is unknown, or for potentials of both teams, which would look alike.
    """
    for kind in kinds:
        if kind not in KINDS:
            raise RenderError(f"there is no overlay {kind!r}; {nearest(kind, KINDS)}")
    if "potential" in kinds and len(teams) > 1:
        raise RenderError("the overlay 'potential' shows one team at a time: choose red or blue, not both")
    return [KINDS[kind](team) for kind in KINDS if kind in kinds for team in teams]


def _shades(image: NDArray[np.float64], levels: Sequence[float], shades: Sequence[float]) -> NDArray[np.float64]:
    """Return the shade of the highest level below an image (cells, cells); edges are a cell wide."""
    per_cell, strength, last = cells_per_unit(image), np.zeros_like(image), 0.0
    for level, shade in zip(levels, shades, strict=True):
        strength += (shade - last) * np.clip((image - level) * per_cell + 0.5, 0.0, 1.0)
        last = shade
    return strength


def _pen(image: Any) -> Any:
    return require_extra("PIL.ImageDraw", "render").Draw(image, "RGBA")


def _arrow(
    pen: Any, start: NDArray[np.float64], end: NDArray[np.float64], colour: int | tuple[int, int, int], width: int
) -> None:
    along = (end - start) / max(float(np.linalg.norm(end - start)), 1e-9)
    across = np.array([-along[1], along[0]])
    neck = end - 3.0 * width * along
    pen.line([tuple(start), tuple(neck)], fill=colour, width=width)
    pen.polygon([tuple(end), tuple(neck + 1.7 * width * across), tuple(neck - 1.7 * width * across)], fill=colour)


def _box(pen: Any, x: int, y: int, text: str, fill: Any = None) -> None:
    box = (x, y + 3, x + _BOX - 3, y + ENTRY_HEIGHT - 8)
    pen.rectangle(box, fill=fill)
    middle = ((box[0] + box[2]) / 2, (box[1] + box[3]) / 2)
    pen.text(middle, text, fill=INK, font=font(12), anchor="mm")


def _say(pen: Any, x: int, y: int, text: str) -> None:
    pen.text((x + 4, y + ENTRY_HEIGHT / 2 - 2.5), text, fill=INK, font=font(13.5), anchor="lm")
