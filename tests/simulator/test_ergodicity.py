from __future__ import annotations

import numpy as np
import pytest

from benchmarks.paper.coverage import ErgodicMetric
from swarm_pz.config import CaptureConfig, ControllerConfig, GameConfig, MemoryConfig
from swarm_pz.errors import CommandError
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import basis, potential, reconstruct, shared_coefficients
from tests import reference
from tests.reference import reconstruction_field

CENTRES = (np.arange(50) + 0.5) / 50
PEACE = CaptureConfig(enabled=False)
SLOW = GameConfig.preset("released").replace(
    controller=ControllerConfig(spectrum="exponential", ergodic_weight=3.0),
    memory=MemoryConfig(controller=2.0),
)
"""Another speed, memory and spectrum, and other weights."""


def gaussian(x0: float, y0: float, sigma: float) -> np.ndarray:
    centres = (np.arange(10) + 0.5) / 10
    return np.exp(-((centres[None] - x0) ** 2 + (centres[:, None] - y0) ** 2) / (2 * sigma**2))


def under_way(config, ticks):
    """Return two games, with a target of its own for red in each."""
    simulator = Simulator(config, num_games=2)
    simulator.reset([3, 4])
    simulator.command(0, np.stack([gaussian(0.5, 0.5, 0.1), gaussian(0.3, 0.7, 0.15)]))
    simulator.advance(ticks)
    return simulator


@pytest.mark.parametrize(
    "config",
    [GameConfig(capture=CaptureConfig(field="reconstruction")), SLOW, GameConfig.preset("released")],
    ids=["paper", "slow", "warm"],
)
def test_shared_coefficients_are_those_of_the_kernels_next_solve(config):
    # The kernel makes the field of the preset `released` from them.
    simulator = under_way(config, 60)
    shared = [shared_coefficients(simulator, 1, team) for team in range(2)]
    simulator.advance(1)
    expected = [reconstruction_field(one) for one in shared]
    np.testing.assert_allclose(simulator.capture_field[1], expected, atol=1e-4)
    assert [one[0, 0] for one in shared] == pytest.approx([1.0, 1.0], abs=1e-6)


def test_the_potential_has_the_controllers_own_weights_and_the_metric_those_of_the_rules():
    simulator = Simulator(SLOW.replace(capture=PEACE))
    simulator.reset([3])
    simulator.command(1, gaussian(0.3, 0.7, 0.15)[None])
    simulator.advance(30)
    values, _ = potential(simulator, 0, 1, 50)
    difference = shared_coefficients(simulator, 0, 1) - simulator.games.coefficients[0, 1]
    weighted = 3.0 * reference.exponential_weights() * difference
    place = np.array([CENTRES[31], CENTRES[7]])
    assert values[7, 31] == pytest.approx(np.sum(weighted * reference.basis(place)), abs=1e-6)
    metric = ErgodicMetric(simulator, team=1)
    metric.observe()
    bases = [reference.basis(place) for place in simulator.positions[0][simulator.teams[0] == 1]]
    np.testing.assert_allclose(metric.coefficients[0], np.mean(bases, axis=0), atol=1e-9)
    expected = reference.ergodic_metric(np.mean(bases, axis=0), simulator.games.coefficients[0, 1])
    assert metric.value()[0] == pytest.approx(expected)


def test_the_gradient_is_that_of_the_potential():
    values, gradient = potential(under_way(GameConfig(), 61), 1, 0, 400)
    scale = np.abs(gradient).max()
    for axis, slope in enumerate(reversed(np.gradient(values, 1 / 400))):
        np.testing.assert_allclose(gradient[1:-1, 1:-1, axis], slope[1:-1, 1:-1], atol=2e-3 * scale)


def test_the_smooth_picture_of_a_point_is_nowhere_negative():
    point = basis([0.31, 0.77], 10)
    assert reconstruct(point, 50).min() < -1.0
    image = reconstruct(point, 50, smooth=True)
    assert image.min() >= -1e-9
    assert image.mean() == pytest.approx(1.0)
    row, column = np.unravel_index(image.argmax(), image.shape)
    assert (CENTRES[column], CENTRES[row]) == pytest.approx((0.31, 0.77), abs=0.01)


def test_the_metric_counts_every_drone_for_the_team_it_was_of_unless_it_had_failed():
    simulator = Simulator(GameConfig(drones_per_team=4), num_games=2)
    simulator.reset([0, 1])
    simulator.command(1, np.stack([gaussian(0.2, 0.2, 0.1)] * 2))
    metric, bases = ErgodicMetric(simulator, team=1), []
    for tick in range(8):
        simulator.advance(1)
        simulator.games.teams[0, 0] = tick % 2
        simulator.games.failed[0, 5] = tick % 4 == 0
        metric.observe()
        counts = (simulator.teams[0] == 1) & ~simulator.failed[0]
        bases.append([reference.basis(place) for place in simulator.positions[0][counts]])
    phi = simulator.games.coefficients[0, 1]
    expected = reference.ergodic_metric(np.mean([place for moment in bases for place in moment], axis=0), phi)
    assert metric.value()[0] == pytest.approx(expected, rel=1e-9)


def test_a_team_without_drones_has_no_coefficients():
    simulator = Simulator(GameConfig(drones_per_team=(2, 0), capture=PEACE))
    metric = ErgodicMetric(simulator, team=1)
    metric.observe()
    assert np.isnan(metric.value()).all()
    with pytest.raises(CommandError, match="team 1 of game 0 must have drones"):
        shared_coefficients(simulator, 0, 1)


def test_a_flock_has_no_potential():
    simulator = Simulator(GameConfig(controllers=("ergodic", "flocking")))
    for team, side, swapped in ((1, "blue", False), (0, "red", True)):
        simulator.reset(swapped=swapped)
        with pytest.raises(CommandError, match=f"{side} is flown by flocking"):
            potential(simulator, 0, team, cells=5)
        assert np.isfinite(potential(simulator, 0, 1 - team, cells=5)[0]).all()
