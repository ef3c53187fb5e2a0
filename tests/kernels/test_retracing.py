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
    """Return a game in which there are trails."""
    simulator = Simulator(config, 2)
    simulator.reset([3, 4])
    chance = np.random.default_rng(0)
    for _ in range(seconds):
        for team in range(2):
            simulator.command(team, chance.random((2, 10, 10)) ** 8)
        simulator.advance(30)
    return simulator


@pytest.mark.parametrize("ticks", [30, 7])
@pytest.mark.parametrize(
    "config",
    [
        GameConfig(drones_per_team=4),
        GameConfig(drones_per_team=4, memory=FORGETFUL, dynamics=DynamicsConfig(speed_factor=0.5)),
        GameConfig(drones_per_team=130),
    ],
)
def test_a_game_comes_to_what_was_seen_by_cubics_and_its_trails_and_fields_with_it(config, ticks):
    simulator, chance = under_way(config), np.random.default_rng(1)
    before = simulator.snapshot()
    n = config.num_drones
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
    np.testing.assert_array_equal(games.positions[1], positions)
    np.testing.assert_array_equal(games.velocities[1], velocities)
    np.testing.assert_array_equal(games.teams[1], teams)
    assert games.ticks[1] == before.ticks[1] + ticks
    np.testing.assert_array_equal(games.captures[1] - before.captures[1], [1, 1])
    np.testing.assert_array_equal(games.capture_ticks[1, changed], before.ticks[1] + ticks)
    kept = np.delete(np.arange(n), changed)
    np.testing.assert_array_equal(games.capture_ticks[1, kept], before.capture_ticks[1, kept])
    assert not games.memory_weight[1, changed].any()
    # Positions in between, from the definition of the cubic.
    speed = config.dynamics.speed_factor
    ends = np.stack([before.positions[1], positions]).astype(float)
    slopes = np.stack([before.velocities[1], velocities]).astype(float) * speed
    path = CubicHermiteSpline([0.0, ticks / 30], ends, slopes)(np.arange(1, ticks + 1) / 30).clip(0.0, 1.0)
    length = config.trail_ticks
    for drone in range(n):
        trail = before.trails[1, :, drone].copy()
        for step, place in enumerate(path[:, drone]):
            slot = (before.ticks[1] + step) % length
            row, column = cell_of(place.astype(np.float32))
            found = games.trails[1, slot, drone]
            if np.abs(50 * place - np.rint(50 * place)).min() > 1e-3:  # rounding decides nothing
                trail[slot] = 50 * row + column
            else:
                trail[slot] = found
        if drone in changed and config.memory.trail_forgotten_on:
            trail[:] = -1
        np.testing.assert_array_equal(games.trails[1, :, drone], trail)
    for team in range(2):
        cells = games.trails[1][:, teams == team]
        occupancy = np.bincount(cells[cells >= 0], minlength=2500).reshape(50, 50)
        sums, counts = ring_sums(occupancy)
        np.testing.assert_allclose(simulator.capture_field[1, team], sums / counts, rtol=1e-12)


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
    games = simulator.games
    fails = rate > 0.0
    assert games.failed[0].tolist() == [False, False, False, fails]
    newest = games.trails[0][(games.ticks[0] - np.arange(60)[::-1] - 1) % simulator.config.trail_ticks]
    left = (newest >= 0).reshape(2, 30, 4)
    assert left.all(axis=1).tolist() == [[True, not fails, True, not fails], [True, True, True, not fails]]
    for team in range(2):
        cells = games.trails[0][:, games.teams[0] == team]
        sums, counts = ring_sums(np.bincount(cells[cells >= 0], minlength=2500).reshape(50, 50))
        np.testing.assert_allclose(simulator.capture_field[0, team], sums / counts, rtol=1e-12)


def test_where_drones_really_flew_the_trails_are_nearly_theirs():
    simulator = under_way(GameConfig(), seconds=6)
    seen = Simulator(GameConfig(), 2)
    seen.restore(simulator.snapshot())
    for _ in range(5):
        simulator.advance(30)
        seen.retrace(30, simulator.positions.copy(), simulator.velocities.copy(), simulator.teams.copy())
    true, taken = (np.stack(np.divmod(one.games.trails.astype(int), 50)) for one in (simulator, seen))
    assert np.abs(true - taken).max(axis=0).mean() < 0.7  # cells
    np.testing.assert_array_equal(seen.games.ticks, simulator.games.ticks)


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("ticks", 0, "ticks must be a whole number from 1 to 1,000,000, got 0"),
        ("ticks", 2**70, "ticks must be"),
        ("ticks", -3, "ticks must be"),
        ("ticks", 1.5, "ticks must be"),
        ("ticks", True, "ticks must be"),
        ("positions", np.full((2, 4, 2), np.nan), r"seen positions must be numbers in \[0, 1\] of shape \(2, 4, 2\)"),
        ("positions", np.full((2, 4, 2), 1.01), "seen positions"),
        ("positions", np.zeros((2, 3, 2)), "got shape"),
        ("positions", "here", "seen positions"),
        ("velocities", np.full((2, 4, 2), np.inf), "seen velocities"),
        ("velocities", np.full((2, 4, 2), 2e6), "seen velocities"),
        ("velocities", np.full((2, 4, 2), -2e6), "seen velocities"),
        ("velocities", np.zeros((1, 4, 2)), "got shape"),
        ("teams", np.full((2, 4), 2), r"seen teams must be numbers in \[0, 1\]"),
        ("teams", np.full((2, 4), 0.5), r"seen teams must be 0 \(red\) or 1 \(blue\)"),
        ("teams", np.zeros((2, 4, 1)), "got shape"),
        ("rows", [0, 2], "rows must be"),
        ("rows", [1, 1], r"rows must be different games, got \[1, 1\]"),
    ],
)
def test_what_no_drone_can_be_is_refused_and_no_game_is_changed(name, value, said):
    simulator = under_way(GameConfig(drones_per_team=2))
    before = simulator.snapshot()
    seen = {"ticks": 30, "positions": np.zeros((2, 4, 2)), "velocities": np.zeros((2, 4, 2)), "teams": np.eye(2, 4)}
    with pytest.raises(CommandError, match=said):
        simulator.retrace(**(seen | {name: value}))
    for array, old in zip(simulator.games, before, strict=True):
        np.testing.assert_array_equal(array, old)
