"""Whole games by the published rules beside the slow reference of them, and what the newer of these rules say alone."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.mirror_released import Mirrored, play
from swarm_pz.config import CaptureConfig, ControllerConfig, GameConfig, MemoryConfig
from swarm_pz.simulator import Simulator
from tests.kernels.states import PEACE, SOFT, random_state, solved
from tests.reference import ControllerReference, saturate, target_coefficients
from tests.reference_released import ReleasedReference

RELEASED = GameConfig.preset("released")


def test_solves_and_captures_of_whole_games_are_the_references():
    # At full length: python -m benchmarks.mirror_released
    found, seed = Mirrored(), 0
    while found.solves < 150:
        play(seed, 5, found)
        seed += 1
    assert found.mismatches == 0
    assert max(found.acceleration, found.flown, found.field) < 1e-4
    assert found.captures > 5
    assert 0 < found.resent < found.commands


# --- each rule alone --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mass", [0.3, 1.0, 10.0])
def test_what_is_sent_sums_to_the_target_mass_and_what_teams_begin_with_to_1(mass):
    simulator = Simulator(GameConfig(controller=ControllerConfig(target_mass=mass)), num_games=2)
    simulator.reset([0, 1])
    uniform = np.zeros((10, 10))
    uniform[0, 0] = 1.0
    np.testing.assert_allclose(simulator.games.coefficients, np.broadcast_to(uniform, (2, 2, 10, 10)), atol=1e-6)
    density = np.random.default_rng(0).random((10, 10)) ** 3
    simulator.command(1, density[None], rows=[0])
    simulator.command(0, np.zeros((1, 10, 10)), rows=[1])
    expected = np.array([[uniform, target_coefficients(density, mass=mass)], [mass * uniform, uniform]])
    np.testing.assert_allclose(simulator.games.coefficients, expected, atol=2e-6 * max(mass, 1.0))
    simulator.reset([2], rows=[0])
    np.testing.assert_allclose(simulator.games.coefficients[0], [uniform, uniform], atol=1e-6)


@pytest.mark.parametrize("margin", [0.0, 0.01, 0.2])
@pytest.mark.parametrize("mass", [1.0, 10.0])
def test_accelerations_with_other_masses_and_walls_match_the_reference(mass, margin):
    generator = np.random.default_rng(8)
    controller = SOFT.replace(target_mass=mass, wall_margin=margin)
    for _ in range(4):
        state = random_state(generator, int(generator.integers(1, 25)))
        targets = np.stack([target_coefficients(command, mass=mass) for command in state.commands])
        reference = ControllerReference(r=SOFT.control_weight, wall_margin=margin)
        given = (state.positions, state.velocities, state.teams, state.memory, state.memory_weight)
        expected = saturate(reference.solve(*given, targets)[0], SOFT.max_acceleration)
        accelerations = solved(state, controller=controller).games.accelerations[0]
        np.testing.assert_allclose(accelerations, expected, atol=1e-4 * np.abs(expected).max())


@pytest.mark.parametrize(
    ("forgotten_on", "left"),
    [
        ((), [11.0, 11.0, 11.0]),
        (("command",), [11.0, 11.0, 1.0]),
        (("sending",), [1.0, 1.0, 1.0]),
        (("command", "sending"), [1.0, 1.0, 1.0]),
    ],
)
def test_the_memory_of_the_team_is_emptied_by_what_is_sent_the_same_again_too(forgotten_on, left):
    memory = MemoryConfig(controller=None, controller_forgotten_on=forgotten_on, trail_forgotten_on=("command",))
    first, other = np.random.default_rng(0).random((2, 1, 10, 10))
    for later, expected in zip((first, first / 2, other), left, strict=True):
        simulator = Simulator(GameConfig(memory=memory, capture=PEACE))
        simulator.reset([0])
        simulator.command(0, first)
        simulator.advance(30)
        simulator.command(0, later)
        simulator.advance(1)
        assert simulator.games.memory_weight[0].tolist() == [expected] * 10 + [11.0] * 10
        # Trails are forgotten by another command only.
        ticks = 1 if later is other else 31
        assert simulator.occupancy[0].sum(axis=(1, 2)).tolist() == [10 * ticks, 310]


def test_a_step_holds_what_is_in_force_and_sends_anything_else():
    simulator = Simulator(RELEASED.replace(capture=CaptureConfig(enabled=False, field="reconstruction")))
    simulator.reset([0])
    reference = ReleasedReference(simulator.teams[0])
    generator = np.random.default_rng(0)
    uniform, some, other = np.ones((10, 10)), *generator.random((2, 10, 10))
    steps = [0.7 * uniform, some, 0.3 * some, other, uniform, 0.9 * uniform, some]
    for second, asked in enumerate(steps):
        if second == 6:  # sent and asked for at once: it is a sending
            simulator.command(0, asked[None])
            reference.command(0, asked)
        simulator.advance(3, commands=np.stack([asked, uniform])[None])
        reference.step(0, asked)
        reference.step(1, uniform)
        reference.solve(simulator.positions[0], simulator.velocities[0])
        np.testing.assert_array_equal(simulator.games.memory_weight[0], reference.memory_weight)
        np.testing.assert_allclose(simulator.games.coefficients[0], reference.phi, atol=1e-5)
    assert simulator.games.memory_weight[0, [0, 10]].tolist() == [1.0, 7.0]
