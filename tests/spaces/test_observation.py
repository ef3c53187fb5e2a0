from __future__ import annotations

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
)
from swarm_pz.envs.batch_env import BatchEnv
from tests.reference import captures_where, cell_of, ring_sums

SUMMED, OLDEST, STRONGEST = CHANNELS[0:2], CHANNELS[2:4], CHANNELS[4:6]


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


@pytest.mark.parametrize("team", [0, 1])
def test_positions_show_64_a_drone(batch, team):
    expected = np.zeros((2, 4, 50, 50), int)
    for game in range(4):
        for position, owner in zip(batch.simulator.positions[game], batch.simulator.teams[game], strict=True):
            expected[(int(int(owner) != team), game, *cell_of(position))] += 64
    images = seen(batch, team)
    np.testing.assert_array_equal(images["own_positions"], np.minimum(expected[0], 255))
    np.testing.assert_array_equal(images["opposing_positions"], np.minimum(expected[1], 255))


def bilinear(places, grid):
    """Share 64 for each place out by how near the cells' centres are, along either axis; walls hold what is beyond."""
    centres = (np.arange(grid) + 0.5) / grid
    image = np.zeros((grid, grid))
    for place in places:
        x, y = (np.maximum(1 - grid * abs(centres - np.clip(at, centres[0], centres[-1])), 0) for at in place)
        image += np.floor(64 * np.outer(y, x) + 0.5)
    return np.minimum(image, 255)


@pytest.mark.parametrize("grid", [1, 10, 25, 50])
@pytest.mark.parametrize("team", [0, 1])
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


def test_a_crowd_is_as_bright_as_a_cell_can_be():
    batch = BatchEnv(GameConfig(drones_per_team=40))
    batch.reset([0])
    batch.simulator.games.positions[:] = 0.5
    image = batch.observe(ObservationConfig(grid=1, channels=("own_now",)), 0)
    assert image.tolist() == [[[[255]]]]


@pytest.mark.parametrize("team", [0, 1])
def test_trail_age_is_255_now_and_fades_to_0(batch, team):
    images = seen(batch, team)
    games = batch.simulator.games
    for game in range(4):
        expected = np.zeros((2, 50, 50))
        now = int(games.ticks[game])
        for drone, owner in enumerate(games.teams[game]):
            for age in range(min(150, now)):
                cell = games.trails[game, (now - 1 - age) % 150, drone]
                place = (int(owner != team), cell // 50, cell % 50)
                expected[place] = max(expected[place], 255 * (150 - age) / 150)
        for side, name in enumerate(OLDEST):
            np.testing.assert_allclose(images[name][game], expected[side], atol=0.51)


@pytest.mark.parametrize("team", [0, 1])
def test_capture_field_is_at_least_192_exactly_where_it_captures(batch, team):
    images = seen(batch, team)
    for side, name in enumerate(STRONGEST):
        for game in range(4):
            occupancy = batch.simulator.occupancy[game, team if side == 0 else 1 - team]
            np.testing.assert_array_equal(images[name][game] >= 192, captures_where(occupancy))
            sums, counts = ring_sums(occupancy)
            field = sums / counts
            np.testing.assert_allclose(images[name][game], 255 * field / field.max(), atol=1.01)


@pytest.mark.parametrize("grid", [10, 25])
def test_coarse_grids_sum_maximise_and_average(batch, grid):
    fine, coarse = seen(batch, 1), seen(batch, 1, grid)
    block = 50 // grid
    for name in CHANNELS:
        blocks = fine[name].reshape(4, grid, block, grid, block).astype(float)
        if name in SUMMED:
            expected = np.minimum(blocks.sum(axis=(2, 4)), 255)
        elif name in OLDEST + STRONGEST:
            expected = blocks.max(axis=(2, 4))
        else:
            expected = blocks.mean(axis=(2, 4))
        np.testing.assert_allclose(coarse[name], expected, atol=1.0, err_msg=name)


def test_each_side_sees_the_same_board_mirrored(batch):
    red, blue = seen(batch, 0), seen(batch, 1)
    for name in ("positions", "trail_age", "capture_field"):
        np.testing.assert_array_equal(red[f"own_{name}"], blue[f"opposing_{name}"])


@pytest.mark.parametrize("team", [0, 1])
def test_every_list_is_of_its_own_side_and_in_the_order_of_the_drones(batch, team):
    lists = batch.observe(ObservationConfig(kind="entities"), team, [3, 1])
    assert {part.dtype for name, part in lists.items() if "mask" not in name} == {np.dtype(np.float32)}
    for place, row in enumerate((3, 1)):
        for side, members in (("own", team), ("opposing", 1 - team)):
            listed = np.flatnonzero(batch.simulator.teams[row] == members)
            assert lists[f"{side}_mask"][place].tolist() == [1] * len(listed) + [0] * (20 - len(listed))
            for name in ("positions", "velocities"):
                expected = np.zeros((20, 2))
                expected[: len(listed)] = getattr(batch.simulator, name)[row, listed]
                np.testing.assert_array_equal(lists[f"{side}_{name}"][place], expected)
        np.testing.assert_allclose(lists["own_share"][place], [batch.simulator.sizes[row, team] / 20])
        np.testing.assert_allclose(lists["time_left"][place], [1 - batch.simulator.time_s[row] / 300])


@pytest.mark.parametrize(
    "options",
    [
        {"dynamics": DynamicsConfig(failure_rate=2.0, repair_rate=2.0)},
        {"memory": MemoryConfig(trail=1.1, trail_forgotten_on=("command",))},
        {"memory": MemoryConfig(trail=None)},
    ],
    ids=["failing", "forgetful", "endless"],
)
def test_trails_are_shown_as_long_as_they_are_and_with_their_gaps(options):
    batch = BatchEnv(GameConfig(drones_per_team=5, time_limit=8.0, **options))
    batch.reset([0])
    generator = np.random.default_rng(0)
    for _ in range(6):
        batch.step(generator.random((1, 2, 10, 10)) ** 3)
    games, length = batch.simulator.games, batch.config.trail_ticks
    batch.simulator.advance(2)  # between two solves
    assert (games.trails[0] < 0).any()
    images = batch.observe(ObservationConfig(channels=OLDEST), 0)[0]
    for side in range(2):
        expected = np.zeros(2500)
        for tick in range(max(0, int(games.ticks[0]) - length), int(games.ticks[0])):
            for cell in games.trails[0, tick % length][games.teams[0] == side]:
                if cell >= 0:
                    expected[cell] = 255 * (length - (games.ticks[0] - 1 - tick)) / length
        np.testing.assert_allclose(images[side].ravel(), expected, atol=0.51)


@pytest.mark.parametrize("grid", [50, 10])
def test_fields_are_bright_where_they_capture_whatever_the_threshold(grid):
    batch = BatchEnv(GameConfig(capture=CaptureConfig(threshold=0.375)))
    batch.reset([3])
    batch.step(np.ones((1, 2, 10, 10)))
    for team in range(2):
        image = batch.observe(ObservationConfig(grid=grid, channels=("own_capture_field",)), team)[0, 0]
        captures = captures_where(batch.simulator.occupancy[0, team], 0.375)
        assert captures.sum() > captures_where(batch.simulator.occupancy[0, team], 0.75).sum()
        block = 50 // grid
        np.testing.assert_array_equal(image >= 192, captures.reshape(grid, block, grid, block).any(axis=(1, 3)))


@pytest.mark.parametrize(("cells", "grid"), [(10, 50), (7, 25), (50, 10), (2, 5)])
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


@pytest.mark.parametrize("team", [0, 1])
def test_rows_of_drones_are_by_number_and_tell_own_ones_from_others(batch, team):
    rows = batch.observe(ObservationConfig(kind="drones"), team, [3, 1])
    simulator = batch.simulator
    for place, game in enumerate((3, 1)):
        np.testing.assert_array_equal(rows[place, :, :2], simulator.positions[game])
        np.testing.assert_array_equal(rows[place, :, 2:4], simulator.velocities[game])
        np.testing.assert_array_equal(rows[place, :, 4], np.where(simulator.teams[game] == team, 1, -1))


def test_many_images_in_threads_are_those_of_one_after_the_other(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    observation, seen = ObservationConfig(grid=10), []
    rows = np.random.default_rng(0).permutation(40)[:35]
    teams = rows % 2
    for threads in (1, 2):
        batch = BatchEnv(GameConfig(drones_per_team=2), 40, threads=threads)
        batch.reset(range(40))
        batch.step(np.random.default_rng(1).random((40, 2, 10, 10)))
        seen.append(batch.observe(observation, teams, rows))
        seen.append(np.concatenate([batch.observe(observation, int(teams[n]), [rows[n]]) for n in range(35)]))
        batch.close()
    assert seen[0].size // 100 > 256  # images, enough to be shared out
    for other in seen[1:]:
        np.testing.assert_array_equal(seen[0], other)


def test_observations_do_not_depend_on_the_batch(batch):
    together = batch.observe(ObservationConfig(grid=25), [1, 0, 1, 0])
    for game, team in enumerate([1, 0, 1, 0]):
        np.testing.assert_array_equal(batch.observe(ObservationConfig(grid=25), team, [game])[0], together[game])


def test_a_clock_that_was_set_forward_shows_the_trails_that_there_are():
    batch = BatchEnv(GameConfig(drones_per_team=3))
    batch.reset([0])
    batch.step(np.ones((1, 2, 10, 10)))
    games, length = batch.simulator.games, batch.config.trail_ticks
    games.ticks[0] = length + 30  # as of a trail's length ago: the places between hold no cell, which is no address
    images = batch.observe(ObservationConfig(channels=OLDEST), 0)[0]
    for side in range(2):
        expected = np.zeros(2500)
        for age in range(length - 1, -1, -1):
            for cell in games.trails[0, (games.ticks[0] - 1 - age) % length][games.teams[0] == side]:
                if cell >= 0:
                    expected[cell] = 255 * (length - age) / length
        np.testing.assert_allclose(images[side].ravel(), expected, atol=0.51)
