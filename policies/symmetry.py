"""The eight symmetries of a square board: where each entry of a kernel stands in its turned and mirrored copies."""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

ORIENTATIONS = 8


def turn(image: NDArray[np.int64], orientation: int) -> NDArray[np.int64]:
    """Mirror an image (..., a, a) if the orientation is 4 or more, then turn it by `orientation % 4` right angles."""
    mirrored = image[..., ::-1] if orientation >= 4 else image
    return np.rot90(mirrored, orientation % 4, axes=(-2, -1))


@cache
def _relative() -> NDArray[np.int64]:
    """Return (8, 8): which orientation leads from the first to the second, h^-1 h'."""
    probe = np.arange(4).reshape(2, 2)
    views = [turn(probe, orientation).tobytes() for orientation in range(ORIENTATIONS)]
    after = [[views.index(turn(turn(probe, b), a).tobytes()) for b in range(ORIENTATIONS)] for a in range(ORIENTATIONS)]
    return np.array([[row.index(second) for second in range(ORIENTATIONS)] for row in after])


def kernel_places(shape: tuple[int, ...]) -> NDArray[np.int64]:
    """Return the index of each entry of a full kernel in the flattened weights that it is made of.

    Weights have the shape (outputs, inputs, sources, size, size), with 8 sources, or 1 if inputs are plain images.
    The kernel has (8 * outputs, sources * inputs, size, size); channels are ordered by orientation, then by feature.
    """
    outputs, inputs, sources, size, _ = shape
    places = np.arange(np.prod(shape)).reshape(shape)
    kernels = [
        turn(places if sources == 1 else places[:, :, _relative()[orientation]], orientation).swapaxes(1, 2)
        for orientation in range(ORIENTATIONS)
    ]
    return np.ascontiguousarray(np.stack(kernels).reshape(ORIENTATIONS * outputs, sources * inputs, size, size))
