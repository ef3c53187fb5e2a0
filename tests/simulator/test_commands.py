from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config.values import check_densities
from swarm_pz.errors import CommandError
from swarm_pz.simulator.commands import make_target
from tests.reference import target_coefficients


@pytest.mark.parametrize("cells", [2, 5, 10, 50])
def test_coefficients_match_quadrature_of_the_interpolated_density_whatever_its_scale(cells):
    command = np.random.default_rng(cells).random((cells, cells)) ** 3
    target, ours = make_target(command, 10)
    np.testing.assert_allclose(target, command / command.sum(), rtol=1e-12)
    np.testing.assert_allclose(ours, target_coefficients(command), atol=2e-6)
    for same in (command / 2, command * 1e-300):
        np.testing.assert_allclose(make_target(same, 10)[0], target, rtol=1e-12)


def test_all_zero_means_uniform():
    target, coefficients = make_target(np.zeros((10, 10)), 2)
    np.testing.assert_array_equal(target, 0.01)
    np.testing.assert_allclose(coefficients, [[1.0, 0.0], [0.0, 0.0]], atol=1e-7)


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (np.full((10, 10), np.nan), "got nan at index"),
        (np.full((10, 10), -0.1), "got values from -0.1"),
        (np.full((10, 10), 1.0 + 2e-6), "got values from"),
        (np.ones((10, 9)), r"of shape \(10, 10\), got shape \(10, 9\)"),
        ("attack", "got str 'attack'"),
    ],
)
def test_bad_commands_say_what_was_expected_and_what_came(bad, message):
    with pytest.raises(CommandError, match=rf"command must be numbers in \[0, 1\] .*{message}"):
        check_densities(bad, (10, 10))


def test_rounding_just_outside_is_clipped_in_a_copy_and_integers_are_taken():
    command = np.full((10, 10), 1.0 + 5e-7)
    assert check_densities(command, (10, 10)).max() == 1.0 < command.max()
    assert check_densities(np.full((10, 10), -5e-7), (10, 10)).max() == 0.0
    assert check_densities(np.ones((10, 10), bool), (10, 10)).dtype == np.float64
    assert check_densities([[1e-299, 1e-301], [5e-324, 0.0]], (2, 2)).tolist() == [[1e-299, 0.0], [0.0, 0.0]]
