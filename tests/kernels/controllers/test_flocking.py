"""The flocking controller beside its slow reference, and in scenes of its own."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import ControllerConfig, DynamicsConfig, FlockingConfig, GameConfig
from swarm_pz.errors import CommandError
from swarm_pz.simulator import Simulator
from swarm_pz.systems import FlockingCommand
from tests.kernels.controllers.mirrors import assert_attractors_serve, assert_flock_mirrored, attractors_of
from tests.kernels.states import PEACE, SOFT, random_state, solved
from tests.reference_variants import FlockingReference, strongest_mode

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
        config = FlockingConfig(migration=(0.5, 2.0), **numbers)
        simulator = solved(state, controllers="flocking", controller=FREE, flocking=config)
        assert_attractors_serve(simulator, state.commands)
        compared += assert_flock_mirrored(simulator, state, FlockingReference(**numbers))
        drones += len(state.teams)
    assert compared > 0.9 * drones


def test_failed_team_mates_are_neither_followed_nor_kept_away_from():
    generator = np.random.default_rng(2)
    numbers = {"alignment": 3.0, "cohesion": 3.0, "separation": 0.05}
    config = FlockingConfig(migration=(0.5, 2.0), **numbers)
    for _ in range(10):
        state = random_state(generator, 12, spread=0.2)
        failed = generator.random(12) < 0.4
        state.velocities[failed] = 0.0
        simulator = solved(
            state,
            failed,
            controllers="flocking",
            controller=FREE,
            flocking=config,
            dynamics=DynamicsConfig(failure_rate=1e-9),
        )
        np.testing.assert_array_equal(simulator.games.failed[0], failed)
        assert not simulator.games.accelerations[0, failed].any()
        assert_flock_mirrored(simulator, state, FlockingReference(**numbers), failed)


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


def test_a_drone_on_its_attractor_does_not_push():
    assert not flock([(0.5, 0.5)]).games.accelerations.any()


def test_two_drones_in_one_place_stay_finite():
    simulator = flock([(0.25, 0.25)] * 2, ticks=90)
    assert np.isfinite(simulator.positions).all()


def test_a_flock_gathers_at_its_attractor():
    positions = np.random.default_rng(0).random((20, 2))
    simulator = flock(positions, attractor=(0.3, 0.7, 80.0), ticks=300)
    assert np.linalg.norm(simulator.positions[0] - (0.3, 0.7), axis=1).mean() < 0.25


# --- commands ---------------------------------------------------------------------------------------------------------


def test_a_density_does_what_the_attractor_of_its_strongest_mode_does():
    generator = np.random.default_rng(4)
    config = GameConfig(controllers="flocking", capture=PEACE)
    for _ in range(10):
        command = generator.random((10, 10)) ** 4
        x, y, weight = strongest_mode(command)
        by_density, by_attractor = Simulator(config), Simulator(config)
        for simulator in (by_density, by_attractor):
            simulator.reset([0])
        by_density.command(0, command[None])
        by_attractor.command(0, [FlockingCommand(position=(x, y), weight=weight)])
        for simulator in (by_density, by_attractor):
            simulator.advance(3)
        np.testing.assert_allclose(by_density.positions, by_attractor.positions, atol=1e-5)
        np.testing.assert_allclose(attractors_of(by_density), attractors_of(by_attractor), rtol=1e-5)


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


def test_every_game_has_an_attractor_of_its_own():
    simulator = Simulator(GameConfig(controllers=("ergodic", "flocking")), num_games=3)
    simulator.reset(range(3))
    simulator.command(1, [FlockingCommand(position=(0.1 * e, 0.5), weight=60.0 + e) for e in range(3)])
    simulator.command(1, [FlockingCommand(position=(0.9, 0.9), weight=99.0)], rows=[1])
    simulator.command(0, np.ones((3, 10, 10)))
    simulator.advance(1)
    np.testing.assert_allclose(attractors_of(simulator)[:, 1], [(0, 0.5, 60), (0.9, 0.9, 99), (0.2, 0.5, 62)])


@pytest.mark.parametrize(
    ("team", "position", "weight", "count"),
    [
        (1, (1.5, 0.5), 60.0, 1),
        (1, (0.5, float("nan")), 60.0, 1),
        (1, (0.5, 0.5, 0.5), 60.0, 1),
        (1, (0.5, 0.5), 49.0, 1),
        (1, (0.5, 0.5), 101.0, 1),
        (1, (0.5, 0.5), float("nan"), 1),
        (1, (0.5, 0.5), "heavy", 1),
        (1, (0.5, 0.5), 60.0, 2),
        (0, (0.5, 0.5), 60.0, 1),  # that team does not flock
    ],
)
def test_bad_attractors_are_refused_and_leave_the_game_as_it_was(team, position, weight, count):
    simulator = Simulator(GameConfig(controllers=("ergodic", "flocking")))
    simulator.reset([0])
    before = simulator.snapshot()
    with pytest.raises(CommandError):
        simulator.command(team, [FlockingCommand(position=position, weight=weight)] * count)
    for array, copied in zip(simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, copied)


def test_one_flocking_command_alone_is_refused():
    simulator = Simulator(GameConfig(controllers="flocking"))
    with pytest.raises(CommandError, match="must be one for each of 1 games, got FlockingCommand"):
        simulator.command(0, FlockingCommand(position=(0.5, 0.5), weight=60.0))
