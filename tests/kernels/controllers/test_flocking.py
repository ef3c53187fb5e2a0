"""The flocking controller beside its slow reference, and in scenes of its own."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import ControllerConfig, DynamicsConfig, FlockingConfig, GameConfig
from swarm_pz.simulator import Simulator
from swarm_pz.systems import FlockingCommand
from tests.kernels.controllers.mirrors import assert_attractors_serve, assert_flock_mirrored, attractors_of
from tests.kernels.states import PEACE, SOFT, random_state, solved
from tests.reference_variants import FlockingReference

FREE = ControllerConfig(max_acceleration=100.0)
"""No acceleration is saturated: nothing is hidden."""


@pytest.mark.parametrize("controller", [SOFT, ControllerConfig()], ids=["free", "saturated"])
def test_it_does_what_its_slow_mirror_does(controller):
    generator, compared, drones = np.random.default_rng(0), 0, 0
    for _ in range(40):
        state = random_state(generator, int(generator.integers(1, 31)), spread=float(generator.choice([0.05, 0.3, 1])))
        state.velocities[: generator.integers(3)] = 0.0
        simulator = solved(state, controllers="flocking", controller=controller)
        assert_attractors_serve(simulator, state.commands)
        compared += assert_flock_mirrored(simulator, state, FlockingReference())
        drones += len(state.teams)
    assert compared > 0.9 * drones


def test_every_weight_radius_and_limit_matches_the_reference():
    # With weak attractors, so that what team-mates do counts.
    generator = np.random.default_rng(1)
    compared, drones = 0, 0
    for _ in range(40):
        state = random_state(generator, int(generator.integers(2, 31)), spread=float(generator.choice([0.1, 0.3])))
        numbers = dict(zip(("alignment", "cohesion", "separation"), generator.uniform(0, [5, 5, 0.05]), strict=True))
        numbers |= {
            "communication_radius": generator.uniform(0.05, 0.3),
            "separation_radius": generator.uniform(0.01, 0.1),
            "max_turn": generator.uniform(0.1, 3.0),
            "speed": generator.uniform(0.1, 0.5),
        }
        failed = generator.random(len(state.teams)) < 0.2  # nobody follows or avoids these
        state.velocities[failed] = 0.0
        options = {"flocking": FlockingConfig(migration=(0.5, 2.0), **numbers), "controller": FREE}
        simulator = solved(state, failed, controllers="flocking", dynamics=DynamicsConfig(failure_rate=1e-9), **options)
        assert not simulator.games.accelerations[0, failed].any()
        compared += assert_flock_mirrored(simulator, state, FlockingReference(**numbers), failed)
        drones += len(state.teams)
    assert compared > 0.9 * drones


# --- scenes -----------------------------------------------------------------------------------------------------------


def flock(positions, velocities=None, attractor=(0.5, 0.5, 50.0), ticks=1, **options) -> Simulator:
    """Let one flock fly towards an attractor."""
    simulator = Simulator(
        GameConfig(drones_per_team=(len(positions), 0), capture=PEACE, controllers="flocking", **options)
    )
    still = np.zeros((len(positions), 2))
    simulator.reset([0], scenario={"positions": positions, "velocities": still if velocities is None else velocities})
    simulator.command(0, [FlockingCommand(position=attractor[:2], weight=attractor[2])])
    simulator.advance(ticks)
    return simulator


def test_a_drone_at_rest_flies_straight_to_the_attractor_as_hard_as_it_may():
    accelerations = flock([(0.2, 0.5)], attractor=(0.9, 0.5, 50.0)).games.accelerations[0]
    np.testing.assert_allclose(accelerations, [[1.0, 0.0]], atol=1e-5)


@pytest.mark.parametrize("side", [-1, 1])
def test_a_flock_turns_eighteen_degrees_a_control_period_and_keeps_its_speed(side):
    simulator = flock([(0.5, 0.5)], [(0.25, 0.0)], attractor=(0.1, 0.5 + 0.05 * side, 100.0), ticks=3)
    turned = 0.25 * np.array([np.cos(np.pi / 10), side * np.sin(np.pi / 10)])
    np.testing.assert_allclose(simulator.velocities[0, 0], turned, atol=1e-5)


def test_drones_that_are_too_close_fly_apart():
    accelerations = flock([(0.49, 0.5), (0.51, 0.5)]).games.accelerations[0]
    assert accelerations[0, 0] < -0.9
    assert accelerations[1, 0] > 0.9


def test_two_drones_in_one_place_stay_finite():
    simulator = flock([(0.25, 0.25)] * 2, ticks=90)
    assert np.isfinite(simulator.positions).all()


# --- commands ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        (np.zeros((10, 10)), (0.5, 0.5, 50.0)),
        (np.full((10, 10), 0.7), (0.5, 0.5, 50.0)),
        (np.eye(10)[:, :1] @ np.eye(10)[:1], (0.05, 0.05, 100.0)),
        (np.fliplr(np.diag([0, 1.0, 0, 0, 0, 0, 0, 0, 1, 0])), (0.85, 0.15, 75.0)),  # of equals, the lower row
    ],
)
def test_attractors_of_known_densities(command, expected):
    simulator = Simulator(GameConfig(controllers="flocking"))
    simulator.reset([0])
    np.testing.assert_allclose(attractors_of(simulator)[0], [(0.5, 0.5, 50.0)] * 2)
    simulator.command(1, command[None])
    simulator.advance(1)
    np.testing.assert_allclose(attractors_of(simulator)[0], [(0.5, 0.5, 50.0), expected], rtol=1e-6)
