"""Drones and their trails, as pictures of the board show them.

A drone's shadow shows its altitude: higher drones have larger shadows, farther off.
"""

from __future__ import annotations

import itertools
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GRID_CELLS, RED
from swarm_pz.errors import require_extra
from swarm_pz.rendering.board import INK, TEAM_COLOURS, Canvas, blank, smoothly
from swarm_pz.simulator import Simulator

LONGEST_LINE = 300
"""Most ticks of a trail that are drawn: a whole game of lines would hide the board."""
_DRONE = 6.5 / 600
"""A drone's radius, in map widths."""
_PHASES = 4
"""Positions within a pixel, along each axis, at which drones are drawn."""
_FINENESS = 2 * _PHASES
"""Drones are drawn this many times larger and averaged, which smooths edges."""
_OUTLINE, _DIAMOND = 9.0 / 6.5, 1.25
"""Reach of a drone's white outline, and of a diamond's corners, in its radii."""
_NEAR, _FAR = 0.4, 1.2
"""A shadow's offset along each axis, in radii: on the ground, and its growth up to altitude 1."""
_GROWN, _SOFT = 0.3, 0.3
"""Growth of a shadow up to altitude 1, and softness of its edge, in its radii."""
_SHADOW, _LEVELS = 90, 8
"""Strength of a shadow, of 255, and the steps of its size."""
_BANDS = 8
"""Strengths in a trail."""
_ROUNDING = 15
"""A trail stores cells, not points: averaging over this many ticks rounds its corners."""


def paint_trails(arena: Canvas, simulator: Simulator, row: int, side: int) -> None:
    """Draw every drone's trail as a line that fades with age."""
    paths = _paths(simulator, row)
    if not len(paths):
        return
    red, blue = TEAM_COLOURS
    with smoothly(arena, red, side) as (pen, scale), smoothly(arena, blue, side) as (other, _):
        _draw_trails([pen, other], simulator.teams[row].tolist(), paths, side * scale)


def _draw_trails(pens: list[Any], teams: list[int], paths: NDArray[np.float64], side: int) -> None:
    every = max(1, (len(paths) - 1) // (3 * _BANDS))
    points = paths[(len(paths) - 1) % every :: every] * [side, -side] + [0.0, side]
    begins = np.isnan(points[..., 0]).sum(axis=0).tolist()
    ends = np.linspace(0, len(points) - 1, _BANDS + 1).astype(int).tolist()
    courses = points.transpose(1, 0, 2).reshape(len(teams), -1).tolist()
    # The oldest of all drones first, so that no old line hides a new one.
    for band, (first, last) in enumerate(itertools.pairwise(ends)):
        strength = round(150 * ((band + 1) / _BANDS) ** 1.5)
        for team, course, begin in zip(teams, courses, begins, strict=True):
            if last > max(first, begin):
                course_now = course[2 * max(first, begin) : 2 * last + 2]
                pens[team].line(course_now, fill=strength, width=round(side / 300))


def _paths(simulator: Simulator, row: int) -> NDArray[np.float64]:
    """Return past places of drones (points, N, 2), the oldest first; NaN where a trail does not reach."""
    trails, tick = simulator.games.trails[row], int(simulator.games.ticks[row])
    ages = np.arange(min(tick, len(trails), LONGEST_LINE))[::-1]
    cells = trails[(tick - 1 - ages) % len(trails)].astype(np.int64)
    window = min(_ROUNDING, len(cells))
    if not window:
        return np.empty((0, simulator.config.num_drones, 2))
    gaps = cells < 0  # forgotten, or while the drone had failed
    places = (np.stack([cells % GRID_CELLS, cells // GRID_CELLS], axis=-1) + 0.5) / GRID_CELLS
    sums = np.cumsum(np.concatenate([np.zeros((1, *places.shape[1:])), places]), axis=0)
    paths = np.concatenate([(sums[window:] - sums[:-window]) / window, simulator.positions[row][None]])
    if gaps.any():
        latest = np.where(gaps.any(axis=0), len(gaps) - 1 - gaps[::-1].argmax(axis=0), -1)
        paths[np.arange(len(paths))[:, None] <= latest] = np.nan
    return paths


def paint_drones(arena: Canvas, simulator: Simulator, row: int, side: int) -> None:
    """Draw red drones as discs and blue ones as diamonds, above the shadows of all."""
    places = (simulator.positions[row].astype(np.float64) * [side, -side] + [0.0, side]).tolist()
    teams = simulator.teams[row].tolist()
    for (x, y), team, altitude in zip(places, teams, simulator.altitudes[row].tolist(), strict=True):
        _put_shadow(arena, team, x, y, altitude, side)
    for (x, y), team in zip(places, teams, strict=True):
        put_drone(arena, team, x, y, side)


def put_drone(picture: Canvas, team: int, x: float, y: float, side: int) -> None:
    """Draw a drone with its centre at a place in pixels, as large as on an arena of `side` pixels."""
    place, phases = _placed(x, y)
    drone, mask = _drone(team, side, *phases)
    reach = mask.width // 2
    picture.put(drone, (place[0] - reach, place[1] - reach), mask)


def _put_shadow(arena: Canvas, team: int, x: float, y: float, altitude: float, side: int) -> None:
    """Draw the shadow of a drone at a place in pixels, as light from the upper left casts it."""
    away = _DRONE * side * (_NEAR + altitude * _FAR)
    place, phases = _placed(x + away, y + away)
    mask = _shadow(team, side, round(_LEVELS * altitude), *phases)
    arena.lay(INK, mask, (place[0] - mask.width // 2, place[1] - mask.width // 2))


def _placed(x: float, y: float) -> tuple[tuple[int, int], tuple[int, int]]:
    """Return the pixel of a place, and the place's offset from it in phases."""
    (column, x_phase), (line, y_phase) = divmod(round(x * _PHASES), _PHASES), divmod(round(y * _PHASES), _PHASES)
    return (column, line), (x_phase, y_phase)


@cache
def _drone(team: int, side: int, x: int, y: int) -> tuple[Canvas, Any]:
    """Draw a drone at an offset (x, y), in phases, from the middle pixel's top left corner."""
    radius = _DRONE * side
    reach = int(radius * _OUTLINE * _DIAMOND) + 2
    around, body = (_shape(team, radius * grown, reach, x, y).reduce(_FINENESS) for grown in (_OUTLINE, 1.0))
    picture = blank(*body.size)
    picture.lay(TEAM_COLOURS[team], body)
    return picture, around


@cache
def _shadow(team: int, side: int, level: int, x: int, y: int) -> Any:
    """Draw a shadow as a mask, with its centre as in `_drone`."""
    radius = _DRONE * side * (1.0 + _GROWN * level / _LEVELS)
    blur = _SOFT * radius
    mask = _shape(team, radius, int(radius * _DIAMOND + 3 * blur) + 2, x, y)
    soft = require_extra("PIL.ImageFilter", "render").GaussianBlur(blur * _FINENESS)
    return mask.filter(soft).reduce(_FINENESS).point([value * _SHADOW // 255 for value in range(256)])


def _shape(team: int, radius: float, reach: int, x: int, y: int) -> Any:
    """Draw a disc or a diamond, `_FINENESS` times as large, into a mask that reaches `reach` pixels to each side."""
    side = 2 * reach * _FINENESS
    mask = require_extra("PIL.Image", "render").new("L", (side, side))
    pen = require_extra("PIL.ImageDraw", "render").Draw(mask)
    step = _FINENESS // _PHASES
    cx, cy, size = reach * _FINENESS + step * x, reach * _FINENESS + step * y, radius * _FINENESS
    if team == RED:
        pen.ellipse((cx - size, cy - size, cx + size, cy + size), fill=255)
    else:
        far = size * _DIAMOND
        pen.polygon([(cx - far, cy), (cx, cy - far), (cx + far, cy), (cx, cy + far)], fill=255)
    return mask
