"""The controller's coefficients, in plain float64 NumPy: coverage, target, potential. After Mathew & Mezic (2011).

The basis is F_k(x, y) = cos(pi k1 x) cos(pi k2 y), without normalisation; coefficients are `[k1 (x), k2 (y)]`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import CONTROL_PERIOD, TEAM_NAMES
from swarm_pz.errors import CommandError
from swarm_pz.simulator import Simulator


def basis(places: ArrayLike, modes: int) -> NDArray[np.float64]:
    """Return F_k (..., K, K) at places (..., 2) in map widths."""
    cosines = np.cos(np.pi * np.asarray(places, np.float64)[..., None] * np.arange(modes))
    return np.asarray(cosines[..., 0, :, None] * cosines[..., 1, None, :])


def at_work(simulator: Simulator, row: int, team: int) -> NDArray[np.int64]:
    """Return the numbers of a team's drones that have not failed."""
    games = simulator.games
    return np.flatnonzero((games.teams[row] == team) & ~games.failed[row])


def shared_coefficients(simulator: Simulator, row: int, team: int) -> NDArray[np.float64]:
    """Return the coverage cbar_k (K, K) of a team if it solved now: steps 1 to 4 of the controller; cbar_0 = 1.

    Each drone has c_k = (m_k + sum_h F_k(x_h)) / (w + H), from its memory (decayed once and extended by the present)
    and its look-ahead. cbar is the mean over the team's drones at work, even if they do not hear each other.

    Raises
    ------
    CommandError
        If the team has no drones at work.
    """
    games, controller = simulator.games, simulator.controller
    members = at_work(simulator, row, team)
    if not len(members):
        raise CommandError(f"team {team} of game {row} must have drones at work to have coefficients, but it has none")
    modes, times = len(controller.modes), np.asarray(controller.times, np.float64)
    places = games.positions[row, members].astype(np.float64)
    decay = float(controller.decay)
    past = decay * games.memory[row][:, :, members].transpose(2, 0, 1).astype(np.float64) + basis(places, modes)
    weight = decay * games.memory_weight[row, members].astype(np.float64) + 1.0
    ahead = places[:, None] + times[1:, None] * games.velocities[row, members, None]
    if controller.warm_start:
        speeds = CONTROL_PERIOD * games.plans[row, members, 1:].astype(np.float64).cumsum(axis=1)
        ahead[:, 1:] += times[1] * speeds.cumsum(axis=1)
    expected = past + basis(ahead, modes).sum(axis=1)
    return np.asarray((expected / (weight + len(times) - 1)[:, None, None]).mean(axis=0))


def reconstruct(coefficients: ArrayLike, cells: int, *, smooth: bool = False) -> NDArray[np.float64]:
    """Return the density that has these coefficients, as far as the modes determine it.

    A density p has the coefficients c_k = integral of p F_k, so that p = sum_k c_k F_k / h_k^2 with
    h_k^2 = integral of F_k^2: 1 for k = (0, 0), 1/2 where one of k1 and k2 is 0, 1/4 elsewhere. Where
    c_0 = 1, the image has mean 1 (up to its cells): 2 is twice the density of uniform coverage. A
    target and a team's coverage, drawn this way, can be compared cell by cell.

    Parameters
    ----------
    coefficients : array_like (K, K)
    cells : int
        Cells a side of the image.
    smooth : bool
        Weigh the modes by (1 - k1/K)(1 - k2/K). These Fejer means are p smoothed by a window about 1/K
        wide that is nowhere negative: no ripples, less detail.

    Returns
    -------
    float64 array (cells, cells)
        At the centres of the cells, `[row = y, column = x]`.
    """
    known = np.asarray(coefficients, np.float64)
    k = np.arange(len(known))
    factors = np.where(k == 0, 1.0, 2.0)
    if smooth:
        factors = factors * (1.0 - k / len(known))
    cosines = np.cos(np.pi * np.outer(k, _centres(cells)))
    return _sum_up(known * np.outer(factors, factors), cosines, cosines)


def potential(simulator: Simulator, row: int, team: int, cells: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the potential that a team's drones descend, and its gradient.

    sum_k q Lambda_k (cbar_k - phi_k) F_k with `shared_coefficients` for cbar: high where the team
    has spent more time than its target asks. The wall cost is left out.

    Parameters
    ----------
    simulator : Simulator
    row, team : int
    cells : int
        Cells a side.

    Returns
    -------
    values : float64 array (cells, cells)
        At the centres of the cells, `[row = y, column = x]`.
    gradient : float64 array (cells, cells, 2)
        Its derivatives by x and y, per map width.

    Raises
    ------
    CommandError
        If the team has no drones at work, or another controller flies it.
    """
    if (flies := simulator.controller_of(row, team)) != "ergodic":
        raise CommandError(f"the potential is the ergodic controller's, and {TEAM_NAMES[team]} is flown by {flies}")
    difference = shared_coefficients(simulator, row, team) - simulator.games.coefficients[row, team]
    error = simulator.controller.spectrum.astype(np.float64) * difference
    k = np.arange(len(error))
    phases = np.pi * np.outer(k, _centres(cells))
    cosines, slopes = np.asarray(np.cos(phases)), np.asarray(-np.pi * k[:, None] * np.sin(phases), np.float64)
    by_x, by_y = _sum_up(error, slopes, cosines), _sum_up(error, cosines, slopes)
    return _sum_up(error, cosines, cosines), np.stack([by_x, by_y], axis=-1)


def _centres(cells: int) -> NDArray[np.float64]:
    return (np.arange(cells) + 0.5) / cells


def _sum_up(
    coefficients: NDArray[np.float64], along_x: NDArray[np.float64], along_y: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Sum coefficients (K, K) times functions (K, cells) of x and of y: an image (cells, cells)."""
    return np.asarray(along_y.T @ coefficients.T @ along_x)
