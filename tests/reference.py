"""A slow mirror of the game in float64 NumPy and plain Python, for tests to compare with.

It follows docs/rules.md and docs/controller.md: clarity first, speed never. Grids are indexed [row = y, column = x],
coefficients [k1 (x), k2 (y)], and teams are 0 (red) and 1 (blue).
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Booleans = NDArray[np.bool_]

GRID = 50
TICKS_PER_SECOND = 30
RING = [(dy, dx) for dy in range(-2, 3) for dx in range(-2, 3) if max(abs(dy), abs(dx)) == 2]


# ---------------------------------------------------------------------------------------------------------------------
# The rules
# ---------------------------------------------------------------------------------------------------------------------


def cell_of(position: NDArray[np.float32]) -> tuple[int, int]:
    """Return row (from y) and column (from x) of the cell of a position (2,): min(int(50 p), 49), p in float32."""
    # A float32 has 24 significant bits and 50 has 6, so a float64 holds their product without rounding.
    x = float(np.float32(position[0]))
    y = float(np.float32(position[1]))
    return min(int(GRID * y), GRID - 1), min(int(GRID * x), GRID - 1)


def ring_sums(occupancy: Integers) -> tuple[Integers, Integers]:
    """Return sum S and number n, both (50, 50), of the ring cells around every cell.

    The ring is the 16 outer cells of the 5x5 sub-grid centred on the cell; only those inside the square count.
    """
    framed = np.zeros((GRID + 4, GRID + 4), dtype=np.int64)
    inside = np.zeros((GRID + 4, GRID + 4), dtype=np.int64)
    framed[2 : 2 + GRID, 2 : 2 + GRID] = occupancy
    inside[2 : 2 + GRID, 2 : 2 + GRID] = 1
    sums = np.zeros((GRID, GRID), dtype=np.int64)
    counts = np.zeros((GRID, GRID), dtype=np.int64)
    for dy, dx in RING:
        sums += framed[2 + dy : 2 + dy + GRID, 2 + dx : 2 + dx + GRID]
        counts += inside[2 + dy : 2 + dy + GRID, 2 + dx : 2 + dx + GRID]
    return sums, counts


def captures_where(occupancy: Integers, threshold: float = 0.75) -> Booleans:
    """Return the cells (50, 50) where a team with this occupancy captures an opposing drone.

    S / n > threshold * S_max / n_max, decided in exact fractions. An empty field captures nowhere.
    """
    sums, counts = ring_sums(occupancy)
    distinct_counts = [int(count) for count in np.unique(counts)]
    maximum = max(Fraction(int(sums[counts == count].max()), count) for count in distinct_counts)
    captures = np.zeros((GRID, GRID), dtype=np.bool_)
    for count in distinct_counts:
        bound = Fraction(threshold) * maximum * count
        # S is an integer: it exceeds the bound exactly where it exceeds the bound's floor.
        captures |= (counts == count) & (sums > math.floor(bound))
    # A negative threshold would let 0 > bound; the rule for an empty field stands on its own.
    if maximum == 0:
        captures[:] = False
    return captures


class RuleReference:
    """Trails, occupancy, fields and captures of one game; positions are given.

    `teams` (N,) is 0 or 1 for every drone, `trails` are deques of (row, column), oldest first, `captures` the drones
    that each team has captured, and `recaptures` those that it got back within one second of losing them.
    """

    def __init__(self, teams: NDArray[np.integer], threshold: float = 0.75) -> None:
        self.teams: Integers = np.array(teams, dtype=np.int64)
        self.threshold = threshold
        self.trails: list[deque[tuple[int, int] | None]] = [deque(maxlen=150) for _ in self.teams]
        self.captures = [0, 0]
        self.recaptures = [0, 0]
        self.ticks = 0
        self._last_capture: list[int | None] = [None] * len(self.teams)

    @property
    def occupancy(self) -> Integers:
        """The teams' trails summed on the grid, (2, 50, 50), counted afresh."""
        counts = np.zeros((2, GRID, GRID), dtype=np.int64)
        for team, trail in zip(self.teams, self.trails, strict=True):
            cells = [cell for cell in trail if cell is not None]
            if cells:
                np.add.at(counts[team], tuple(np.transpose(cells)), 1)
        return counts

    def tick(self, positions: NDArray[np.float32], failed: Booleans | None = None) -> list[int]:
        """Extend the trails by positions (N, 2) after a move, apply all captures at once, and return them.

        `failed` drones (N,) write no trail.
        """
        self.ticks += 1
        cells = [cell_of(position) for position in positions]
        for drone, cell in enumerate(cells):
            self.trails[drone].append(None if failed is not None and failed[drone] else cell)
        captures = [captures_where(occupancy, self.threshold) for occupancy in self.occupancy]
        captured = [drone for drone, cell in enumerate(cells) if captures[1 - self.teams[drone]][cell]]
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
    result = np.array(accelerations, dtype=np.float64)
    for drone in range(len(result)):
        length = math.hypot(result[drone, 0], result[drone, 1])
        if length > limit:
            result[drone] *= limit / length
    return result


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
    new_positions = np.array(positions, dtype=np.float64)
    new_velocities = np.array(velocities, dtype=np.float64)
    for drone in range(len(new_positions)):
        new = [new_velocities[drone, axis] + float(accelerations[drone, axis]) * dt for axis in (0, 1)]
        if math.hypot(*new) < min_speed:
            heading = new if math.hypot(*new) > 1e-6 else [0.5 - new_positions[drone, axis] for axis in (0, 1)]
            new = [min_speed * part / math.hypot(*heading) for part in heading]
        for axis in (0, 1):
            velocity, at_wall = new[axis], 0.0 if min_speed == 0.0 else -new[axis]
            position = new_positions[drone, axis] + speed_factor * velocity * dt
            if position < 0.0:
                position, velocity = 0.0, at_wall
            elif position > 1.0:
                position, velocity = 1.0, at_wall
            new_positions[drone, axis] = position
            new_velocities[drone, axis] = velocity
    return new_positions, new_velocities


# ---------------------------------------------------------------------------------------------------------------------
# The controller
# ---------------------------------------------------------------------------------------------------------------------


def basis(position: NDArray[np.floating], modes: int = 10) -> Floats:
    """Return F_k = cos(pi k1 x) cos(pi k2 y), (modes, modes), at one point."""
    x, y = float(position[0]), float(position[1])
    k = np.arange(modes)
    return np.outer(np.cos(np.pi * k * x), np.cos(np.pi * k * y))


def basis_gradient(position: NDArray[np.floating], modes: int = 10) -> Floats:
    """Return the derivatives (modes, modes, 2) of every F_k by x and by y at one point."""
    x, y = float(position[0]), float(position[1])
    k = np.arange(modes)
    by_x = np.outer(-np.pi * k * np.sin(np.pi * k * x), np.cos(np.pi * k * y))
    by_y = np.outer(np.cos(np.pi * k * x), -np.pi * k * np.sin(np.pi * k * y))
    return np.stack([by_x, by_y], axis=-1)


def sobolev_weights(modes: int = 10) -> Floats:
    """Lambda_k = (1 + |k|^2)^(-3/2), a (modes, modes) float64 array."""
    weights = np.zeros((modes, modes))
    for k1 in range(modes):
        for k2 in range(modes):
            weights[k1, k2] = (1.0 + k1 * k1 + k2 * k2) ** -1.5
    return weights


def exponential_weights(modes: int = 10) -> Floats:
    """Lambda_k = exp(-0.8 |k|), a (modes, modes) float64 array."""
    weights = np.zeros((modes, modes))
    for k1 in range(modes):
        for k2 in range(modes):
            weights[k1, k2] = math.exp(-0.8 * math.hypot(k1, k2))
    return weights


def wall_gradient(position: NDArray[np.floating], weight: float = 100.0, margin: float = 0.05) -> Floats:
    """Gradient (2,) at one (2,) position of weight * (distance beyond [margin, 1 - margin])^2, summed over axes."""
    gradient = np.zeros(2)
    for axis in (0, 1):
        coordinate = float(position[axis])
        if coordinate < margin:
            gradient[axis] = 2.0 * weight * (coordinate - margin)
        elif coordinate > 1.0 - margin:
            gradient[axis] = 2.0 * weight * (coordinate - (1.0 - margin))
    return gradient


def target_coefficients(command: NDArray[np.floating], modes: int = 10, mass: float = 1.0) -> Floats:
    """Return the Fourier coefficients phi_k (modes, modes) of a command (A, A), by quadrature.

    The density is the bilinear interpolation of the command's values, which sit at the cell centres (j + 0.5) / A;
    it is constant beyond the outer centres, and scaled to integrate to `mass`. A command of zeros means uniform.
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
    weights = np.concatenate([0.5 * half_cell * node_weights for _ in range(2 * cells)])

    # np.interp holds the end values outside its range, as wanted beyond the outer centres.
    along_rows = np.array([np.interp(points, centres, row) for row in values])  # (A, points x)
    density = np.array([np.interp(points, centres, column) for column in along_rows.T]).T  # (points y, points x)
    density *= mass / (weights @ density @ weights)

    phi = np.zeros((modes, modes))
    for k1 in range(modes):
        for k2 in range(modes):
            cosine_x = np.cos(np.pi * k1 * points)
            cosine_y = np.cos(np.pi * k2 * points)
            phi[k1, k2] = (weights * cosine_y) @ density @ (weights * cosine_x)
    return phi


def ergodic_metric(coefficients_mean: Floats, phi: Floats) -> float:
    """Sum over k of Lambda_k (cbar_k - phi_k)^2, for two (K, K) arrays."""
    difference = np.asarray(coefficients_mean, dtype=np.float64) - np.asarray(phi, dtype=np.float64)
    return float(np.sum(sobolev_weights(len(difference)) * difference**2))


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

    def __post_init__(self) -> None:
        self.weights = {"sobolev": sobolev_weights, "exponential": exponential_weights}[self.spectrum](self.modes)

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

        Parameters
        ----------
        positions, velocities : (N, 2) arrays
        teams : (N,) int array
        memory, memory_weight : (N, K, K) and (N,) arrays
            Decayed sums of F_k over each drone's past, and decayed numbers of the points in them.
        targets : (2, K, K) array
            phi_k of each team.
        heard : (N, N) bool array, optional
            Whether i hears its team-mate j, `heard[i, j]`; all if not given. A drone always hears itself.
        failed : (N,) bool array, optional
            Drones that neither steer nor talk, and whose memory is empty; none if not given.

        Returns
        -------
        accelerations, memory, memory_weight
            Accelerations (N, 2) are not saturated.
        """
        drones = len(positions)
        starts = np.array(positions, dtype=np.float64)
        speeds = np.array(velocities, dtype=np.float64)
        phi = np.array(targets, dtype=np.float64)
        heard = np.ones((drones, drones), dtype=np.bool_) if heard is None else heard
        failed = np.zeros(drones, dtype=np.bool_) if failed is None else failed

        # 1. Memory, 2. rollout and 3. coefficients.
        sums, weights = self.remember(starts, memory, memory_weight, failed)
        rollouts = self.look_ahead(starts, speeds)
        coefficients = self.coefficients(rollouts, sums, weights)

        # 4. Share, then 5. and 6. for every drone of the team.
        accelerations = np.zeros((drones, 2))
        for team in (0, 1):
            members = [i for i in range(drones) if teams[i] == team and not failed[i]]
            for i in members:
                known = [j for j in members if j == i or heard[i, j]]
                shared = sum(coefficients[j] for j in known) / len(known)
                accelerations[i] = self.controls(rollouts[i], shared - phi[team])[0]
        return accelerations, sums, weights

    def remember(
        self,
        positions: NDArray[np.floating],
        memory: NDArray[np.floating],
        memory_weight: NDArray[np.floating],
        failed: Booleans,
    ) -> tuple[Floats, Floats]:
        """Step 1: the (N, K, K) sums and (N,) weights, decayed, with the present added; 0 for failed drones."""
        decay = 1.0 if self.tau is None else math.exp(-self.period / self.tau)
        sums: Floats = np.array(memory, dtype=np.float64)
        weights: Floats = np.array(memory_weight, dtype=np.float64)
        for i in range(len(positions)):
            sums[i] = 0.0 if failed[i] else decay * sums[i] + basis(positions[i], self.modes)
            weights[i] = 0.0 if failed[i] else decay * weights[i] + 1.0
        return sums, weights

    def look_ahead(self, positions: NDArray[np.floating], velocities: NDArray[np.floating]) -> Floats:
        """Step 2: the (N, H, 2) rollouts; [i, h - 1] is drone i's point at h. It may leave the square."""
        rollouts = np.zeros((len(positions), self.horizon, 2))
        for i in range(len(positions)):
            for h in range(1, self.horizon + 1):
                rollouts[i, h - 1] = positions[i] + h * self.period * self.speed_factor * velocities[i]
        return rollouts

    def coefficients(self, rollouts: Floats, sums: Floats, weights: Floats) -> Floats:
        """Step 3: the (N, K, K) coefficients c of every drone over its memory and its rollout."""
        coefficients = np.zeros_like(sums)
        for i in range(len(rollouts)):
            ahead = np.zeros((self.modes, self.modes))
            for point in rollouts[i]:
                ahead += basis(point, self.modes)
            coefficients[i] = (sums[i] + ahead) / (weights[i] + self.horizon)
        return coefficients

    def controls(self, rollout: Floats, difference: Floats) -> Floats:
        """Costate backwards along one (H, 2) rollout for one (K, K) cbar - phi; the (H, 2) controls at its points."""
        zero, one = np.zeros((2, 2)), np.eye(2)
        a = np.block([[zero, self.speed_factor * one], [zero, zero]])
        b = np.block([[zero], [one]])
        weighted = self.weights * difference
        rho, controls = np.zeros(4), np.zeros((self.horizon, 2))
        for h in range(self.horizon, 0, -1):
            point = rollout[h - 1]
            gradients = basis_gradient(point, self.modes)
            g = np.zeros(4)
            for axis in (0, 1):
                g[axis] = self.q * np.sum(weighted * gradients[:, :, axis])
            g[:2] += wall_gradient(point, self.wall_weight, self.wall_margin)
            rho = rho + self.period * (g + a.T @ rho)
            controls[h - 1] = -(b.T @ rho) / self.r
        return controls


# --- capture fields of the preset released ----------------------------------------


def reconstruct(coefficients: NDArray[np.floating]) -> Floats:
    """Return sum_k c_k cos(pi k1 x) cos(pi k2 y) at the centres of the grid's cells, (50, 50)."""
    matrix = np.asarray(coefficients, dtype=np.float64)
    centres = (np.arange(GRID) + 0.5) / GRID
    waves = [np.cos(np.pi * k * centres) for k in range(max(matrix.shape))]
    total = np.zeros((GRID, GRID))
    for k1 in range(matrix.shape[0]):
        for k2 in range(matrix.shape[1]):
            total += matrix[k1, k2] * np.outer(waves[k2], waves[k1])
    return total


def ring_means(values: Floats) -> Floats:
    """Mean of (50, 50) values over the ring cells around every cell that lie inside the square."""
    framed = np.full((GRID + 4, GRID + 4), np.nan)
    framed[2 : 2 + GRID, 2 : 2 + GRID] = values
    neighbours = [framed[2 + dy : 2 + dy + GRID, 2 + dx : 2 + dx + GRID] for dy, dx in RING]
    return np.asarray(np.nanmean(neighbours, axis=0))


def reconstruction_field(coefficients: NDArray[np.floating]) -> Floats:
    """Return the capture field (50, 50) of a team with these mean coefficients (K, K).

    Ring means of the reconstruction, rescaled to [0, 1]; all 0 if they are constant up to rounding.
    """
    means = ring_means(reconstruct(coefficients))
    low, high = means.min(), means.max()
    if high - low <= 1e-12 * max(abs(low), abs(high)):
        return np.zeros_like(means)
    return np.asarray((means - low) / (high - low))


def reconstruction_captures(field: Floats, threshold: float = 0.75) -> Booleans:
    """Cells of a (50, 50) reconstruction field where it captures: at the threshold or above."""
    return np.asarray(field >= threshold)
