"""Named densities: rings, discs and fronts, for scripted policies and discrete actions.

| name                                   | asks for                                                   |
|----------------------------------------|------------------------------------------------------------|
| `uniform`                              | the whole square evenly                                    |
| `corners`                              | the four corners                                           |
| `halo`                                 | a broad ring around the centre                             |
| `left`, `right`, `bottom`, `top`       | half of the square, with a soft front                      |
| `ring_10_10` ... `ring_90_90`          | a ring around x = 0.1, y = 0.1, and so on in steps of 0.2  |
| `disc_10_10` ... `disc_90_90`          | a disc there; `disc_50_50` is that of the script `centre` |
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_PERCENT = (10, 30, 50, 70, 90)
"""Coordinates of rings and discs, along either axis."""
COMMAND_NAMES: tuple[str, ...] = (
    "uniform",
    "corners",
    "halo",
    "left",
    "right",
    "bottom",
    "top",
    *(f"{shape}_{x}_{y}" for shape in ("ring", "disc") for x in _PERCENT for y in _PERCENT),
)
"""Names of the densities of discrete actions, in their order."""


def ring(distance: Array, radius: float = 0.25, width: float = 0.08) -> Array:
    """Return a ring's density at some distances from its middle, all in map widths."""
    return np.asarray(np.exp(-(((distance - radius) / width) ** 2)))


def disc(distance: Array, width: float) -> Array:
    """Return a Gaussian's density at some distances from its middle; `width` is its standard deviation."""
    return np.asarray(np.exp(-((distance / width) ** 2) / 2))


def front(ahead: Array) -> Array:
    """Return the density at some distances ahead of a soft front: 1 far behind it, 0 far ahead."""
    return np.asarray(1.0 / (1.0 + np.exp(ahead / 0.03)))


def corner_discs(x: Array, y: Array) -> Array:
    """Return the density of discs in the four corners."""
    return disc(np.hypot(np.minimum(x, 1 - x) - 0.1, np.minimum(y, 1 - y) - 0.1), 0.1)


def cell_centres(cells: int) -> tuple[Array, Array]:
    """Return x and y (A, A) of a command's cells, `[row = y, column = x]`, in map widths."""
    centres = (np.arange(cells) + 0.5) / cells
    return centres[None, :] + np.zeros((cells, 1)), centres[:, None] + np.zeros((1, cells))


def density_at(places: Array, cells: int) -> Array:
    """Return densities (n, A, A) in the cells nearest to places (n, P, 2), with a largest value of 1."""
    along = np.clip(places * cells - 0.5, 0.0, cells - 1.0)
    weights = np.maximum(0.0, 1.0 - np.abs(along[..., None] - np.arange(cells)))  # as commands are interpolated
    x, y = weights[:, :, 0], weights[:, :, 1]
    densities = (y[:, :, :, None] * x[:, :, None, :]).sum(axis=1)
    return np.asarray(densities / densities.max(axis=(1, 2), keepdims=True))


@cache
def named_commands(cells: int) -> NDArray[Any]:
    """Return the densities (n, A, A) of `COMMAND_NAMES`, each with 1 as its largest value; read-only."""
    x, y = cell_centres(cells)
    fixed = {
        "uniform": np.ones((cells, cells)),
        "corners": corner_discs(x, y),
        "halo": ring(np.hypot(x - 0.5, y - 0.5), width=0.15),
        "left": front(x - 0.5),
        "right": front(0.5 - x),
        "bottom": front(y - 0.5),
        "top": front(0.5 - y),
    }
    placed = {
        f"{shape}_{px}_{py}": make(np.hypot(x - px / 100, y - py / 100))
        for shape, make in (("ring", ring), ("disc", lambda distance: disc(distance, 0.1)))
        for px in _PERCENT
        for py in _PERCENT
    }
    densities = np.stack([(fixed | placed)[name] for name in COMMAND_NAMES])
    densities /= densities.max(axis=(1, 2), keepdims=True)
    densities.flags.writeable = False
    return densities
