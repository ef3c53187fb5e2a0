"""Shapes of formations: a slot for every drone, in a frame of their own.

The middle is (0, 0), and a shape reaches 1 away from it along its axes; it faces along x, and is its own mirror image
about that axis. A formation at c, of size s and turn a, has the slots c + s Rot(a) e. For m drones, i = 0 to m - 1:

- `ring`: e_i on the unit circle at the angle 2 pi i / m.
- `disc`: one drone in the middle, and rings r = 1 to g of radius r/g, each as `ring`; g is the least number with
  3 g (g + 1) >= m - 1; rings 1 to r hold (m - 1) r (r + 1) / (g (g + 1)) drones in all, rounded (halves up).
- `line`: (t_i, 0), with t_i = (2 i - m + 1) / (m - 1), or 0 for one drone.
- `wedge`: the line bent at its middle, which points forward: (1 - 1.5 |t_i|, sin(120 degrees) t_i).
- `grid`: ranks of a = ceil(sqrt(m)) drones from the front, +x, to the rear, the last with the rest; gap 2 / (a - 1), or
  2 for one drone; each rank, and all together, centred.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SHAPES = ("ring", "disc", "line", "wedge", "grid")
"""In the order of shape numbers."""
_SWEEP = 2 * math.pi / 3
"""Angle between a wedge's heading and the end of an arm, seen from the middle."""


@lru_cache(maxsize=1024)
def unit_slots(shape: str, drones: int) -> Array:
    """Return the slots (drones, 2) of a shape; read-only."""
    slots = _MAKERS[shape](drones)
    slots.flags.writeable = False
    return slots


def _circle(drones: int) -> Array:
    angles = 2 * np.pi * np.arange(drones) / max(drones, 1)
    return np.stack([np.cos(angles), np.sin(angles)], axis=1)


def _disc(drones: int) -> Array:
    """Place one in the middle, and rings around it that hold drones in proportion to their radii."""
    rings, others, placed = 0, drones - 1, 0
    while 3 * rings * (rings + 1) < others:
        rings += 1
    slots = [np.zeros((min(drones, 1), 2))]
    for ring in range(1, rings + 1):
        whole = rings * (rings + 1)
        so_far = (2 * others * ring * (ring + 1) + whole) // (2 * whole)  # rounded
        slots.append(ring / rings * _circle(so_far - placed))
        placed = so_far
    return np.concatenate(slots)


def _steps(drones: int) -> Array:
    """Return evenly spaced places from -1 to 1; a single one is 0."""
    return (2.0 * np.arange(drones) - (drones - 1)) / max(drones - 1, 1)


def _line(drones: int) -> Array:
    return np.stack([_steps(drones), np.zeros(drones)], axis=1)


def _wedge(drones: int) -> Array:
    """Bend a line at its middle, the tip, which stands at (1, 0)."""
    steps = _steps(drones)
    return np.stack([1.0 + np.abs(steps) * (math.cos(_SWEEP) - 1.0), steps * math.sin(_SWEEP)], axis=1)


def _grid(drones: int) -> Array:
    """Place ranks one behind the other, each centred on the axis."""
    side = math.ceil(math.sqrt(drones))
    gap = 2.0 / max(side - 1, 1)
    rank = np.arange(drones) // max(side, 1)
    ranks = -(-drones // max(side, 1))
    wide = np.minimum(side, drones - rank * side)
    file = np.arange(drones) - rank * side
    return np.stack([gap * ((ranks - 1) / 2 - rank), gap * ((wide - 1) / 2 - file)], axis=1)


_MAKERS = dict(zip(SHAPES, (_circle, _disc, _line, _wedge, _grid), strict=True))
