"""What must not matter does not matter: over one control period, up to rounding."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import GameConfig
from swarm_pz.simulator import Simulator


@pytest.fixture(params=["ergodic", "flocking"])
def one_period(request):
    simulator = Simulator(GameConfig(controllers=request.param))

    def advance(positions, velocities, teams, commands):
        """Return (positions, velocities, teams) after a control period."""
        simulator.reset([0], scenario={"positions": positions, "velocities": velocities, "teams": teams})
        simulator.command(0, commands[None, 0])
        simulator.command(1, commands[None, 1])
        simulator.advance(3)
        return simulator.positions[0].copy(), simulator.velocities[0].copy(), simulator.teams[0].copy()

    return advance


@pytest.fixture(params=range(5))
def state(request):
    generator = np.random.default_rng(request.param)
    return (
        generator.random((20, 2)) * 0.9 + 0.05,
        generator.normal(size=(20, 2)) * 0.2,
        np.arange(20) % 2,
        generator.random((2, 10, 10)),
    )


def test_team_swap(one_period, state):
    positions, velocities, teams, commands = state
    one = one_period(positions, velocities, teams, commands)
    other = one_period(positions, velocities, 1 - teams, commands[::-1])
    np.testing.assert_allclose(one[0], other[0], atol=1e-5)
    np.testing.assert_array_equal(one[2], 1 - other[2])


def test_drone_permutation(one_period, state):
    positions, velocities, teams, commands = state
    order = np.random.default_rng(9).permutation(20)
    one = one_period(positions, velocities, teams, commands)
    other = one_period(positions[order], velocities[order], teams[order], commands)
    np.testing.assert_allclose(one[0][order], other[0], atol=1e-5)
    np.testing.assert_array_equal(one[2][order], other[2])


@pytest.mark.parametrize("flip_x", [False, True])
@pytest.mark.parametrize("flip_y", [False, True])
@pytest.mark.parametrize("transpose", [False, True])
def test_symmetries_of_the_square(one_period, state, flip_x, flip_y, transpose):
    positions, velocities, teams, commands = state

    def turn_points(points, is_position):
        points = np.array(points, dtype=float)
        for axis, flip in ((0, flip_x), (1, flip_y)):
            if flip:
                points[:, axis] = (1.0 if is_position else 0.0) - points[:, axis]
        return points[:, ::-1] if transpose else points

    turned = commands[:, :, ::-1] if flip_x else commands
    turned = turned[:, ::-1] if flip_y else turned
    turned = turned.transpose(0, 2, 1) if transpose else turned
    one = one_period(positions, velocities, teams, commands)
    other = one_period(turn_points(positions, True), turn_points(velocities, False), teams, turned)
    np.testing.assert_allclose(turn_points(one[0], True), other[0], atol=1e-5)
    np.testing.assert_allclose(turn_points(one[1], False), other[1], atol=1e-4)
    np.testing.assert_array_equal(one[2], other[2])
