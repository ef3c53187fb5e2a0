from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.kernels.painting import paint

SIDE = 40


def distances(points) -> np.ndarray:
    """Distance of every pixel's centre from a line through points, in float64."""
    centres = np.stack(np.meshgrid(np.arange(SIDE) + 0.5, np.arange(SIDE) + 0.5), axis=-1)  # [row, column] -> x, y
    nearest = np.full((SIDE, SIDE), np.inf)
    for a, b in zip(points, [*points[1:], points[-1]], strict=True):
        step, away = np.subtract(b, a), centres - a
        length = step @ step
        share = np.clip(away @ step / length, 0.0, 1.0) if length else np.zeros((SIDE, SIDE))
        nearest = np.minimum(nearest, np.linalg.norm(away - share[..., None] * step, axis=-1))
    return nearest


@pytest.mark.parametrize(
    ("points", "reach"),
    [
        ([(20.5, 10.5)], 3.0),
        ([(7.25, 30.0), (31.5, 12.75), (35.0, 35.0)], 1.0),
        ([(-9.0, 18.0), (52.0, 25.0)], 6.7),
        ([(12.0, 60.0), (28.0, -7.0)], 6.7),
        ([(1.0, 1.0), (39.0, 39.0), (39.0, 1.0), (1.0, 39.0)], 3.0),
        ([(-2.0, -2.0), (-3.0, 41.0), (41.0, 42.5), (43.0, -1.0)], 6.7),
    ],
    ids=["dot", "bent", "across", "up and down", "crossing", "around"],
)
def test_all_pixels_within_reach_of_a_line_get_the_value_and_no_others(points, reach):
    image = np.full((SIDE, SIDE), 7, np.int8)
    paint(image, np.array(points, np.float64), reach, 2)
    away = distances(points)
    clear = np.abs(away - reach) > 1e-9
    np.testing.assert_array_equal(image[clear], np.where(away <= reach, 2, 7)[clear])
    if len(points) == 1:  # a pixel just within reach is painted
        assert np.flatnonzero(image[10] == 2).tolist() == list(range(17, 24))
        assert np.flatnonzero(image[:, 20] == 2).tolist() == list(range(7, 14))
