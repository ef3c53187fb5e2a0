"""Each option of the preset `released` alone; `tests/test_golden.py` plays whole games with the preset."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, DynamicsConfig, GameConfig, MemoryConfig, ObservationConfig
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import at_work, shared_coefficients
from swarm_pz.spaces.observation import observe
from tests.reference import RuleReference, cell_of, reconstruction_field

RELEASED = GameConfig.preset("released")
PEACE = CaptureConfig(enabled=False)
NEAR = 1e-4
"""Values this near the threshold may be decided by rounding."""


FIELD = CaptureConfig(field="reconstruction", threshold=0.9)


@pytest.mark.parametrize(
    "config",
    [
        GameConfig(capture=FIELD.replace(threshold=0.5)),
        GameConfig(capture=FIELD, dynamics=DynamicsConfig(failure_rate=0.5)),
        RELEASED.replace(controllers="flocking", time_limit=10.0),
    ],
    ids=["low", "failures", "flocks"],
)
def test_fields_are_of_the_density_that_a_teams_controller_expects(config):
    simulator, generator, captured = Simulator(config), np.random.default_rng(1), 0
    simulator.reset([1])
    for team in range(2):
        simulator.command(team, generator.random((1, 10, 10)) ** 4)
    for tick in range(90):
        teams, failed = simulator.teams[0].copy(), simulator.failed.copy()
        some = [len(at_work(simulator, 0, team)) > 0 for team in range(2)]
        expected = [reconstruction_field(shared_coefficients(simulator, 0, team)) if some[team] else np.zeros((50, 50))
                    for team in range(2)] if tick % 3 == 0 else None  # fmt: skip
        simulator.advance(1)
        if expected is not None and (failed == simulator.failed).all():  # else other drones took part in the solve
            np.testing.assert_allclose(simulator.capture_field[0], expected, atol=NEAR)
        values = simulator.capture_field[0][1 - teams, *cell_of(simulator.positions[0])]
        went, clear = simulator.teams[0] != teams, np.abs(values - config.capture.threshold) > NEAR
        captured += went.sum()
        np.testing.assert_array_equal(went[clear], (values >= config.capture.threshold)[clear])
        if simulator.decided[0]:
            break
    assert captured > 0 or config.team_controllers[0] == "flocking"
    observation = ObservationConfig(channels=("own_capture_field", "opposing_capture_field"))
    fields = observe(simulator, observation, np.array([0]), np.array([0]))[0]
    np.testing.assert_array_equal(fields >= 192, simulator.captures_here[0])


# --- each option alone ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("second_thoughts", [False, True])
def test_a_command_is_a_new_one_if_it_is_new_at_the_solve(second_thoughts):
    both = ("capture", "command")
    memory = MemoryConfig(controller=None, trail_forgotten_on=both, controller_forgotten_on=both)
    simulator = Simulator(GameConfig(memory=memory, capture=PEACE))
    simulator.reset([0])
    first, other = np.random.default_rng(0).random((2, 1, 10, 10))
    simulator.command(0, first)
    simulator.advance(30)
    simulator.command(0, other)
    if second_thoughts:
        simulator.command(0, first / 2)
    simulator.advance(1)
    solves, ticks = (11, 31) if second_thoughts else (1, 1)
    np.testing.assert_array_equal(simulator.games.memory_weight[0], [solves] * 10 + [11] * 10)
    np.testing.assert_array_equal(simulator.occupancy[0].sum(axis=(1, 2)), [10 * ticks, 310])


@pytest.mark.parametrize(("tau", "forgotten_on"), [(4.0, ()), (None, ("capture",)), (4.0, ("capture", "command"))])
def test_trails_and_controllers_memories_are_forgotten_as_asked(tau, forgotten_on):
    memory = MemoryConfig(controller=tau, trail_forgotten_on=forgotten_on, controller_forgotten_on=forgotten_on)
    simulator, generator = Simulator(GameConfig(memory=memory)), np.random.default_rng(5)
    simulator.reset([5])
    weight, previous, rules = np.zeros(20), simulator.targets[0].copy(), RuleReference(simulator.teams[0])
    decay = 1.0 if tau is None else np.exp(-0.1 / tau)
    for tick in range(200):
        if tick % 20 == 0:
            simulator.command(tick // 20 % 2, generator.random((1, 10, 10)) ** 4)
        if tick % 3 == 0:
            if "command" in forgotten_on:
                changed = (np.abs(simulator.targets[0] - previous) > 1e-9).any(axis=(1, 2))
                weight[changed[rules.teams]], rules.trails[:, changed[rules.teams]] = 0.0, -1
            previous = simulator.targets[0].copy()
            weight = decay * weight + 1.0
        simulator.advance(1)
        lost = rules.tick(simulator.positions[0])
        if "capture" in forgotten_on:
            weight[lost], rules.trails[:, lost] = 0.0, -1
        np.testing.assert_array_equal(simulator.teams[0], rules.teams)
        np.testing.assert_array_equal(simulator.occupancy[0], rules.occupancy)
        np.testing.assert_allclose(simulator.games.memory_weight[0], weight, rtol=1e-4)
        # The mode k = 0 is 1 everywhere: its sum is the weight.
        np.testing.assert_allclose(simulator.games.memory[0, 0, 0, : len(weight)], weight, rtol=1e-4)
        if simulator.decided[0]:
            break
    assert sum(rules.captures) > 0
