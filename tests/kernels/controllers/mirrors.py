"""One solve of flocks beside their slow float64 reference."""

from __future__ import annotations

import numpy as np

from tests.reference import saturate
from tests.reference_variants import strongest_mode


def decided_by_rounding(state, reference, attractors, failed=None, heard=None) -> np.ndarray:
    """Return which drones (N,) stand so near a jump of the control that rounding may decide, as an array of bool."""
    positions, velocities = state.positions.astype(float), state.velocities.astype(float)
    distances = np.linalg.norm(positions[:, None] - positions[None], axis=-1)
    radii = (reference.communication_radius, reference.separation_radius)
    edge = np.any([np.abs(distances - radius).min(axis=1) < 1e-6 for radius in radii], axis=0)
    urges = reference.urges(positions, velocities, state.teams, attractors, failed, heard)
    weak = np.linalg.norm(urges, axis=1) < 0.05
    cross = velocities[:, 0] * urges[:, 1] - velocities[:, 1] * urges[:, 0]
    turn = np.arctan2(cross, (velocities * urges).sum(axis=1))
    back = np.pi - np.abs(turn) < 1e-3
    slow = np.abs(np.linalg.norm(velocities, axis=1) - 0.001) < 1e-4
    return edge | weak | back | slow


def attractors_of(simulator) -> np.ndarray:
    """Return the first attractors of the commands in force, of red and blue in all games (E, 2, 3)."""
    return simulator.games.commands[:, :, :3]


def assert_flock_mirrored(simulator, state, reference, failed=None) -> int:
    """Compare the accelerations of a solve to 1e-3 and return for how many drones that could be done."""
    attractors = attractors_of(simulator)[0]
    expected = reference.solve(state.positions, state.velocities, state.teams, attractors, failed)
    expected = saturate(expected, simulator.config.controller.max_acceleration)
    clear = ~decided_by_rounding(state, reference, attractors, failed)
    np.testing.assert_allclose(simulator.games.accelerations[0][clear], expected[clear], atol=1e-3)
    return int(clear.sum())


def assert_attractors_serve(simulator, commands) -> None:
    """Compare the attractors of both teams with the reference's for these densities."""
    low, high = simulator.config.flocking.migration
    expected = [strongest_mode(command, low, high) for command in commands]
    np.testing.assert_allclose(attractors_of(simulator)[0], expected, rtol=1e-5, atol=1e-6)
