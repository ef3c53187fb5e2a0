from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, ControllerConfig, GameConfig, MemoryConfig
from swarm_pz.errors import CommandError
from swarm_pz.kernels.controllers.ergodic import sobolev_weights
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import ErgodicMetric, basis, potential, reconstruct, shared_coefficients
from tests import reference
from tests.reference_variants import reconstruction_field

CENTRES = (np.arange(50) + 0.5) / 50


def gaussian(x0: float, y0: float, sigma: float) -> np.ndarray:
    centres = (np.arange(10) + 0.5) / 10
    return np.exp(-((centres[None] - x0) ** 2 + (centres[:, None] - y0) ** 2) / (2 * sigma**2))


@pytest.fixture
def game():
    """The second of two games after two seconds and one tick, with a target of its own for red."""
    simulator = Simulator(num_games=2)
    simulator.reset([3, 4])
    simulator.command(0, np.stack([gaussian(0.5, 0.5, 0.1), gaussian(0.3, 0.7, 0.15)]))
    simulator.advance(61)
    return simulator


def test_the_basis_is_that_of_the_rules():
    places = np.random.default_rng(0).random((4, 3, 2))
    values = basis(places, 7)
    assert values.shape == (4, 3, 7, 7)
    for index in np.ndindex(4, 3):
        np.testing.assert_allclose(values[index], reference.basis(places[index], 7), atol=1e-12)
    np.testing.assert_allclose(sobolev_weights(7), reference.sobolev_weights(7), rtol=1e-14)


@pytest.mark.parametrize("team", [0, 1])
def test_shared_coefficients_are_those_of_the_next_solve(game, team):
    games, row, modes = game.games, 1, 10
    decay = np.exp(-0.1 / 4.0)
    every = []
    for drone in np.flatnonzero(games.teams[row] == team):
        position, velocity = games.positions[row, drone].astype(float), games.velocities[row, drone].astype(float)
        total = decay * games.memory[row, :, :, drone] + reference.basis(position)
        for h in range(1, 11):
            total = total + reference.basis(position + h * 0.1 * velocity)
        every.append(total / (decay * games.memory_weight[row, drone] + 1.0 + 10))
    shared = shared_coefficients(game, row, team)
    assert shared.shape == (modes, modes)
    np.testing.assert_allclose(shared, np.mean(every, axis=0), atol=1e-6)
    assert shared[0, 0] == pytest.approx(1.0, abs=1e-6)


SLOW = GameConfig.preset("released").replace(
    controller=ControllerConfig(spectrum="exponential", ergodic_weight=3.0),
    memory=MemoryConfig(controller=2.0),
)
"""Another speed, memory and spectrum, and other weights."""


@pytest.mark.parametrize(
    "config", [GameConfig(capture=CaptureConfig(field="reconstruction")), SLOW], ids=["paper", "slow"]
)
def test_shared_coefficients_are_those_of_the_kernel(config):
    # From them it makes the field of the preset `released`.
    simulator = Simulator(config, num_games=2)
    simulator.reset([3, 4])
    simulator.command(0, np.stack([gaussian(0.5, 0.5, 0.1), gaussian(0.3, 0.7, 0.15)]))
    simulator.advance(60)
    expected = [reconstruction_field(shared_coefficients(simulator, 1, team)) for team in range(2)]
    simulator.advance(1)
    np.testing.assert_allclose(simulator.capture_field[1], expected, atol=1e-4)


def test_the_potential_has_the_controllers_own_weights_and_the_metric_those_of_the_rules():
    simulator = Simulator(SLOW.replace(capture=CaptureConfig(enabled=False)))
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
    seen = [reference.basis(place) for place in simulator.positions[0][simulator.teams[0] == 1]]
    np.testing.assert_allclose(metric.coefficients[0], np.mean(seen, axis=0), atol=1e-9)
    expected = reference.ergodic_metric(np.mean(seen, axis=0), simulator.games.coefficients[0, 1])
    assert metric.value()[0] == pytest.approx(expected)


def test_the_gradient_is_that_of_the_potential(game):
    values, gradient = potential(game, 1, 0, 400)
    by_y, by_x = np.gradient(values, 1 / 400)
    inside = slice(1, -1)
    scale = np.abs(gradient).max()
    np.testing.assert_allclose(gradient[inside, inside, 0], by_x[inside, inside], atol=2e-3 * scale)
    np.testing.assert_allclose(gradient[inside, inside, 1], by_y[inside, inside], atol=2e-3 * scale)


def test_a_smooth_density_comes_back_from_its_coefficients():
    k = np.arange(10)
    truth = np.exp(-((CENTRES[None] - 0.45) ** 2 + (CENTRES[:, None] - 0.6) ** 2) / (2 * 0.12**2))
    truth /= truth.mean()
    cosines = np.cos(np.pi * np.outer(k, CENTRES))
    phi = cosines @ truth.T @ cosines.T / 50**2
    np.testing.assert_allclose(reconstruct(phi, 50), truth, atol=0.01 * truth.max())


def test_the_smooth_picture_of_a_point_is_nowhere_negative():
    point = basis([0.31, 0.77], 10)
    assert reconstruct(point, 50).min() < -1.0
    image = reconstruct(point, 50, smooth=True)
    assert image.min() >= -1e-9
    assert image.mean() == pytest.approx(1.0)
    row, column = np.unravel_index(image.argmax(), image.shape)
    assert (CENTRES[column], CENTRES[row]) == pytest.approx((0.31, 0.77), abs=0.01)


def test_the_metric_counts_every_drone_for_the_team_it_was_of():
    simulator = Simulator(GameConfig(drones_per_team=4), num_games=2)
    simulator.reset([0, 1])
    simulator.command(1, np.stack([gaussian(0.2, 0.2, 0.1)] * 2))
    metric, latest = ErgodicMetric(simulator, team=1), ErgodicMetric(simulator, team=1, window=3)
    seen = []
    for tick in range(8):
        simulator.advance(1)
        simulator.games.teams[0, 0] = tick % 2
        for one in (metric, latest):
            one.observe()
        seen.append([reference.basis(p) for p, t in zip(simulator.positions[0], simulator.teams[0], strict=True) if t])
    phi = simulator.games.coefficients[0, 1]
    for one, past in ((metric, seen), (latest, seen[-3:])):
        expected = reference.ergodic_metric(np.mean([place for moment in past for place in moment], axis=0), phi)
        assert one.value()[0] == pytest.approx(expected, rel=1e-9)


def test_a_failed_drone_counts_for_nobody():
    simulator = Simulator(GameConfig(drones_per_team=(2, 0), capture=CaptureConfig(enabled=False)))
    simulator.reset([0])
    simulator.games.failed[0, 1] = True
    metric = ErgodicMetric(simulator, team=0)
    metric.observe()
    np.testing.assert_allclose(metric.coefficients[0], basis(simulator.positions[0, 0], 10))


def test_a_team_without_drones_has_no_coefficients():
    simulator = Simulator(GameConfig(drones_per_team=(2, 0), capture=CaptureConfig(enabled=False)))
    metric = ErgodicMetric(simulator, team=1)
    metric.observe()
    assert np.isnan(metric.value()).all()
    with pytest.raises(CommandError, match="team 1 of game 0 must have drones"):
        shared_coefficients(simulator, 0, 1)


def test_a_flock_has_no_potential():
    simulator = Simulator(GameConfig(controllers=("ergodic", "flocking")))
    with pytest.raises(CommandError, match="blue is flown by flocking"):
        potential(simulator, 0, 1, cells=5)
    simulator.reset(swapped=True)
    with pytest.raises(CommandError, match="red is flown by flocking"):
        potential(simulator, 0, 0, cells=5)
    assert np.isfinite(potential(simulator, 0, 1, cells=5)[0]).all()


def test_the_metric_compares_with_a_density_whatever_its_mass_is_to_the_controller():
    found = []
    for mass in (1.0, 10.0):
        simulator = Simulator(GameConfig(controller=ControllerConfig(target_mass=mass)))
        simulator.reset([0])
        simulator.command(0, np.eye(10)[None])
        metric = ErgodicMetric(simulator, 0)
        metric.observe()
        found.append(metric.value())
    np.testing.assert_allclose(*found, rtol=1e-5)
