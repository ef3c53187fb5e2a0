"""State after a tick, with any options."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numba import njit

from swarm_pz.config import CaptureConfig, ControllerConfig, DynamicsConfig, GameConfig, MemoryConfig
from swarm_pz.kernels.trails import cell_of
from swarm_pz.simulator import Simulator

FAILING = DynamicsConfig(failure_rate=1.0, repair_rate=3.0)
HEAVY = ControllerConfig(warm_start=True, target_mass=10.0)
"""With it, as in `released`, many drones need no machine code of their own."""


@pytest.mark.parametrize(
    ("drones", "options"),
    [
        (255, {}),
        (20, {"dynamics": FAILING}),
        (20, {"dynamics": FAILING, "memory": MemoryConfig(trail=1.0, trail_forgotten_on=("capture", "command"))}),
        (300, {"memory": MemoryConfig(trail=1.0, trail_forgotten_on=("command",))}),
        (300, {"dynamics": FAILING, "memory": MemoryConfig(trail_forgotten_on=("capture",)), "controller": HEAVY}),
    ],
    ids=["many", "failing", "forgetful", "many on command", "many failing on capture"],
)
def test_what_fields_are_made_of_is_always_that_of_the_trails(drones, options):
    """Ticks only update the occupancy, so a missed change would last."""
    simulator = Simulator(GameConfig(drones_per_team=(drones // 2, drones - drones // 2), **options))
    simulator.reset([1])
    generator, captures = np.random.default_rng(1), 0
    for tick in range(100):
        if tick % 20 == 0:
            simulator.command(tick // 20 % 2, generator.random((1, 10, 10)) ** 4)
        simulator.advance(1)
        if tick % 25 != 24 and simulator.games.captures.sum() == captures:
            continue
        captures = simulator.games.captures.sum()
        for team in range(2):
            trails = simulator.games.trails[0][:, simulator.teams[0] == team]
            counted = np.bincount(trails[trails >= 0], minlength=2500).reshape(50, 50)
            np.testing.assert_array_equal(simulator.occupancy[0, team], counted)
    assert captures > 0


def test_controllers_choose_accelerations_ten_times_a_second_and_they_are_held_between():
    simulator = Simulator()
    simulator.reset([0])
    for tick in range(12):
        before = simulator.games.accelerations.copy()
        simulator.advance(1)
        changed = (simulator.games.accelerations != before).any(axis=-1)
        assert changed.any() if tick % 3 == 0 else not changed.any(), f"tick {tick}"


def mixed(state: int, number: int) -> int:
    """Return a step of SplitMix64, in Python's integers."""
    full = 2**64 - 1
    x = ((state ^ number) + 0x9E3779B97F4A7C15) & full
    x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & full
    x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & full
    return x ^ (x >> 31)


def drawn(seed: int, *what: int) -> float:
    for number in what:
        seed = mixed(seed, number)
    return (seed >> 11) / 2**53


def test_who_fails_and_returns_is_drawn_from_the_seed_for_every_drone_at_every_solve():
    simulator = Simulator(
        GameConfig(drones_per_team=6, dynamics=FAILING, capture=CaptureConfig(enabled=False)), num_games=2
    )
    simulator.reset([3, 4])
    chance, failed = 1 - np.exp([-0.1, -0.3]), np.zeros((2, 12), np.bool_)
    changes = 0
    for tick in range(0, 90, 3):
        for game, drone in np.ndindex(2, 12):
            luck = drawn(int(simulator.games.seeds[game]), 0, tick, drone, 0)
            failed[game, drone] = luck >= chance[1] if failed[game, drone] else luck < chance[0]
        changes += (failed != simulator.failed).sum()
        simulator.advance(3)
        np.testing.assert_array_equal(simulator.failed, failed)
    assert changes > 50


def test_every_number_is_in_a_cell():
    """Else a drone at NaN would write outside the board and end the process."""
    expected = {math.nan: 0, -math.inf: 0, -1.0: 0, -0.0: 0, 0.5: 25, 1.0: 49, 2.0: 49, 1e30: 49, math.inf: 49}
    find = njit(lambda x, y: cell_of(x, y))
    for (x, column), (y, row) in zip(expected.items(), reversed(expected.items()), strict=True):
        assert find(np.float32(x), np.float32(y)) == row * 50 + column, (x, y)
