"""The references themselves, where the answer is known."""

from __future__ import annotations

import numpy as np
import pytest

from tests.reference import ControllerReference, basis, target_coefficients
from tests.reference_released import ReleasedReference
from tests.reference_variants import (
    VariantRules,
    reconstruct,
    reconstruction_captures,
    reconstruction_field,
    ring_means,
)

CENTRES = (np.arange(50) + 0.5) / 50


def lone(k1, k2, value=1.0):
    coefficients = np.zeros((10, 10))
    coefficients[k1, k2] = value
    return coefficients


@pytest.mark.parametrize("value", [1.0, 0.3, -2.0])
def test_the_reconstruction_of_the_uniform_density_is_constant_and_captures_nowhere(value):
    np.testing.assert_array_equal(reconstruct(lone(0, 0, value)), value)
    field = reconstruction_field(lone(0, 0, value))
    assert not field.any()
    assert not reconstruction_captures(field).any()


def test_the_first_index_of_a_mode_runs_along_x():
    np.testing.assert_allclose(reconstruct(lone(1, 0)), np.tile(np.cos(np.pi * CENTRES), (50, 1)))
    np.testing.assert_allclose(reconstruct(lone(0, 2))[:, 7], np.cos(2 * np.pi * CENTRES))


def test_ring_means_of_a_slope_are_the_slope_away_from_walls_and_lean_inwards_at_them():
    slope = np.tile(CENTRES, (50, 1))
    means = ring_means(slope)
    np.testing.assert_allclose(means[2:-2, 2:-2], slope[2:-2, 2:-2])
    assert means[25, 0] == pytest.approx((2 * CENTRES[0] + 2 * CENTRES[1] + 5 * CENTRES[2]) / 9)


def test_a_drone_captures_around_itself():
    field = reconstruction_field(basis(np.array([0.3, 0.7])))
    assert (field.min(), field.max()) == (0.0, 1.0)
    row, column = np.unravel_index(field.argmax(), field.shape)
    assert abs(CENTRES[column] - 0.3) < 0.1
    assert abs(CENTRES[row] - 0.7) < 0.1
    captures = reconstruction_captures(field)
    assert captures[35, 15]
    assert not captures[15, 35]


def test_memory_for_ever_counts_every_solve_and_a_failed_drone_has_none():
    reference = ControllerReference(tau=None)
    position = np.array([[0.2, 0.4]] * 2)
    sums, weights = np.zeros((2, 10, 10)), np.zeros(2)
    for _ in range(5):
        sums, weights = reference.remember(position, sums, weights, np.array([False, True]))
    assert weights.tolist() == [5.0, 0.0]
    np.testing.assert_allclose(sums[0], 5 * basis(position[0]))
    assert not sums[1].any()


def test_a_targets_mass_multiplies_its_coefficients_and_what_a_team_begins_with_has_mass_1():
    command = np.random.default_rng(3).random((10, 10))
    of_mass = target_coefficients(command, mass=10.0)
    assert of_mass[0, 0] == pytest.approx(10.0)
    np.testing.assert_allclose(of_mass, 10 * target_coefficients(command / 7), atol=1e-12)
    reference = ReleasedReference([0, 1])
    position = np.array([[0.3, 0.6], [0.7, 0.2]])
    reference.command(1, command)
    reference.solve(position, np.zeros((2, 2)))
    np.testing.assert_allclose(reference.phi, [lone(0, 0), of_mass], atol=1e-12)


def test_what_is_sent_again_empties_memories_and_what_is_new_trails_too():
    reference = ReleasedReference([0, 1])
    positions, velocities = np.array([[0.11, 0.11], [0.91, 0.91]], np.float32), np.zeros((2, 2))
    first, other = np.random.default_rng(4).random((2, 10, 10))

    def period():
        reference.solve(positions, velocities)
        for _ in range(3):
            reference.tick(positions)
        return reference.memory_weight.tolist(), reference.rules.occupancy.sum(axis=(1, 2)).tolist()

    assert period() == ([1, 1], [3, 3])
    reference.command(0, np.zeros((10, 10)))  # uniform coverage is what it has: sent, but not new
    assert period() == ([1, 2], [6, 6])
    reference.command(0, first)
    assert period() == ([1, 3], [3, 9])
    reference.command(0, first / 2)
    assert period() == ([1, 4], [6, 12])
    reference.step(0, first / 3)
    assert period() == ([2, 5], [9, 15])
    reference.step(0, other)
    reference.step(0, other)
    assert period() == ([1, 6], [3, 18])


def test_trails_last_are_forgotten_and_are_not_written_by_failed_drones():
    positions = np.array([[0.11, 0.11], [0.91, 0.91]], np.float32)
    rules = VariantRules([0, 1], trail_ticks=None, forgotten_on_capture=True)
    nowhere = np.zeros((2, 50, 50), bool)
    for _ in range(400):
        rules.tick(positions, captures=nowhere)
    assert rules.occupancy[0, 5, 5] == rules.occupancy[1, 45, 45] == 400
    rules.tick(positions, failed=np.array([True, False]), captures=nowhere)
    assert rules.occupancy[0].sum() == 400
    rules.command(0)
    assert rules.occupancy.sum(axis=(1, 2)).tolist() == [0, 401]
    everywhere = ~nowhere
    assert rules.tick(positions, captures=everywhere) == [0, 1]
    assert not rules.occupancy.any()
    assert rules.teams.tolist() == [1, 0]
