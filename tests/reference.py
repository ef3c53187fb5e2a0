"""A slow mirror of the game in float64 NumPy and plain Python, for tests to compare with.

It follows docs/rules.md and docs/controller.md: clarity first, speed never. Grids are indexed [row = y, column = x],
coefficients [k1 (x), k2 (y)], and teams are 0 (red) and 1 (blue).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]

GRID = 50
CENTRES = (np.arange(GRID) + 0.5) / GRID
TICKS_PER_SECOND = 30
TRAIL_TICKS = 150
RING = [(dy, dx) for dy in range(-2, 3) for dx in range(-2, 3) if max(abs(dy), abs(dx)) == 2]


# ---------------------------------------------------------------------------------------------------------------------
# The rules
# ---------------------------------------------------------------------------------------------------------------------


def cell_of(positions: NDArray[np.float32]) -> tuple[Integers, Integers]:
    """Return rows (from y) and columns (from x) of the cells of positions (..., 2): min(int(50 p), 49), float32."""
    # A float32 has 24 significant bits and 50 has 6, so a float64 holds their product without rounding.
    exact = np.asarray(positions, np.float32).astype(np.float64)
    cells = np.minimum((GRID * exact).astype(np.int64), GRID - 1)
    return cells[..., 1], cells[..., 0]


def on_ring(values: NDArray[np.number], beyond: float) -> NDArray[np.number]:
    """Return the values (16, 50, 50) of the ring cells around every cell; `beyond` stands for cells outside the square.

    The ring is the 16 outer cells of the 5x5 sub-grid centred on the cell.
    """
    framed = np.pad(values, 2, constant_values=beyond)
    return np.array([framed[2 + dy : 2 + dy + GRID, 2 + dx : 2 + dx + GRID] for dy, dx in RING])


def ring_sums(occupancy: Integers) -> tuple[Integers, Integers]:
    """Return sum S and number n, both (50, 50), of the ring cells around every cell that lie inside the square."""
    return on_ring(occupancy, 0).sum(axis=0), on_ring(np.ones_like(occupancy), 0).sum(axis=0)


def captures_where(occupancy: Integers, threshold: float = 0.75) -> Booleans:
    """Return the cells (50, 50) where a team with this occupancy captures an opposing drone.

    S / n > threshold * S_max / n_max, decided in exact fractions. An empty field captures nowhere.
    """
    sums, counts = ring_sums(occupancy)
    captures = np.zeros((GRID, GRID), dtype=np.bool_)
    numbers = np.unique(counts).tolist()
    maximum = max(Fraction(int(sums[counts == count].max()), count) for count in numbers)
    for count in numbers:
        # S is an integer: it exceeds the bound exactly where it exceeds the bound's floor.
        captures |= (counts == count) & (sums > math.floor(Fraction(threshold) * maximum * count))
    return captures


class RuleReference:
    """Trails, occupancy, fields and captures of one game; positions are given.

    `teams` (N,) is 0 or 1 for every drone, `trails` (150, N) the numbers 50 row + column of their last cells, -1 for
    none, `captures` the drones that each team has captured, and `recaptures` those that it got back within one second
    of losing them.
    """

    def __init__(self, teams: NDArray[np.integer], threshold: float = 0.75) -> None:
        self.teams: Integers = np.array(teams, dtype=np.int64)
        self.threshold = threshold
        self.trails: Integers = np.full((TRAIL_TICKS, len(teams)), -1)
        self.captures = [0, 0]
        self.recaptures = [0, 0]
        self.ticks = 0
        self._last_capture: list[int | None] = [None] * len(self.teams)

    @property
    def occupancy(self) -> Integers:
        """The teams' trails summed on the grid, (2, 50, 50), counted afresh."""
        of_teams = [self.trails[:, self.teams == team] for team in (0, 1)]
        return np.array([np.bincount(t[t >= 0], minlength=GRID**2).reshape(GRID, GRID) for t in of_teams])

    def tick(self, positions: NDArray[np.float32], failed: Booleans | None = None) -> list[int]:
        """Extend the trails by positions (N, 2) after a move, apply all captures at once, and return them.

        `failed` drones (N,) write no trail.
        """
        self.ticks += 1
        rows, columns = cell_of(positions)
        written = GRID * rows + columns if failed is None else np.where(failed, -1, GRID * rows + columns)
        self.trails = np.concatenate([self.trails[1:], written[None]])
        captures = np.array([captures_where(occupancy, self.threshold) for occupancy in self.occupancy])
        captured: list[int] = np.flatnonzero(captures[1 - self.teams, rows, columns]).tolist()
        for drone in captured:
            self._change_team(drone)
        return captured

    def _change_team(self, drone: int) -> None:
        new = 1 - int(self.teams[drone])
        self.teams[drone] = new  # its trail comes along: occupancy is counted afresh
        self.captures[new] += 1
        last = self._last_capture[drone]
        # With two teams, a drone's next capture always returns it to the team that lost it last.
        if last is not None and self.ticks - last <= TICKS_PER_SECOND:
            self.recaptures[new] += 1
        self._last_capture[drone] = self.ticks


# ---------------------------------------------------------------------------------------------------------------------
# The motion
# ---------------------------------------------------------------------------------------------------------------------


def saturate(accelerations: NDArray[np.floating], limit: float = 1.0) -> Floats:
    """Scale every vector (N, 2) that is longer than the limit down to it, keeping its direction; return a copy."""
    vectors = np.array(accelerations, dtype=np.float64)
    lengths = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.where(lengths > limit, vectors * limit / np.maximum(lengths, limit), vectors)


def move(
    positions: NDArray[np.floating],
    velocities: NDArray[np.floating],
    accelerations: NDArray[np.floating],
    dt: float = 1 / 30,
    speed_factor: float = 1.0,
    min_speed: float = 0.0,
) -> tuple[Floats, Floats]:
    """One tick of semi-implicit Euler: v' = v + u dt, then p' = p + g v' dt, then the walls; g is the speed factor.

    A position that would leave the unit interval stops at its end, and that component of the velocity becomes 0.

    With a least airspeed, a shorter v' is lengthened to it (from rest: towards the middle), and a wall reverses that
    component of the velocity.
    """
    old, new = np.asarray(positions, np.float64), np.asarray(velocities, np.float64) + np.float64(accelerations) * dt
    for drone in np.flatnonzero(np.linalg.norm(new, axis=1) < min_speed):
        heading = new[drone] if np.linalg.norm(new[drone]) > 1e-6 else 0.5 - old[drone]
        new[drone] = min_speed * heading / np.linalg.norm(heading)
    reached = old + speed_factor * new * dt
    at_wall = np.zeros_like(new) if min_speed == 0.0 else -new
    return np.clip(reached, 0.0, 1.0), np.where((reached < 0.0) | (reached > 1.0), at_wall, new)


# ---------------------------------------------------------------------------------------------------------------------
# The controller
# ---------------------------------------------------------------------------------------------------------------------


def basis(places: ArrayLike, modes: int = 10) -> Floats:
    """Return F_k = cos(pi k1 x) cos(pi k2 y), (..., modes, modes), at places (..., 2)."""
    x, y = np.moveaxis(np.pi * np.asarray(places, np.float64)[..., None] * np.arange(modes), -2, 0)
    return np.cos(x)[..., :, None] * np.cos(y)[..., None, :]


def basis_gradient(places: ArrayLike, modes: int = 10) -> Floats:
    """Return the derivatives (..., modes, modes, 2) of every F_k by x and by y at places (..., 2)."""
    k = np.arange(modes)
    x, y = np.moveaxis(np.pi * np.asarray(places, np.float64)[..., None] * k, -2, 0)
    by_x = (-np.pi * k * np.sin(x))[..., :, None] * np.cos(y)[..., None, :]
    by_y = np.cos(x)[..., :, None] * (-np.pi * k * np.sin(y))[..., None, :]
    return np.stack([by_x, by_y], axis=-1)


def sobolev_weights(modes: int = 10) -> Floats:
    """Lambda_k = (1 + |k|^2)^(-3/2), a (modes, modes) float64 array."""
    k1, k2 = np.indices((modes, modes))
    return np.asarray((1.0 + k1**2 + k2**2) ** -1.5)


def exponential_weights(modes: int = 10) -> Floats:
    """Lambda_k = exp(-0.8 |k|), a (modes, modes) float64 array."""
    return np.asarray(np.exp(-0.8 * np.hypot(*np.indices((modes, modes)))))


def wall_gradient(places: Floats, weight: float = 100.0, margin: float = 0.05) -> Floats:
    """Gradient (..., 2) at places (..., 2) of weight * (distance beyond [margin, 1 - margin])^2, summed over axes."""
    return 2.0 * weight * (places - np.clip(places, margin, 1.0 - margin))


def target_coefficients(command: NDArray[np.floating], modes: int = 10) -> Floats:
    """Return the Fourier coefficients phi_k (modes, modes) of a command (A, A), by quadrature.

    The density is the bilinear interpolation of the command's values, which sit at the cell centres (j + 0.5) / A;
    it is constant beyond the outer centres, and scaled to integrate to 1. A command of zeros means uniform.
    """
    values = np.array(command, dtype=np.float64)
    if not values.any():
        values[:] = 1.0
    cells = len(values)
    centres = (np.arange(cells) + 0.5) / cells

    # The density has kinks only at cell centres. It is smooth on half a cell, so Gauss-Legendre is nearly exact.
    nodes, node_weights = np.polynomial.legendre.leggauss(24)
    half_cell = 0.5 / cells
    points = np.concatenate([half_cell * (j + 0.5 + 0.5 * nodes) for j in range(2 * cells)])
    weights = np.tile(0.5 * half_cell * node_weights, 2 * cells)

    # np.interp holds the end values outside its range, as wanted beyond the outer centres.
    along_rows = np.array([np.interp(points, centres, row) for row in values])  # (A, points x)
    density = np.array([np.interp(points, centres, column) for column in along_rows.T]).T  # (points y, points x)
    density /= weights @ density @ weights
    cosines = weights * np.cos(np.pi * np.outer(np.arange(modes), points))
    return np.asarray(cosines @ density.T @ cosines.T)


def ergodic_metric(coefficients_mean: Floats, phi: Floats) -> float:
    """Sum over k of Lambda_k (cbar_k - phi_k)^2, for two (K, K) arrays."""
    return float(np.sum(sobolev_weights(len(phi)) * (coefficients_mean - phi.astype(np.float64)) ** 2))


@dataclass
class ControllerReference:
    """The ergodic controller of one game, in float64."""

    modes: int = 10
    horizon: int = 10
    tau: float | None = 4.0
    """Time constant of the memory, in seconds; None remembers for ever."""
    q: float = 200.0
    r: float = 0.1
    wall_weight: float = 100.0
    wall_margin: float = 0.05
    period: float = 0.1
    speed_factor: float = 1.0
    """The factor g of p' = g v, which the controller's model knows."""
    spectrum: str = "sobolev"

    def solve(
        self,
        positions: NDArray[np.floating],
        velocities: NDArray[np.floating],
        teams: NDArray[np.integer],
        memory: NDArray[np.floating],
        memory_weight: NDArray[np.floating],
        targets: NDArray[np.floating],
        heard: Booleans | None = None,
        failed: Booleans | None = None,
    ) -> tuple[Floats, Floats, Floats]:
        """One solve for every drone; the inputs stay as they are.

        `positions` and `velocities` are (N, 2), `teams` (N,), and `targets` (2, K, K) phi_k of each team. `memory`
        (N, K, K) has decayed sums of F_k over each drone's past, `memory_weight` (N,) the decayed numbers of the points
        in them. `heard` (N, N) says whether drone i hears its team-mate j, `[i, j]`; it hears all if not given, and
        always itself. `failed` (N,) drones, none if not given, neither steer nor talk, and their memory is empty.
        Returns accelerations (N, 2), not saturated, and the new memory and weights.
        """
        places, speeds = np.asarray(positions, np.float64), np.asarray(velocities, np.float64)
        works = np.ones(len(places), np.bool_) if failed is None else ~failed

        # 1. Memory: it decays, and the present is added.
        decay = 1.0 if self.tau is None else math.exp(-self.period / self.tau)
        sums = works[:, None, None] * (decay * memory.astype(np.float64) + basis(places, self.modes))
        weights = works * (decay * memory_weight.astype(np.float64) + 1.0)

        # 2. Look-ahead: the drone coasts, even out of the square; (N, H, 2). 3. Coefficients over both.
        times = self.period * np.arange(1, self.horizon + 1)
        rollouts = places[:, None] + self.speed_factor * times[:, None] * speeds[:, None]
        coefficients = sums + basis(rollouts, self.modes).sum(axis=1)
        coefficients /= (weights + self.horizon)[:, None, None]

        # 4. Share: the mean over those that the drone hears.
        known = np.equal.outer(teams, teams) & works
        if heard is not None:
            known &= heard | np.eye(len(places), dtype=np.bool_)
        shared = np.einsum("ij,jkl->ikl", known, coefficients) / np.maximum(known.sum(axis=1), 1)[:, None, None]

        # 5. Costate, backwards along the look-ahead. 6. Control, at its first point.
        zero, one = np.zeros((2, 2)), np.eye(2)
        a = np.block([[zero, self.speed_factor * one], [zero, zero]])
        b = np.block([[zero], [one]])
        spectrum = {"sobolev": sobolev_weights, "exponential": exponential_weights}[self.spectrum](self.modes)
        weighted = spectrum * (shared - np.asarray(targets, np.float64)[teams])
        rho = np.zeros((len(places), 4))
        for points in reversed(rollouts.swapaxes(0, 1)):
            g = np.zeros((len(places), 4))
            g[:, :2] = self.q * np.einsum("nkl,nklx->nx", weighted, basis_gradient(points, self.modes))
            g[:, :2] += wall_gradient(points, self.wall_weight, self.wall_margin)
            rho = rho + self.period * (g + rho @ a)
        return works[:, None] * -(rho @ b) / self.r, sums, weights


# --- capture fields of the preset released ----------------------------------------


def reconstruction_field(coefficients: NDArray[np.floating]) -> Floats:
    """Return the capture field (50, 50) of a team with these mean coefficients (K, K).

    The reconstruction is sum_k c_k cos(pi k1 x) cos(pi k2 y) at the cells' centres. The field has its means over the
    ring cells inside the square, rescaled to [0, 1]; all 0 if they are constant up to rounding.
    """
    waves = np.cos(np.pi * np.outer(CENTRES, np.arange(len(coefficients))))
    means = np.nanmean(on_ring(waves @ np.asarray(coefficients, np.float64).T @ waves.T, np.nan), axis=0)
    low, high = means.min(), means.max()
    if high - low <= 1e-12 * max(abs(low), abs(high)):
        return np.zeros_like(means)
    return np.asarray((means - low) / (high - low))
