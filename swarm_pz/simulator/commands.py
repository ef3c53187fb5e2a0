"""From command to target: a coarse density image becomes a density on the square.

A command's values stand at the centres of its cells; between them the density is their bilinear
interpolation, constant beyond the outer centres, normalised to integrate to 1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import FlockingConfig
from swarm_pz.config.values import describe
from swarm_pz.errors import CommandError
from swarm_pz.kernels.fourier import make_targets


@dataclass(frozen=True, kw_only=True)
class FlockingCommand:
    """A command to a team that flocks: everybody to one place.

    Attributes
    ----------
    position : (float, float)
        The attractor x, y, in map widths.
    weight : float
        How strongly it draws, within the range of `FlockingConfig.migration`.
    """

    position: tuple[float, float]
    weight: float


def check_attractors(commands: Sequence[FlockingCommand], count: int, config: FlockingConfig) -> NDArray[np.float32]:
    """Return flocking commands as an array (count, 3) of x, y and weight.

    Raises
    ------
    CommandError
        If there are not so many, or one names a place outside the square or a weight out of range.
    """
    if len(commands) != count or not all(isinstance(command, FlockingCommand) for command in commands):
        raise CommandError(f"expected a FlockingCommand for each of {count} games, got {describe(commands)}")
    least, largest = config.migration
    for command in commands:
        try:
            x, y, weight = map(float, (*command.position, command.weight))
        except (TypeError, ValueError, OverflowError) as error:
            raise CommandError(f"a FlockingCommand has a position (x, y) and a weight, got {command!r}") from error
        fits = 0.0 <= x <= 1.0 and 0.0 <= y <= 1.0 and math.isfinite(weight) and least <= weight <= largest
        if not fits:
            raise CommandError(
                f"a FlockingCommand's position must lie in [0, 1] x [0, 1] and its weight in [{least:g}, {largest:g}], "
                f"got {command!r}"
            )
    return np.array([(*command.position, command.weight) for command in commands], np.float32)


def density_around(attractors: NDArray[np.float32], cells: int) -> NDArray[np.float64]:
    """Return densities (n, cells, cells) whose mass lies in the cells nearest to attractors (n, 3)."""
    hats = [_hats(np.clip(attractors[:, axis] * cells - 0.5, 0.0, cells - 1.0), cells) for axis in range(2)]
    return np.asarray(hats[1][:, :, None] * hats[0][:, None, :])


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
    only = np.zeros(1, np.int64)
    matrix = coefficient_matrix(modes, density.shape[-1])
    make_targets(
        np.ascontiguousarray(density)[None, None], only, only, only, matrix, 1.0, False, targets, coefficients, None
    )
    return targets[0, 0], coefficients[0, 0]
