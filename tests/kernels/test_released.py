"""The options of the authors' published variant beside slow references; whole games of it: test_released_games."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import (
    CaptureConfig,
    DynamicsConfig,
    GameConfig,
    MemoryConfig,
    ObservationConfig,
)
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import at_work, shared_coefficients
from swarm_pz.spaces.observation import observe
from tests.reference import ControllerReference, cell_of
from tests.reference_variants import VariantRules, reconstruction_captures, reconstruction_field

RELEASED = GameConfig.preset("released")
PUBLISHED = ControllerReference(tau=None, q=1.0, r=1.0, speed_factor=0.8, spectrum="exponential", wall_margin=0.01)
NEAR = 1e-4
"""Values this near the threshold may be decided by rounding."""


def changed(targets: np.ndarray, previous: np.ndarray) -> np.ndarray:
    """Return whether each team's target (2, A, A) is another one."""
    return (np.abs(targets - previous) > 1e-9).any(axis=(1, 2))


def assert_captured_where_the_field_says(fields, simulator, teams_before) -> int:
    """Check who changed sides in a tick against (2, 50, 50) fields and return how many did."""
    went = simulator.teams[0] != teams_before
    for drone, position in enumerate(simulator.positions[0]):
        value = fields[1 - teams_before[drone]][cell_of(position)]
        if abs(value - simulator.config.capture.threshold) > NEAR:
            assert went[drone] == reconstruction_captures(value, simulator.config.capture.threshold)
    return int(went.sum())


def fields_of(simulator):
    """Return the fields (2, 50, 50) that a solve would give; of a team without drones at work, zeros."""
    return [
        reconstruction_field(shared_coefficients(simulator, 0, team))
        if len(at_work(simulator, 0, team))
        else np.zeros((50, 50))
        for team in range(2)
    ]


FIELD = GameConfig(capture=CaptureConfig(field="reconstruction"))


@pytest.mark.parametrize(
    "config",
    [
        FIELD.replace(capture=FIELD.capture.replace(threshold=0.5)),
        FIELD.replace(capture=FIELD.capture.replace(threshold=0.9)),
        FIELD.replace(capture=FIELD.capture.replace(threshold=0.9), dynamics=DynamicsConfig(failure_rate=0.5)),
        RELEASED.replace(controllers="flocking", time_limit=10.0),
    ],
    ids=["low", "high", "failures", "flocks"],
)
def test_fields_are_of_the_density_that_a_teams_controller_expects(config):
    simulator, generator = Simulator(config), np.random.default_rng(1)
    simulator.reset([1])
    for team in range(2):
        simulator.command(team, generator.random((1, 10, 10)) ** 4)
    captured = 0
    for tick in range(120):
        teams, failed, expected = simulator.teams[0].copy(), simulator.failed.copy(), fields_of(simulator)
        simulator.advance(1)
        if tick % 3 == 0 and (failed == simulator.failed).all():  # else others were at work in the solve
            np.testing.assert_allclose(simulator.capture_field[0], expected, atol=NEAR)
        captured += assert_captured_where_the_field_says(simulator.capture_field[0], simulator, teams)
        if simulator.decided[0]:
            break
    assert captured > 0 or config.team_controllers[0] == "flocking"


def test_an_observation_shows_192_exactly_where_a_field_captures():
    simulator = Simulator(RELEASED)
    simulator.reset([0])
    for _ in range(5):
        simulator.advance(10)
        seen = observe(
            simulator,
            ObservationConfig(channels=("own_capture_field", "opposing_capture_field")),
            np.array([0]),
            np.array([0]),
            np.ones(1),
        )
        np.testing.assert_array_equal(seen[0] >= 192, simulator.captures_here[0])


# --- each option alone ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "memory",
    [
        {"trail_forgotten_on": ("capture",)},
        {"trail_forgotten_on": ("command",)},
        {"trail_forgotten_on": ("capture", "command")},
        {"trail": None},
        {"trail": None, "trail_forgotten_on": ("capture",)},
        {"trail": 1.0, "trail_forgotten_on": ("command",)},
    ],
    ids=str,
)
def test_trails_are_forgotten_as_asked(memory):
    config = GameConfig(time_limit=15.0, memory=MemoryConfig(**memory))
    forgotten_on = config.memory.trail_forgotten_on
    seconds = {"trail": 5.0} | memory
    ticks = None if seconds["trail"] is None else round(30 * seconds["trail"])
    captured = 0
    for seed in range(2):
        simulator, generator = Simulator(config), np.random.default_rng(seed)
        simulator.reset([seed])
        rules = VariantRules(simulator.teams[0], ticks, forgotten_on_capture="capture" in forgotten_on)
        previous = simulator.targets[0].copy()
        for tick in range(450):
            if tick % 20 == 0:
                team = int(generator.integers(2))
                # Twice the same image is the same command.
                command = simulator.targets[:, team] if tick % 40 else generator.random((1, 10, 10)) ** 4
                simulator.command(team, command / command.max())
            if tick % 3 == 0:
                if "command" in forgotten_on:
                    for team in np.flatnonzero(changed(simulator.targets[0], previous)):
                        rules.command(team)
                previous = simulator.targets[0].copy()
            simulator.advance(1)
            captured += len(rules.tick(simulator.positions[0]))
            np.testing.assert_array_equal(simulator.teams[0], rules.teams)
            np.testing.assert_array_equal(simulator.occupancy[0], rules.occupancy)
            if simulator.decided[0]:
                break
    assert captured > 0


@pytest.mark.parametrize("second_thoughts", [False, True])
def test_a_command_is_a_new_one_if_it_is_new_at_the_solve(second_thoughts):
    memory = MemoryConfig(
        trail=None,
        controller=None,
        trail_forgotten_on=("capture", "command"),
        controller_forgotten_on=("capture", "command"),
    )
    simulator = Simulator(GameConfig(memory=memory, capture=CaptureConfig(enabled=False)))
    simulator.reset([0])
    first, other = np.random.default_rng(0).random((2, 1, 10, 10))
    simulator.command(0, first)
    simulator.advance(30)
    simulator.command(0, other)
    if second_thoughts:
        simulator.command(0, first / 2)
    simulator.advance(1)
    kept = 11.0 if second_thoughts else 1.0
    np.testing.assert_array_equal(simulator.games.memory_weight[0], [kept] * 10 + [11.0] * 10)
    kept = 31 if second_thoughts else 1
    np.testing.assert_array_equal(simulator.occupancy[0].sum(axis=(1, 2)), [10 * kept, 310])


@pytest.mark.parametrize("tau", [4.0, None])
@pytest.mark.parametrize("forgotten_on", [(), ("capture",), ("command",), ("capture", "command")])
def test_the_controllers_memory_is_forgotten_as_asked(tau, forgotten_on):
    config = GameConfig(memory=MemoryConfig(controller=tau, controller_forgotten_on=forgotten_on))
    simulator, generator = Simulator(config), np.random.default_rng(5)
    simulator.reset([5])
    weight, previous, captured = np.zeros(20), simulator.targets[0].copy(), 0
    decay = 1.0 if tau is None else np.exp(-0.1 / tau)
    for tick in range(450):
        if tick % 20 == 0:
            simulator.command(tick // 20 % 2, generator.random((1, 10, 10)) ** 4)
        teams = simulator.teams[0].copy()
        if tick % 3 == 0:
            if "command" in forgotten_on:
                weight[changed(simulator.targets[0], previous)[teams]] = 0.0
            previous = simulator.targets[0].copy()
            weight = decay * weight + 1.0
        simulator.advance(1)
        went = simulator.teams[0] != teams
        captured += went.sum()
        if "capture" in forgotten_on:
            weight[went] = 0.0
        np.testing.assert_allclose(simulator.games.memory_weight[0], weight, rtol=1e-4)
        # The mode k = 0 is 1 everywhere: its sum is the weight.
        np.testing.assert_allclose(simulator.games.memory[0, 0, 0], weight, rtol=1e-4)
        if simulator.decided[0]:
            break
    assert captured > 0
