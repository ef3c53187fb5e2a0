"""The slow mirror of whole games by the preset `released`: who knows what, who flies where, who is captured.

Float64 NumPy and plain Python like `tests.reference`, and in its words and orders of axes. It plays along with a game:
it gets what is sent and where the drones are, and keeps targets, memories, trails and fields of its own.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.reference import (
    GRID,
    RING,
    Booleans,
    ControllerReference,
    Floats,
    RuleReference,
    cell_of,
    target_coefficients,
)

TARGET_MASS = 10.0
"""Sum of a density that was sent; the uniform one of the start sums to 1."""


def reconstruct(coefficients: NDArray[np.floating]) -> Floats:
    """Return sum_k c_k cos(pi k1 x) cos(pi k2 y) at the centres of the grid's cells, (50, 50)."""
    given = np.asarray(coefficients, dtype=np.float64)
    centres = (np.arange(GRID) + 0.5) / GRID
    waves = [np.cos(np.pi * k * centres) for k in range(max(given.shape))]
    total = np.zeros((GRID, GRID))
    for k1 in range(given.shape[0]):
        for k2 in range(given.shape[1]):
            total += given[k1, k2] * np.outer(waves[k2], waves[k1])
    return total


def ring_means(values: Floats) -> Floats:
    """Mean of (50, 50) values over the ring cells around every cell that lie inside the square."""
    framed = np.full((GRID + 4, GRID + 4), np.nan)
    framed[2 : 2 + GRID, 2 : 2 + GRID] = values
    neighbours = [framed[2 + dy : 2 + dy + GRID, 2 + dx : 2 + dx + GRID] for dy, dx in RING]
    return np.asarray(np.nanmean(neighbours, axis=0))


def reconstruction_field(coefficients: NDArray[np.floating]) -> Floats:
    """Return the capture field (50, 50) of a team with these mean coefficients (K, K).

    Ring means of the reconstruction, rescaled to [0, 1]; all 0 where they are constant but for rounding.
    """
    means = ring_means(reconstruct(coefficients))
    low, high = means.min(), means.max()
    if high - low <= 1e-12 * max(abs(low), abs(high)):
        return np.zeros_like(means)
    return np.asarray((means - low) / (high - low))


def reconstruction_captures(field: Floats, threshold: float = 0.75) -> Booleans:
    """Cells of a (50, 50) reconstruction field where it captures: at the threshold or above."""
    return np.asarray(field >= threshold)


def published_controller() -> ControllerReference:
    """The controller of the preset `released`."""
    return ControllerReference(tau=None, q=1.0, r=1.0, wall_margin=0.01, speed_factor=0.8, spectrum="exponential")


def unit_vectors(controls: Floats, limit: float = 1.0) -> Floats:
    """Scale every vector (..., 2) of which a component exceeds the limit to the length of the limit; return a copy.

    A vector without such a component stays as it is, though it may be as long as sqrt(2) limits.
    """
    lengths = np.linalg.norm(controls, axis=-1, keepdims=True)
    exceeds = np.abs(controls).max(axis=-1, keepdims=True) > limit
    return np.where(exceeds, limit * controls / np.maximum(lengths, limit), controls)


class ReleasedReference:
    """One game by the preset `released`, of which positions and velocities are given.

    It has `rules`, and as of the last solve `phi` (2, K, K), `memory` (N, K, K), `memory_weight` (N,) and the capture
    `fields` (2, 50, 50), which are 0 for a team without drones; `wanted` (N, H, 2) are the controls of the backward
    pass before any limit, and `controls` (N, H, 2) those that drones keep for the next solve, which may be set.

    With a warm start, each drone keeps its sequence of controls u_1 ... u_H, zeros at first, whatever its team or
    target. One solve of a drone at position p with velocity v, where D is the control period and g the speed factor:

    1. Shift: u_h <- u_(h+1) for h < H, and u_H <- 0.
    2. Look ahead by Euler steps from x_0 = p, v_0 = v, for h = 1 ... H. Walls stop nothing:
       x_h = x_(h-1) + D g v_(h-1) and v_h = v_(h-1) + D u_h.
       The points x_1 ... x_H, with the memory, give c_k, cbar_k and the capture field, as without a warm start.
    3. Costate at the same points, from rho_(H+1) = 0, for h = H ... 1, as without a warm start:
       rho_h = rho_(h+1) + D (q sum_k Lambda_k (cbar_k - phi_k) grad F_k(x_h) + grad Phi(x_h) + A^T rho_(h+1)).
    4. Control at every step, not at the first alone: u_h = -(1 / R) B^T rho_h. This is `wanted`.
    5. Limit: u_h <- u_h / |u_h| if a component of u_h exceeds 1 in magnitude. This is `controls`.

    The first, u_1, is applied; the game scales it to length 1 if it is longer. Without a warm start, step 1 makes all
    controls 0: the drone coasts.
    """

    def __init__(self, teams: NDArray[np.integer], cells: int = 10, warm_start: bool = False) -> None:
        self.warm_start = warm_start
        self.rules = RuleReference(teams, trail_ticks=None)
        self.controller = published_controller()
        uniform = np.full((cells, cells), 1.0 / cells**2)
        self._targets = [uniform, uniform]  # what the teams follow, as densities of sum 1
        self._sent: list[Floats | None] = [None, None]  # what they are to follow from the next solve on
        self.phi: Floats = np.stack([target_coefficients(uniform)] * 2)
        self.memory: Floats = np.zeros((len(teams), 10, 10))
        self.memory_weight: Floats = np.zeros(len(teams))
        self.wanted: Floats = np.zeros((len(teams), self.controller.horizon, 2))
        self.controls: Floats = np.zeros_like(self.wanted)
        self.fields: Floats = np.zeros((2, 50, 50))

    def command(self, team: int, density: NDArray[np.floating]) -> None:
        """Send a team an (A, A) density, row = y, column = x, of any sum; zeros mean uniform."""
        values = np.array(density, dtype=np.float64)
        if not values.any():
            values[:] = 1.0
        self._sent[team] = values / values.sum()

    def step(self, team: int, density: NDArray[np.floating]) -> None:
        """Ask for an (A, A) density as a step does: what was asked for last is held, anything else is sent."""
        last, sent = self._targets[team], self._sent[team]
        self.command(team, density)
        if np.abs(self._sent[team] - (last if sent is None else sent)).max() <= 1e-9:
            self._sent[team] = sent

    def solve(self, positions: NDArray[np.floating], velocities: NDArray[np.floating]) -> Floats:
        """One solve: accelerations of all drones, (N, 2) float64, not saturated."""
        for team in (0, 1):
            self._follow(team)
        controller, teams = self.controller, self.rules.teams
        none_failed = np.zeros(len(teams), dtype=np.bool_)
        self.memory, self.memory_weight = controller.remember(positions, self.memory, self.memory_weight, none_failed)
        rollouts = self._look_ahead(positions, velocities)
        coefficients = controller.coefficients(rollouts, self.memory, self.memory_weight)
        for team in (0, 1):
            members = np.flatnonzero(teams == team)
            self.fields[team] = 0.0
            if len(members) == 0:
                continue
            shared = coefficients[members].mean(axis=0)
            self.fields[team] = reconstruction_field(shared)
            for i in members:
                self.wanted[i] = controller.controls(rollouts[i], shared - self.phi[team])
        self.controls = unit_vectors(self.wanted)
        return self.wanted[:, 0].copy()

    def _look_ahead(self, positions: NDArray[np.floating], velocities: NDArray[np.floating]) -> Floats:
        """Shift the sequences of controls, and follow them: the (N, H, 2) points x_1 ... x_H."""
        following = np.zeros_like(self.controls)
        if self.warm_start:
            following[:, :-1] = self.controls[:, 1:]
        step, rollouts = self.controller.period, np.zeros_like(following)
        points, speeds = np.array(positions, dtype=np.float64), np.array(velocities, dtype=np.float64)
        for h in range(self.controller.horizon):
            points = points + step * self.controller.speed_factor * speeds
            speeds = speeds + step * following[:, h]
            rollouts[:, h] = points
        return rollouts

    def _follow(self, team: int) -> None:
        """Take over what a team was sent, if anything: memories are emptied by all of it, trails by what is new."""
        sent = self._sent[team]
        if sent is None:
            return
        if np.abs(sent - self._targets[team]).max() > 1e-9:
            self._forget_trails(self.rules.teams == team)
        self._forget(self.rules.teams == team)
        self._targets[team] = sent
        self._sent[team] = None
        self.phi[team] = target_coefficients(sent, mass=TARGET_MASS)

    def _forget_trails(self, drones: Booleans) -> None:
        for drone in np.flatnonzero(drones):
            self.rules.trails[drone].clear()

    def _forget(self, drones: Booleans) -> None:
        self.memory[drones] = 0.0
        self.memory_weight[drones] = 0.0

    def tick(self, positions: NDArray[np.float32]) -> list[int]:
        """Extend the trails by positions (N, 2) after a move, apply all captures at once, and return them."""
        captured = self.rules.tick(positions, captures=reconstruction_captures(self.fields))
        lost = np.isin(np.arange(len(positions)), captured)
        self._forget_trails(lost)
        self._forget(lost)
        return captured

    def values(self, positions: NDArray[np.float32]) -> Floats:
        """The opposing field at each of (N, 2) positions, (N,) float64, for the present teams."""
        places = zip(self.rules.teams, positions, strict=True)
        return np.array([self.fields[1 - team][cell_of(position)] for team, position in places])
