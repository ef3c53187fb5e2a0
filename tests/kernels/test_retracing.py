"""Where drones are taken to have been between two looks at them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from swarm_pz.config import DynamicsConfig, GameConfig, MemoryConfig
from swarm_pz.errors import CommandError
from swarm_pz.simulator import Simulator
from tests.reference import cell_of, ring_sums

FORGETFUL = MemoryConfig(trail=1.0, trail_forgotten_on=("capture",))


def under_way(config, seconds=3):
    """Return two games in which there are trails."""
    simulator, chance = Simulator(config, 2), np.random.default_rng(0)
    simulator.reset([3, 4])
    for _ in range(seconds):
        for team in range(2):
            simulator.command(team, chance.random((2, 10, 10)) ** 8)
        simulator.advance(30)
    return simulator


def assert_fields_of_trails(simulator, row):
    for team in range(2):
        cells = simulator.games.trails[row][:, simulator.games.teams[row] == team]
        sums, counts = ring_sums(np.bincount(cells[cells >= 0], minlength=2500).reshape(50, 50))
        np.testing.assert_allclose(simulator.capture_field[row, team], sums / counts, rtol=1e-12)


@pytest.mark.parametrize(
    ("config", "ticks"),
    [
        (GameConfig(drones_per_team=4), 30),
        (GameConfig(drones_per_team=4, memory=FORGETFUL, dynamics=DynamicsConfig(speed_factor=0.5)), 7),
        (GameConfig(drones_per_team=130), 7),
    ],
    ids=["usual", "forgetful", "many"],
)
def test_a_game_comes_to_what_was_seen_by_cubics_and_its_trails_and_fields_with_it(config, ticks):
    simulator, chance = under_way(config), np.random.default_rng(1)
    before, n = simulator.snapshot(), config.num_drones
    positions = chance.random((n, 2)).astype(np.float32)
    velocities = chance.normal(size=(n, 2)).astype(np.float32)
    teams = before.teams[1].copy()
    changed = [int(np.flatnonzero(teams == team)[0]) for team in range(2)]
    teams[changed] = 1 - teams[changed]
    simulator.retrace(ticks, positions[None], velocities[None], teams[None], [1])
    games = simulator.games
    for name, array, old in zip(games._fields, games, before, strict=True):
        np.testing.assert_array_equal(array[0], old[0], err_msg=name)  # the other game
        if name in ("memory", "memory_weight"):
            array, old = (np.delete(one, changed, axis=-1) for one in (array, old))
        if name in ("accelerations", "altitudes", "targets", "coefficients", "seeds", "memory", "memory_weight"):
            np.testing.assert_array_equal(array[1], old[1], err_msg=name)
    for name, expected in (("positions", positions), ("velocities", velocities), ("teams", teams)):
        np.testing.assert_array_equal(getattr(games, name)[1], expected)
    assert games.ticks[1] == before.ticks[1] + ticks
    np.testing.assert_array_equal(games.captures[1] - before.captures[1], [1, 1])
    taken_at = before.capture_ticks[1].copy()
    taken_at[changed] = before.ticks[1] + ticks
    np.testing.assert_array_equal(games.capture_ticks[1], taken_at)
    assert not games.memory_weight[1, changed].any()
    # Positions in between, from the definition of the cubic.
    ends = np.stack([before.positions[1], positions]).astype(float)
    slopes = np.stack([before.velocities[1], velocities]).astype(float) * config.dynamics.speed_factor
    path = CubicHermiteSpline([0.0, ticks / 30], ends, slopes)(np.arange(1, ticks + 1) / 30).clip(0.0, 1.0)
    for drone in range(n):
        trail = before.trails[1, :, drone].copy()
        for step, place in enumerate(path[:, drone]):
            slot = (before.ticks[1] + step) % config.trail_ticks
            row, column = cell_of(place.astype(np.float32))
            is_clear = np.abs(50 * place - np.rint(50 * place)).min() > 1e-3  # rounding decides nothing
            trail[slot] = 50 * row + column if is_clear else games.trails[1, slot, drone]
        if drone in changed and config.memory.trail_forgotten_on:
            trail[:] = -1
        np.testing.assert_array_equal(games.trails[1, :, drone], trail)
    assert_fields_of_trails(simulator, 1)


@pytest.mark.parametrize("rate", [0.0, 0.1])
def test_where_drones_fail_who_is_at_rest_where_it_was_has_failed_and_leaves_no_trail(rate):
    simulator = under_way(GameConfig(drones_per_team=2, dynamics=DynamicsConfig(failure_rate=rate)))
    for _ in range(2):  # of whom the last one stands, the second stands for the first look, the first never
        seen = [array[0].copy() for array in (simulator.positions, simulator.velocities, simulator.teams)]
        seen[0][0] = 1.0 - seen[0][0]
        seen[1][3] = 0.0
        seen[1][1] = 0.0 if simulator.time_s[0] < 4.0 else -0.0625
        seen[1][2] = [0.0, 0.0625]
        simulator.retrace(30, *(array[None] for array in seen), [0])
    games, fails = simulator.games, rate > 0.0
    assert games.failed[0].tolist() == [False, False, False, fails]
    newest = games.trails[0][(games.ticks[0] - np.arange(60)[::-1] - 1) % simulator.config.trail_ticks]
    left = (newest >= 0).reshape(2, 30, 4)
    assert left.all(axis=1).tolist() == [[True, not fails, True, not fails], [True, True, True, not fails]]
    assert_fields_of_trails(simulator, 0)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("ticks", 0, "ticks must be a whole number from 1 to 1,000,000, got 0"),
        ("ticks", 2**70, "ticks"),
        ("ticks", 1.5, "ticks"),
        ("ticks", True, "ticks"),
        ("positions", np.full((2, 4, 2), np.nan), "seen positions"),
        ("positions", np.full((2, 4, 2), 1.01), "seen positions"),
        ("positions", np.zeros((2, 3, 2)), "got shape"),
        ("velocities", np.full((2, 4, 2), np.inf), "seen velocities"),
        ("velocities", np.full((2, 4, 2), -2e6), "seen velocities"),
        ("teams", np.full((2, 4), 2), "seen teams"),
        ("teams", np.full((2, 4), 0.5), "seen teams"),
        ("rows", [0, 2], "rows"),
        ("rows", [1, 1], "different games"),
    ],
)
def test_what_no_drone_can_be_is_refused_and_no_game_is_changed(name, value, said):
    simulator = under_way(GameConfig(drones_per_team=2), seconds=1)
    before = simulator.snapshot()
    seen = {"ticks": 30, "positions": np.zeros((2, 4, 2)), "velocities": np.zeros((2, 4, 2)), "teams": np.eye(2, 4)}
    with pytest.raises(CommandError, match=said):
        simulator.retrace(**(seen | {name: value}))
    for array, old in zip(simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, old)
