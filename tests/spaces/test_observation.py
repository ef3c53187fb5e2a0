from __future__ import annotations

import itertools

import numpy as np
import pytest

from swarm_pz.config import (
    CHANNELS,
    MOTION_CHANNELS,
    SOON,
    CaptureConfig,
    DynamicsConfig,
    GameConfig,
    MemoryConfig,
    ObservationConfig,
    SpawnConfig,
)
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.simulator import CheckedCommands
from swarm_pz.spaces.observation import observation_space, top_speed
from tests.reference import captures_where, cell_of, ring_sums

SUMMED, OLDEST, STRONGEST = CHANNELS[0:2], CHANNELS[2:4], CHANNELS[4:6]
TEAMS = pytest.mark.parametrize("team", [0, 1])


@pytest.fixture(scope="module")
def batch():
    batch = BatchEnv(num_games=4)
    batch.reset([0, 1, 2, 3])
    generator = np.random.default_rng(0)
    for _ in range(8):
        batch.step(generator.random((4, 2, 10, 10)) ** 3)
    return batch


def seen(batch, team, grid=50):
    images = batch.observe(ObservationConfig(grid=grid), team)
    assert images.dtype == np.uint8
    assert images.shape == (4, len(CHANNELS), grid, grid)
    return dict(zip(CHANNELS, images.swapaxes(0, 1), strict=True))


@TEAMS
def test_positions_show_64_a_drone(batch, team):
    expected = np.zeros((2, 4, 50, 50), int)
    for game in range(4):
        for position, owner in zip(batch.simulator.positions[game], batch.simulator.teams[game], strict=True):
            expected[(int(int(owner) != team), game, *cell_of(position))] += 64
    images = seen(batch, team)
    for side, name in enumerate(SUMMED):
        np.testing.assert_array_equal(images[name], np.minimum(expected[side], 255))


def bilinear(places, grid):
    """Share 64 per place among the nearest cells bilinearly; places beyond the outer centres are moved onto them."""
    centres = (np.arange(grid) + 0.5) / grid
    image = np.zeros((grid, grid))
    for place in places:
        x, y = (np.maximum(1 - grid * abs(centres - np.clip(at, centres[0], centres[-1])), 0) for at in place)
        image += np.floor(64 * np.outer(y, x) + 0.5)
    return np.minimum(image, 255)


@pytest.mark.parametrize("grid", [1, 10, 50])
@TEAMS
def test_drones_are_shown_between_cells_and_where_they_are_going(batch, team, grid):
    games = batch.simulator.games
    images = batch.observe(ObservationConfig(grid=grid, channels=MOTION_CHANNELS), team)
    for game in range(4):
        positions, velocities = (values[game].astype(float) for values in (games.positions, games.velocities))
        for channel, image in zip(MOTION_CHANNELS, images[game], strict=True):
            members = (games.teams[game] == team) == channel.startswith("own")
            seconds = SOON if channel.endswith("soon") else 0.0
            expected = bilinear((positions + seconds * velocities)[members], grid)
            np.testing.assert_allclose(image, expected, atol=1)
            assert image.any() == members.any()


def expected_ages(batch, team):
    """Brightness (2, 50, 50) of both sides' trails in the first game, 255 now and fading to 0."""
    games, length = batch.simulator.games, batch.config.trail_ticks
    expected = np.zeros((2, 2500))
    for age in range(min(length, int(games.ticks[0])) - 1, -1, -1):
        cells = games.trails[0, (games.ticks[0] - 1 - age) % length]
        for side, members in enumerate((team, 1 - team)):
            mine = cells[(games.teams[0] == members) & (cells >= 0)]
            expected[side, mine] = 255 * (length - age) / length
    return expected.reshape(2, 50, 50)


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"dynamics": DynamicsConfig(failure_rate=2.0, repair_rate=2.0)},
        {"memory": MemoryConfig(trail=1.1, trail_forgotten_on=("command",))},
        {"memory": MemoryConfig(trail=None), "time_limit": 8.0},
    ],
    ids=["usual", "failing", "forgetful", "endless"],
)
def test_trails_are_shown_as_long_as_they_are_and_with_their_gaps(options):
    batch, generator = BatchEnv(GameConfig(drones_per_team=5, **options)), np.random.default_rng(0)
    batch.reset([0])
    for _ in range(6):
        batch.step(generator.random((1, 2, 10, 10)) ** 3)
    batch.simulator.advance(2)  # between two solves
    assert (batch.simulator.games.trails[0] < 0).any() == bool(options)
    for team in range(2):
        images = batch.observe(ObservationConfig(channels=OLDEST), team)[0]
        np.testing.assert_allclose(images, expected_ages(batch, team), atol=0.51)


def test_a_clock_that_was_set_forward_shows_the_trails_that_there_are():
    batch = BatchEnv(GameConfig(drones_per_team=3))
    batch.reset([0])
    batch.step(np.ones((1, 2, 10, 10)))
    # As after more than a trail's length: unwritten entries hold -1 for no cell, which must not become an index.
    batch.simulator.games.ticks[0] = batch.config.trail_ticks + 30
    images = batch.observe(ObservationConfig(channels=OLDEST), 0)[0]
    np.testing.assert_allclose(images, expected_ages(batch, 0), atol=0.51)


@pytest.mark.parametrize(("threshold", "grid"), [(0.75, 50), (0.375, 50), (0.375, 10)])
def test_capture_fields_are_at_least_192_exactly_where_they_capture(threshold, grid):
    batch, block = BatchEnv(GameConfig(capture=CaptureConfig(threshold=threshold)), num_games=4), 50 // grid
    batch.reset(range(4))
    batch.step(np.ones((4, 2, 10, 10)))
    for game, team in np.ndindex(4, 2):
        images = batch.observe(ObservationConfig(grid=grid, channels=STRONGEST), team, [game])[0]
        for image, occupancy in zip(images, batch.simulator.occupancy[game, [team, 1 - team]], strict=True):
            captures = captures_where(occupancy, threshold).reshape(grid, block, grid, block)
            np.testing.assert_array_equal(image >= 192, captures.any(axis=(1, 3)))
            if threshold == 0.75:
                sums, counts = ring_sums(occupancy)
                np.testing.assert_allclose(image, 255 * sums / counts / (sums / counts).max(), atol=1.01)


@pytest.mark.parametrize("grid", [10, 25])
def test_coarse_grids_sum_maximise_and_average(batch, grid):
    fine, coarse = seen(batch, 1), seen(batch, 1, grid)
    block = 50 // grid
    for name in CHANNELS:
        blocks = fine[name].reshape(4, grid, block, grid, block).astype(float)
        if name in SUMMED:
            expected = np.minimum(blocks.sum(axis=(2, 4)), 255)
        else:
            expected = blocks.max(axis=(2, 4)) if name in OLDEST + STRONGEST else blocks.mean(axis=(2, 4))
        np.testing.assert_allclose(coarse[name], expected, atol=1.0, err_msg=name)


def test_a_crowd_is_as_bright_as_a_cell_can_be():
    batch = BatchEnv(GameConfig(drones_per_team=40))
    batch.reset([0])
    batch.simulator.games.positions[:] = 0.5
    for channel in ("own_now", "own_positions"):
        assert (batch.observe(ObservationConfig(grid=1, channels=(channel,)), 0) == 255).all()


@pytest.mark.parametrize(("cells", "grid"), [(10, 50), (7, 25), (2, 5)])
def test_the_target_is_its_interpolation_over_its_largest_cell(cells, grid):
    batch = BatchEnv(GameConfig(command_cells=cells, drones_per_team=1))
    batch.reset([0])
    command = np.random.default_rng(cells).random((1, 2, cells, cells)) ** 2
    batch.step(command)
    centres, fine = (np.arange(cells) + 0.5) / cells, (np.arange(50) + 0.5) / 50
    for team in range(2):
        along_x = np.array([np.interp(fine, centres, row) for row in command[0, team]])
        full = np.array([np.interp(fine, centres, column) for column in along_x.T]).T
        blocks = full.reshape(grid, 50 // grid, grid, 50 // grid).mean(axis=(1, 3))
        image = batch.observe(ObservationConfig(grid=grid, channels=("own_target",)), team)[0, 0]
        np.testing.assert_allclose(image, 255 * blocks / command[0, team].max(), atol=0.51)


@TEAMS
def test_lists_and_rows_are_of_their_own_side_and_in_the_order_of_the_drones(batch, team):
    lists, rows = (batch.observe(ObservationConfig(kind=kind), team, [3, 1]) for kind in ("entities", "drones"))
    assert {part.dtype for name, part in lists.items() if "mask" not in name} == {np.dtype(np.float32)}
    simulator = batch.simulator
    for place, row in enumerate((3, 1)):
        for side, members in (("own", team), ("opposing", 1 - team)):
            listed = np.flatnonzero(simulator.teams[row] == members)
            assert lists[f"{side}_mask"][place].tolist() == [1] * len(listed) + [0] * (20 - len(listed))
            for name in ("positions", "velocities"):
                expected = np.zeros((20, 2))
                expected[: len(listed)] = getattr(simulator, name)[row, listed]
                np.testing.assert_array_equal(lists[f"{side}_{name}"][place], expected)
        np.testing.assert_allclose(lists["own_share"][place], [simulator.sizes[row, team] / 20])
        np.testing.assert_allclose(lists["time_left"][place], [1 - simulator.time_s[row] / 300])
        moving = np.concatenate([simulator.positions[row], simulator.velocities[row]], axis=1)
        np.testing.assert_array_equal(rows[place, :, :4], moving)
        np.testing.assert_array_equal(rows[place, :, 4], np.where(simulator.teams[row] == team, 1, -1))


def test_many_images_in_threads_are_those_of_one_after_the_other(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    observation, rows = ObservationConfig(grid=10), np.random.default_rng(0).permutation(40)[:35]
    batch, teams = BatchEnv(GameConfig(drones_per_team=2), 40, threads=2), rows % 2
    batch.reset(range(40))
    batch.step(np.random.default_rng(1).random((40, 2, 10, 10)))
    together = batch.observe(observation, teams, rows)
    assert together.size // 100 > 256  # enough images to use threads
    alone = [batch.observe(observation, int(teams[n]), [rows[n]]) for n in range(35)]
    np.testing.assert_array_equal(together, np.concatenate(alone))
    batch.close()


@pytest.mark.parametrize(
    "rules",
    [
        {},
        {"spawn": SpawnConfig(speed=2.0), "dynamics": DynamicsConfig(speed_factor=0.5)},
        {"dynamics": DynamicsConfig(min_speed=0.3)},
    ],
    ids=["default", "a start in flight", "walls that turn drones round"],
)
def test_the_bounds_of_velocities_are_those_that_drones_reach(rules):
    config = GameConfig(
        controllers="direct", drones_per_team=4, capture=CaptureConfig(enabled=False), time_limit=20.0, **rules
    )
    batch = BatchEnv(config)
    bounces = config.dynamics.min_speed > 0.0
    for kind, start in itertools.product(("entities", "drones"), ({}, {"velocities": np.full((8, 2), 10.0)})):
        observation = ObservationConfig(kind=kind)
        space = observation_space(config, observation)
        batch.reset([0], scenario={"positions": np.zeros((8, 2))} | start)
        fastest = 0.0
        while batch.running[0]:
            # Full thrust along x: ahead where walls turn drones round, else to and fro every 2 s.
            velocities, places = batch.simulator.velocities[0], batch.simulator.positions[0]
            ahead = np.sign(velocities) if bounces else np.where(batch.simulator.time_s[0] % 4 < 2, 1.0, -1.0)
            push = np.broadcast_to(np.where(ahead == 0, np.where(places > 0.5, -1.0, 1.0), ahead), (8, 2)) * [1.0, 0.0]
            batch.step(CheckedCommands(np.stack([batch.pack(push[None])[0]] * 2)[None]))
            shown = batch.observe(observation, 0)
            assert space.contains({name: part[0] for name, part in shown.items()} if kind == "entities" else shown[0])
            fastest = max(fastest, np.abs(batch.simulator.velocities).max())
        if not start and not bounces:
            assert 0.7 * top_speed(config) < fastest <= top_speed(config) * 1.0001


@pytest.mark.parametrize("grid", [10, 50])
def test_both_sides_seen_at_once_are_as_each_by_itself(batch, grid):
    generator, every = np.random.default_rng(0), CHANNELS + MOTION_CHANNELS
    sides, rows = np.array([1, 0, 0, 1, 1]), np.array([2, 2, 3, 1, 1])
    for count in (*range(1, 14, 3), 13):
        view = ObservationConfig(grid=grid, channels=tuple(generator.permutation(every)[:count].tolist()))
        together = batch.observe(view, sides, rows)
        for place in range(len(rows)):
            np.testing.assert_array_equal(together[place], batch.observe(view, sides[place], rows[place])[0])
