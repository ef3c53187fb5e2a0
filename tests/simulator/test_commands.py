from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from swarm_pz.config.values import check_densities
from swarm_pz.errors import CommandError
from swarm_pz.simulator.commands import interpolation_matrix, make_target
from tests.reference import target_coefficients

commands = arrays(np.float64, (10, 10), elements=st.floats(0.0, 1.0))


@given(commands)
def test_targets_sum_to_one(command):
    assert make_target(command, 2)[0].sum() == pytest.approx(1.0)


@given(commands)
def test_an_image_and_its_double_are_the_same_target(command):
    once, twice = make_target(command / 2, 2)[0], make_target(command, 2)[0]
    np.testing.assert_allclose(once, twice, rtol=1e-12, atol=1e-300)


def test_all_zero_means_uniform():
    np.testing.assert_array_equal(make_target(np.zeros((10, 10)), 2)[0], 0.01)


@pytest.mark.parametrize("cells", [2, 5, 10, 50])
def test_coefficients_match_quadrature_of_the_interpolated_density(cells):
    command = np.random.default_rng(cells).random((cells, cells))
    ours = make_target(command, 10)[1]
    np.testing.assert_allclose(ours, target_coefficients(command), atol=2e-6)


def test_coefficients_are_indexed_by_x_then_y():
    command = np.zeros((10, 10))
    command[:, 0] = 1.0  # everything at small x
    coefficients = make_target(command, 10)[1]
    assert coefficients[1, 0] > 0.9
    assert abs(coefficients[0, 1]) < 1e-7


def test_interpolation_is_constant_beyond_the_outer_centres():
    matrix = interpolation_matrix(50, 10)
    np.testing.assert_allclose(matrix.sum(axis=1), 1.0)
    np.testing.assert_array_equal(matrix[:3, 0], 1.0)


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (np.full((10, 10), np.nan), "got nan at index"),
        (np.full((10, 10), np.inf), "got inf"),
        (np.full((10, 10), -0.1), "got values from -0.1"),
        (np.full((10, 10), 1.1), "to 1.1"),
        (np.ones((10, 9)), r"of shape \(10, 10\), got shape \(10, 9\)"),
        (np.ones(100), "got shape"),
        ("attack", "got str 'attack'"),
        (None, "got NoneType None"),
        ([[1, 2], [3]], "got list"),
        ({"a": 1}, "got dict"),
    ],
)
def test_bad_commands_say_what_was_expected_and_what_came(bad, message):
    with pytest.raises(CommandError, match=r"command must be numbers in \[0, 1\]") as caught:
        check_densities(bad, (10, 10))
    assert caught.match(message)


def test_rounding_just_outside_is_clipped_and_integers_are_taken():
    values = check_densities(np.full((10, 10), 1.0 + 5e-7), (10, 10))
    assert values.max() == 1.0
    assert check_densities(np.full((10, 10), -5e-7), (10, 10)).max() == 0.0
    assert check_densities(np.ones((10, 10), bool), (10, 10)).dtype == np.float64
    for beyond in (1.0 + 2e-6, -2e-6):
        with pytest.raises(CommandError, match="got values from"):
            check_densities(np.full((10, 10), beyond), (10, 10))


def test_the_given_command_is_not_changed():
    command = np.full((10, 10), 1.0 + 5e-7)
    check_densities(command, (10, 10))
    assert command.max() > 1.0
