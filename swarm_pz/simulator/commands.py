"""Targets from commands: a coarse density image becomes a density on the square.

A command holds the values at the centres of its cells. The density is their bilinear interpolation, constant
beyond the outer centres, normalised to integrate to 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from swarm_pz.kernels.fourier import Aims, make_targets


@dataclass(frozen=True, slots=True)
class CheckedCommands:
    """Commands whose values have been checked; no function checks the values again.

    Attributes
    ----------
    values : float64 array (n, *command_shape), or (E, 2, *command_shape) of both teams
        As `Control.parse`, `Control.read` and `BatchEnv.ask` return them.
    """

    values: NDArray[np.float64]


@cache
def interpolation_matrix(points: int, cells: int) -> NDArray[np.float64]:
    """Return weights (points, cells) of linear interpolation from cell centres to those of a finer grid."""
    centres = (np.arange(points) + 0.5) / points * cells - 0.5
    return hats(np.clip(centres, 0.0, cells - 1.0), cells)


@cache
def coefficient_matrix(modes: int, cells: int) -> NDArray[np.float64]:
    """Return the integrals (cells, modes) over [0, 1] of cos(pi k x) times each cell's interpolation weight.

    Gauss-Legendre quadrature on the pieces between cell centres, on which the weights are linear: exact to rounding for
    the modes that the kernels have room for.
    """
    nodes, weights = np.polynomial.legendre.leggauss(24)
    knots = np.concatenate([[0.0], (np.arange(cells) + 0.5) / cells, [1.0]])
    half_widths = np.diff(knots)[:, None] / 2
    x = ((knots[:-1, None] + half_widths) + half_widths * nodes).ravel()
    weighing = hats(np.clip(x * cells - 0.5, 0.0, cells - 1.0), cells)
    cosines = np.cos(np.pi * np.arange(modes)[:, None] * x)
    return np.ascontiguousarray(((cosines * (half_widths * weights).ravel()) @ weighing).T)


def hats(places: NDArray[np.float64], cells: int) -> NDArray[np.float64]:
    """Return linear interpolation weights (places, cells) of places in [0, cells - 1]."""
    return np.maximum(0.0, 1.0 - np.abs(places[:, None] - np.arange(cells)))


def make_target(density: NDArray[np.float64], modes: int) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    """Return a density's target and its Fourier coefficients, both of mass 1.

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
    only, matrix = np.zeros(1, np.int64), coefficient_matrix(modes, density.shape[-1])
    aims = Aims(targets, coefficients, None, matrix, 1.0, holds=False)
    make_targets(np.ascontiguousarray(density)[None, None], only, only, aims)
    return targets[0, 0], coefficients[0, 0]
