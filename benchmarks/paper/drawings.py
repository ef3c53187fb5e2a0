"""Drawings as a person makes them at the table, and the commands that the table makes of them.

Figures know nothing of the table, which stands above them, so both are here: its strokes, and what
`swarm_pz.play.strokes.density_of` makes of them by the table's own mapping. A test asks whether it still does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Drawing:
    """What was drawn, and the command that it asks for.

    Attributes
    ----------
    strokes : tuple of (str, float, tuple of (float, float))
        Brush, its width in map widths, and the points of each line.
    density : float64 array (A, A)
        Values in [0, 1], `[row = y, column = x]`, rounded to a thousandth.
    """

    strokes: tuple[tuple[str, float, tuple[tuple[float, float], ...]], ...]
    density: Array


def _cells(*rows: tuple[int, ...]) -> Array:
    """Return rows of thousandths, the lowest first, as a density."""
    return np.array(rows, np.float64) / 1000.0


def interpolated(density: Array, cells: int) -> Array:
    """Return the target that a command (A, A) stands for, at the centres of (cells, cells)."""
    centres, own = ((np.arange(count) + 0.5) / count for count in (cells, len(density)))
    along = np.stack([np.interp(centres, own, unit) for unit in np.eye(len(density))], axis=1)
    return np.asarray(along @ density @ along.T)


# fmt: off
DRAWINGS: dict[str, Drawing] = {
    "ring": Drawing(
        (
            ("attract", 0.1, (
                (0.72, 0.69), (0.66, 0.73), (0.59, 0.76), (0.52, 0.78), (0.45, 0.79), (0.37, 0.77), (0.31, 0.73),
                (0.26, 0.67), (0.23, 0.6), (0.22, 0.53), (0.23, 0.45), (0.25, 0.39), (0.28, 0.32), (0.33, 0.26),
                (0.4, 0.22), (0.47, 0.22), (0.55, 0.22), (0.61, 0.25), (0.67, 0.29), (0.72, 0.34), (0.76, 0.4),
                (0.79, 0.47), (0.79, 0.55), (0.76, 0.62), (0.72, 0.68), (0.66, 0.72),
            )),
        ),
        _cells(
            (0, 0, 2, 14, 27, 22, 6, 0, 0, 0),
            (0, 4, 84, 359, 538, 485, 230, 39, 2, 0),
            (1, 59, 537, 995, 925, 958, 921, 410, 43, 1),
            (5, 233, 946, 611, 179, 246, 741, 939, 254, 8),
            (17, 435, 956, 238, 7, 11, 229, 947, 547, 31),
            (22, 496, 940, 192, 5, 8, 187, 922, 581, 35),
            (10, 325, 990, 527, 160, 235, 674, 993, 321, 12),
            (1, 89, 617, 1000, 910, 955, 971, 524, 70, 1),
            (0, 6, 103, 392, 580, 478, 246, 58, 3, 0),
            (0, 0, 2, 17, 34, 22, 6, 1, 0, 0),
        ),
    ),
    "two_spots": Drawing(
        (
            ("attract", 0.15, (
                (0.39, 0.38), (0.33, 0.41), (0.26, 0.4), (0.21, 0.36), (0.21, 0.29), (0.23, 0.24), (0.28, 0.21),
                (0.33, 0.22), (0.36, 0.26), (0.38, 0.31), (0.35, 0.35), (0.31, 0.36), (0.27, 0.36), (0.25, 0.33),
                (0.25, 0.3), (0.26, 0.27), (0.29, 0.26), (0.31, 0.27), (0.32, 0.28), (0.34, 0.3),
            )),
            ("attract", 0.1, (
                (0.8, 0.8), (0.76, 0.8), (0.74, 0.78), (0.75, 0.75), (0.78, 0.75), (0.79, 0.77), (0.78, 0.78),
                (0.76, 0.78), (0.76, 0.77),
            )),
        ),
        _cells(
            (0, 10, 43, 39, 7, 0, 0, 0, 0, 0),
            (10, 173, 487, 452, 122, 5, 0, 0, 0, 0),
            (49, 507, 963, 925, 395, 26, 0, 0, 0, 0),
            (64, 575, 1000, 997, 530, 48, 0, 0, 0, 0),
            (20, 255, 624, 658, 303, 25, 0, 0, 0, 0),
            (1, 21, 86, 95, 31, 2, 1, 3, 1, 0),
            (0, 0, 1, 1, 0, 1, 32, 132, 65, 3),
            (0, 0, 0, 0, 0, 3, 152, 574, 317, 20),
            (0, 0, 0, 0, 0, 2, 90, 366, 222, 16),
            (0, 0, 0, 0, 0, 0, 6, 27, 17, 1),
        ),
    ),
    "keep_away": Drawing(
        (
            ("repel", 0.2, (
                (0.12, 0.51), (0.17, 0.57), (0.22, 0.59), (0.28, 0.63), (0.33, 0.62), (0.38, 0.62), (0.43, 0.59),
                (0.48, 0.55), (0.54, 0.51), (0.59, 0.48), (0.64, 0.43), (0.69, 0.4), (0.74, 0.38), (0.8, 0.39),
                (0.85, 0.39), (0.9, 0.42),
            )),
        ),
        _cells(
            (1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000),
            (1000, 1000, 1000, 1000, 1000, 999, 988, 975, 982, 995),
            (997, 996, 999, 1000, 993, 897, 606, 414, 484, 731),
            (803, 745, 930, 974, 788, 276, 15, 0, 0, 51),
            (112, 48, 356, 511, 129, 0, 0, 0, 0, 1),
            (27, 0, 0, 1, 0, 0, 99, 472, 488, 506),
            (487, 59, 0, 0, 13, 270, 755, 968, 982, 982),
            (952, 716, 391, 358, 576, 894, 992, 1000, 1000, 1000),
            (1000, 993, 968, 966, 986, 999, 1000, 1000, 1000, 1000),
            (1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000, 1000),
        ),
    ),
}
# fmt: on
"""A ring around the middle; a large and a small spot; ground to keep away from, across the whole square."""
