"""The references themselves, where the answer is known."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.kernels.states import random_state
from tests.reference import ControllerReference, RuleReference, basis, move, target_coefficients
from tests.reference_released import ReleasedReference
from tests.reference_variants import (
    FlockingReference,
    VariantRules,
    heard_within,
    reconstruct,
    reconstruction_captures,
    reconstruction_field,
    ring_means,
    strongest_mode,
)

CENTRES = (np.arange(50) + 0.5) / 50
NOBODY = np.array([[0.5, 0.5, 50.0]] * 2)


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


def test_all_heard_is_the_default_exactly():
    state = random_state(np.random.default_rng(0), 12)
    targets = np.stack([target_coefficients(command) for command in state.commands])
    given = (state.positions, state.velocities, state.teams, state.memory, state.memory_weight, targets)
    reference = ControllerReference()
    for one, other in zip(
        reference.solve(*given),
        reference.solve(*given, heard=heard_within(state.positions, 2.0), failed=np.zeros(12, bool)),
        strict=True,
    ):
        np.testing.assert_array_equal(one, other)


def test_a_drone_that_hears_nobody_solves_alone():
    state = random_state(np.random.default_rng(1), 6)
    targets = np.stack([target_coefficients(command) for command in state.commands])
    reference = ControllerReference()
    given = (state.positions, state.velocities, state.teams, state.memory, state.memory_weight)
    together, *_ = reference.solve(*given, targets, heard=np.zeros((6, 6), bool))
    for i in range(6):
        only = np.arange(6) == i
        for alone in (
            reference.solve(*(array[i : i + 1] for array in given), targets),
            [array[i : i + 1] for array in reference.solve(*given, targets, failed=~only)],
        ):
            np.testing.assert_array_equal(together[i], alone[0][0])


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


def test_a_speed_factor_slows_motion_and_rollout_alike():
    position, velocity = np.array([[0.5, 0.5]]), np.array([[0.3, -0.6]])
    moved, unchanged = move(position, velocity, np.zeros((1, 2)), speed_factor=0.5)
    np.testing.assert_allclose(moved, [[0.505, 0.49]])
    np.testing.assert_allclose(unchanged, velocity)
    np.testing.assert_allclose(
        ControllerReference(speed_factor=0.5).look_ahead(position, velocity),
        ControllerReference().look_ahead(position, velocity / 2),
    )


def test_the_variant_rules_without_options_are_the_rules():
    generator = np.random.default_rng(2)
    teams = np.arange(12) % 2
    rules, variant = RuleReference(teams, trail_ticks=20), VariantRules(teams, trail_ticks=20)
    positions, captures = generator.random((12, 2)), 0
    for _ in range(80):
        positions = np.clip(positions + generator.normal(size=(12, 2)) * 0.01, 0.0, 1.0)
        captured = rules.tick(positions.astype(np.float32))
        assert variant.tick(positions.astype(np.float32)) == captured
        captures += len(captured)
        np.testing.assert_array_equal(variant.occupancy, rules.occupancy)
        np.testing.assert_array_equal(variant.teams, rules.teams)
    assert variant.captures == rules.captures
    assert variant.recaptures == rules.recaptures
    assert captures > 0


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


def test_a_lone_drone_at_rest_flies_straight_to_its_attractor():
    flocking = FlockingReference()
    attractors = np.array([[0.9, 0.5, 50.0], [0.1, 0.5, 50.0]])
    accelerations = flocking.solve([[0.5, 0.5]] * 2, np.zeros((2, 2)), [0, 1], attractors)
    np.testing.assert_allclose(accelerations, [[2.5, 0.0], [-2.5, 0.0]])
    at_rest = flocking.solve([[0.5, 0.5]], np.zeros((1, 2)), [0], NOBODY)
    np.testing.assert_array_equal(at_rest, 0.0)


@pytest.mark.parametrize("side", [-1, 1])
def test_two_drones_on_a_line_turn_no_further_than_allowed(side):
    # The attractor is behind them and a little to one side: that is where they turn to, by 18 degrees.
    positions, velocities = [[0.5, 0.5], [0.6, 0.5]], np.array([[0.25, 0.0]] * 2)
    attractors = np.array([[0.1, 0.5 + side * 0.01, 100.0]] * 2)
    accelerations = FlockingReference().solve(positions, velocities, [0, 0], attractors)
    wanted = velocities + 0.1 * accelerations
    turned = 0.25 * np.array([math.cos(math.pi / 10), side * math.sin(math.pi / 10)])
    np.testing.assert_allclose(wanted, [turned] * 2, atol=1e-12)


def test_team_mates_too_close_are_pushed_apart_and_opponents_are_not():
    positions = [[0.495, 0.5], [0.505, 0.5]]
    apart = FlockingReference().solve(positions, np.zeros((2, 2)), [0, 0], NOBODY)
    np.testing.assert_allclose(apart, [[-2.5, 0.0], [2.5, 0.0]], atol=1e-12)
    strangers = FlockingReference().solve(positions, np.zeros((2, 2)), [0, 1], NOBODY)
    np.testing.assert_allclose(strangers, [[2.5, 0.0], [-2.5, 0.0]], atol=1e-12)


def test_neighbours_align_and_draw_together():
    positions, velocities = np.array([[0.4, 0.5], [0.5, 0.5], [0.9, 0.9]]), np.array([[0.0, 0.1], [0.2, 0.3], [1, 1]])
    nothing = np.zeros((2, 3))
    align = FlockingReference(cohesion=0, alignment=1).urges(positions, velocities, [0, 0, 0], nothing)
    np.testing.assert_allclose(align, [[0.2, 0.2], [-0.2, -0.2], [0, 0]])
    cohere = FlockingReference(cohesion=1, alignment=0).urges(positions, velocities, [0, 0, 0], nothing)
    np.testing.assert_allclose(cohere, [[0.1, 0], [-0.1, 0], [0, 0]], atol=1e-12)
    failed = np.array([False, True, False])
    unheard = FlockingReference(cohesion=1).urges(positions, velocities, [0, 0, 0], nothing, failed)
    np.testing.assert_array_equal(unheard[0], 0.0)


def test_the_strongest_mode_of_known_densities():
    assert strongest_mode(np.full((10, 10), 0.3)) == (0.5, 0.5, 50.0)
    spot = np.zeros((10, 10))
    spot[2, 7] = 0.4
    assert strongest_mode(spot) == pytest.approx((0.75, 0.25, 100.0))
    corner = np.zeros((10, 10))
    corner[9, 0] = 1.0
    assert strongest_mode(corner) == pytest.approx((0.05, 0.95, 100.0))
    equals = np.zeros((10, 10))
    equals[8, 1] = equals[1, 8] = 1.0  # the lower row comes first
    assert strongest_mode(equals) == pytest.approx((0.85, 0.15, 75.0))
    two = np.zeros((10, 10))
    two[1, 1], two[1, 2], two[8, 8] = 1.0, 1.0, 1.0
    assert strongest_mode(two) == pytest.approx((0.2, 0.15, 50 + 50 * 2 / 3))
