"""The options of the authors' published variant beside slow references; whole games of it: test_released_games."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from swarm_pz.config import (
    CaptureConfig,
    ControllerConfig,
    DynamicsConfig,
    GameConfig,
    MemoryConfig,
    ObservationConfig,
    SpawnConfig,
)
from swarm_pz.simulator import Simulator
from swarm_pz.spaces.observation import observe
from tests.kernels.states import SOFT, assert_mirrored, put, random_state, solved
from tests.reference import ControllerReference, cell_of, move
from tests.reference_variants import VariantRules, reconstruction_captures, reconstruction_field

RELEASED = GameConfig.preset("released")
PUBLISHED = ControllerReference(tau=None, q=1.0, r=1.0, speed_factor=0.8, spectrum="exponential", wall_margin=0.01)
NEAR = 1e-4
"""Values this near the threshold may be decided by rounding."""


class Solve(NamedTuple):
    """What a solve of one game starts from, in the reference's order of axes."""

    positions: np.ndarray
    velocities: np.ndarray
    teams: np.ndarray
    memory: np.ndarray
    memory_weight: np.ndarray
    targets: np.ndarray
    failed: np.ndarray


def before_solve(simulator) -> Solve:
    """Copy what the coming solve starts from."""
    games = simulator.games
    memory = np.moveaxis(games.memory[0], -1, 0).astype(float)
    weight = games.memory_weight[0].astype(float)
    return Solve(
        games.positions[0].astype(float),
        games.velocities[0].astype(float),
        games.teams[0].copy(),
        memory,
        weight,
        games.coefficients[0].astype(float),
        np.zeros(len(weight), np.bool_),
    )


def fields_of(solve: Solve, reference: ControllerReference) -> np.ndarray:
    """Return both teams' fields (2, 50, 50) after a solve; of a team without drones, zeros."""
    sums, weights = reference.remember(solve.positions, solve.memory, solve.memory_weight, solve.failed)
    coefficients = reference.coefficients(reference.look_ahead(solve.positions, solve.velocities), sums, weights)
    fields = np.zeros((2, 50, 50))
    for team in range(2):
        members = (solve.teams == team) & ~solve.failed
        if members.any():
            fields[team] = reconstruction_field(coefficients[members].mean(axis=0))
    return fields


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


def test_flocks_have_fields_too():
    solves, captured = 0, 0
    for seed in range(3):
        more = play_flocks(seed)
        solves, captured = solves + more[0], captured + more[1]
    assert solves > 60


def play_flocks(seed: int) -> tuple[int, int]:
    """Play a short game of flocks beside the references; return numbers of solves and captures."""
    simulator = Simulator(RELEASED.replace(controllers="flocking", time_limit=10.0))
    simulator.reset([seed])
    generator = np.random.default_rng(seed)
    for team in range(2):
        simulator.command(team, generator.random((1, 10, 10)) ** 4)
    solves, captured, fields = 0, 0, np.zeros((2, 50, 50))
    for tick in range(120):
        teams = simulator.teams[0].copy()
        if tick % 3 == 0:
            fields = fields_of(before_solve(simulator), PUBLISHED)
            solves += 1
        simulator.advance(1)
        np.testing.assert_allclose(simulator.capture_field[0], fields, atol=NEAR)
        captured += assert_captured_where_the_field_says(fields, simulator, teams)
        if simulator.decided[0]:
            break
    return solves, captured


def test_what_the_preset_says():
    assert (
        GameConfig(
            capture=CaptureConfig(field="reconstruction"),
            memory=MemoryConfig(
                trail=None,
                controller=None,
                trail_forgotten_on=("capture", "command"),
                controller_forgotten_on=("capture", "sending"),
            ),
            controller=ControllerConfig(
                spectrum="exponential", control_weight=1.0, ergodic_weight=1.0, wall_margin=0.01, target_mass=10.0
            ),
            dynamics=DynamicsConfig(speed_factor=0.8),
            spawn=SpawnConfig(layout="squares", speed=0.2),
        )
        == RELEASED
    )
    assert RELEASED.hash != GameConfig().hash
    assert GameConfig.from_dict(RELEASED.to_dict()) == RELEASED


@pytest.mark.parametrize("threshold", [0.5, 0.9])
def test_the_field_alone_and_other_thresholds(threshold):
    config = GameConfig(capture=CaptureConfig(field="reconstruction", threshold=threshold))
    simulator = Simulator(config)
    simulator.reset([1])
    generator = np.random.default_rng(1)
    captured, fields = 0, np.zeros((2, 50, 50))
    for tick in range(120):
        if tick % 30 == 0:
            for team in range(2):
                simulator.command(team, generator.random((1, 10, 10)) ** 4)
        teams = simulator.teams[0].copy()
        if tick % 3 == 0:
            fields = fields_of(before_solve(simulator), ControllerReference())
        simulator.advance(1)
        np.testing.assert_allclose(simulator.capture_field[0], fields, atol=NEAR)
        captured += assert_captured_where_the_field_says(fields, simulator, teams)
        if simulator.decided[0]:
            break
    assert captured > 0


def test_failed_drones_count_nothing_in_the_field():
    state = random_state(np.random.default_rng(0), 12)
    failed = np.arange(12) % 3 == 0
    config = GameConfig(
        drones_per_team=6,
        capture=CaptureConfig(field="reconstruction", threshold=0.99),
        dynamics=DynamicsConfig(failure_rate=1e-9),
    )
    simulator = Simulator(config)
    put(simulator, state)
    simulator.games.failed[0] = failed
    simulator.games.velocities[0, failed] = 0.0
    solve = before_solve(simulator)._replace(failed=failed)
    simulator.advance(1)
    np.testing.assert_allclose(simulator.capture_field[0], fields_of(solve, ControllerReference()), atol=NEAR)


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


@pytest.mark.parametrize(
    ("options", "reference"),
    [
        ({"controller": SOFT.replace(spectrum="exponential")}, {"r": 20.0, "spectrum": "exponential"}),
        ({"controller": SOFT, "dynamics": DynamicsConfig(speed_factor=0.8)}, {"r": 20.0, "speed_factor": 0.8}),
        ({"controller": SOFT, "dynamics": DynamicsConfig(speed_factor=1.7)}, {"r": 20.0, "speed_factor": 1.7}),
        ({"controller": SOFT, "memory": MemoryConfig(controller=None)}, {"r": 20.0, "tau": None}),
        ({"controller": RELEASED.controller}, {"q": 1.0, "r": 1.0, "spectrum": "exponential", "wall_margin": 0.01}),
    ],
    ids=["exponential", "slow", "fast", "for ever", "published gains"],
)
def test_accelerations_match_the_reference(options, reference):
    generator = np.random.default_rng(6)
    for _ in range(8):
        state = random_state(generator, int(generator.integers(1, 25)))
        assert_mirrored(solved(state, **options), state, ControllerReference(**reference))


@pytest.mark.parametrize("factor", [0.8, 1.3])
def test_motion_with_a_speed_factor_matches_the_reference(factor):
    generator = np.random.default_rng(7)
    for _ in range(10):
        state = random_state(generator, 40)
        simulator = solved(state, dynamics=DynamicsConfig(speed_factor=factor))
        accelerations = simulator.games.accelerations[0].astype(float)
        positions, velocities = move(state.positions, state.velocities, accelerations, speed_factor=factor)
        np.testing.assert_allclose(simulator.positions[0], positions, atol=1e-6)
        np.testing.assert_allclose(simulator.velocities[0], velocities, atol=1e-5)


@pytest.mark.parametrize(("inset", "side"), [(0.1, 0.1), (0.05, 0.3)])
def test_teams_start_in_squares_of_their_own(inset, side):
    spawn = SpawnConfig(layout="squares", inset=inset, side=side, radius=0.0)
    simulator = Simulator(GameConfig(drones_per_team=(8, 12), spawn=spawn), num_games=100)
    simulator.reset(range(100))
    red, blue = simulator.positions[:, :8].reshape(-1, 2), 1.0 - simulator.positions[:, 8:].reshape(-1, 2)
    for places in (red, blue):
        np.testing.assert_array_less(inset - 1e-6, places)
        np.testing.assert_array_less(places, inset + side + 1e-6)
        # Uniform: mean and standard deviation on both axes, each axis by itself.
        np.testing.assert_allclose(places.mean(axis=0), inset + side / 2, atol=0.1 * side)
        np.testing.assert_allclose(places.std(axis=0), side / np.sqrt(12), rtol=0.1)
        assert abs(np.corrcoef(places.T)[0, 1]) < 0.15
    assert not simulator.velocities.any()
    assert all(len(set(row)) == 20 for row in simulator.altitudes.tolist())
