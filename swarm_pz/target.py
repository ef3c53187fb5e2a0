"""From command to target: a coarse density image becomes a density on the square.

A command's values stand at the centres of its cells; between them the density is their bilinear
interpolation, constant beyond the outer centres, normalised to integrate to 1.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_pz.errors import CommandError
from swarm_pz.kernels.fourier import make_targets

TOLERANCE = 1e-6
"""Values this far outside their range are taken for rounding and clipped."""


def check_densities(densities: ArrayLike, shape: tuple[int, ...], name: str = "command") -> NDArray[np.float64]:
    """Return densities (..., A, A) as `check_values` does, with values in [0, 1]."""
    return check_values(densities, shape, 0.0, 1.0, name)


def check_values(given: ArrayLike, shape: tuple[int, ...], low: float, high: float, name: str) -> NDArray[np.float64]:
    """Return values as a fresh float64 array of the given shape and range.

    Parameters
    ----------
    given : array_like
        Anything that casts to float.
    shape : tuple of int
        Expected shape.
    low, high : float
        Expected range; values up to 1e-6 outside are clipped.
    name : str
        What to call them in an error.

    Raises
    ------
    CommandError
        If they do not cast to float, have another shape, or hold NaN, infinity or values outside
        the range.
    """
    expected = f"{name} must be numbers in [{low:g}, {high:g}] of shape {shape}"
    try:
        values = np.array(given, dtype=np.float64, order="C")  # sums must not depend on memory order
    except (TypeError, ValueError) as error:
        raise CommandError(f"{expected}, got {_describe(given)}") from error
    if values.shape != shape:
        raise CommandError(f"{expected}, got {_describe(given) if values.ndim == 0 else f'shape {values.shape}'}")
    if not np.isfinite(values).all():
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(values))[0])
        raise CommandError(f"{expected}, got {values[place]} at index {place}")
    if values.min() < low - TOLERANCE or values.max() > high + TOLERANCE:
        raise CommandError(f"{expected}, got values from {values.min():g} to {values.max():g}")
    return np.asarray(np.clip(values, low, high))


def _describe(value: Any) -> str:
    text = repr(value)
    return f"{type(value).__name__} {text if len(text) <= 60 else text[:57] + '...'}"


@cache
def interpolation_matrix(points: int, cells: int) -> NDArray[np.float64]:
    """Weights of linear interpolation from cell centres to the centres of a finer grid, one axis.

    Returns
    -------
    float64 array (points, cells), each row summing to 1
    """
    centres = (np.arange(points) + 0.5) / points * cells - 0.5
    return _hats(np.clip(centres, 0.0, cells - 1.0), cells)


@cache
def coefficient_matrix(modes: int, cells: int) -> NDArray[np.float64]:
    """Integrals over [0, 1] of cos(pi k x) times each cell's interpolation weight.

    Gauss-Legendre quadrature on the pieces between cell centres, on which the weights are linear:
    exact to rounding for the modes that the kernels have room for.

    Returns
    -------
    float64 array (cells, modes)
    """
    nodes, weights = np.polynomial.legendre.leggauss(24)
    knots = np.concatenate([[0.0], (np.arange(cells) + 0.5) / cells, [1.0]])
    half_widths = np.diff(knots)[:, None] / 2
    x = ((knots[:-1, None] + half_widths) + half_widths * nodes).ravel()
    hats = _hats(np.clip(x * cells - 0.5, 0.0, cells - 1.0), cells)
    cosines = np.cos(np.pi * np.arange(modes)[:, None] * x)
    return np.ascontiguousarray(((cosines * (half_widths * weights).ravel()) @ hats).T)


def _hats(places: NDArray[np.float64], cells: int) -> NDArray[np.float64]:
    """Linear interpolation weights of places in [0, cells - 1], shape (places, cells)."""
    return np.maximum(0.0, 1.0 - np.abs(places[:, None] - np.arange(cells)))


def make_target(density: NDArray[np.float64], modes: int) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    """Return a density's target and its Fourier coefficients.

    Parameters
    ----------
    density : float64 array (A, A)
        Cells `[row = y, column = x]`, not negative; an empty one asks for uniform coverage.
    modes : int
        Modes a side.

    Returns
    -------
    target : float64 array (A, A)
        Sums to 1.
    coefficients : float32 array (modes, modes)
        phi_k, indexed `[k1 (x), k2 (y)]`; phi_0 = 1.
    """
    targets, coefficients = np.empty((1, 1, *density.shape)), np.empty((1, 1, modes, modes), np.float32)
    only = np.zeros(1, np.int64)
    matrix = coefficient_matrix(modes, density.shape[-1])
    make_targets(np.ascontiguousarray(density)[None, None], only, only, only, matrix, targets, coefficients)
    return targets[0, 0], coefficients[0, 0]
