"""The rules of capture, one sentence and one scene at a time."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig, MemoryConfig
from swarm_pz.kernels.capture import RING_COUNTS
from swarm_pz.simulator import Simulator
from tests.reference import RuleReference, captures_where, ring_sums

CENTRES = (np.arange(50) + 0.5) / 50


def scene(red_cells: list[tuple[int, int]], blue_cells: list[tuple[int, int]]) -> Simulator:
    """Place resting drones in cells (row, column); too little time passes for them to leave."""
    positions = [(CENTRES[column], CENTRES[row]) for row, column in red_cells + blue_cells]
    simulator = Simulator(GameConfig(drones_per_team=(len(red_cells), len(blue_cells))))
    simulator.reset([0], scenario={"positions": positions, "teams": [0] * len(red_cells) + [1] * len(blue_cells)})
    return simulator


def ring_around(row: int, column: int) -> list[tuple[int, int]]:
    """All cells of the ring that lie inside the square."""
    return [
        (row + dy, column + dx)
        for dy in range(-2, 3)
        for dx in range(-2, 3)
        if max(abs(dy), abs(dx)) == 2 and 0 <= row + dy < 50 and 0 <= column + dx < 50
    ]


# A lone drone captures on the ring around it, too: two of its mates in one far cell raise their
# field's maximum there and so disarm it.
FAR = [(45, 5), (45, 5)]


def test_a_drone_beside_the_ring_is_not_captured():
    simulator = scene(ring_around(20, 30), [(20, 33), *FAR])
    simulator.advance(1)
    assert simulator.sizes.tolist() == [[16, 3]]


@pytest.mark.parametrize(("row", "column"), [(0, 25), (25, 49), (0, 0), (49, 0), (1, 48)])
def test_walls_stand_in_for_drones(row, column):
    simulator = scene(ring_around(row, column), [(row, column), (25, 24)])
    simulator.advance(1)
    assert simulator.teams[0, -2] == 0


@pytest.mark.parametrize("count", [1, 10])
def test_no_density_saves_who_is_surrounded_a_whole_team_is_captured_at_once(count):
    simulator = scene(ring_around(20, 30), [(20, 30)] * count)
    simulator.games.fields[0, 1, 2, 2] = 10**8  # blue's field is strongest where nobody is: it captures nobody
    simulator.advance(1)
    assert simulator.sizes.tolist() == [[16 + count, 0]]
    assert simulator.decided.tolist() == [True]


def test_a_captured_drone_follows_its_new_teams_command_and_is_counted_among_its_mates():
    simulator = scene(ring_around(20, 30), [(20, 30), *FAR])
    simulator.advance(1)
    just_captured = simulator.snapshot()
    assert simulator.teams[0, 16] == 0

    def accelerations_after_the_next_solve(commands=(None, None), velocity=0.0):
        simulator.restore(just_captured)
        simulator.games.velocities[0, 16] = velocity
        for team, command in enumerate(commands):
            if command is not None:
                simulator.command(team, command[None])
        simulator.advance(3)
        return simulator.games.accelerations[0].copy()

    corner = np.zeros((10, 10))
    corner[0, 0] = 1.0
    as_it_was = accelerations_after_the_next_solve()
    told_blue = accelerations_after_the_next_solve((None, corner))
    told_red = accelerations_after_the_next_solve((corner, None))
    elsewhere = accelerations_after_the_next_solve(velocity=0.2)
    np.testing.assert_array_equal(told_blue[:17], as_it_was[:17])
    assert (told_red[16] != as_it_was[16]).any()
    assert (elsewhere[:16] != as_it_was[:16]).any(axis=1).all(), "where it is counts for every red drone"
    np.testing.assert_array_equal(elsewhere[17:], as_it_was[17:])


def test_a_captured_drone_brings_its_trail_and_starts_with_an_empty_memory():
    simulator = scene(ring_around(20, 30), [(20, 30), *FAR])
    simulator.advance(1)
    assert simulator.occupancy[0, 0].sum() == 17
    assert simulator.occupancy[0, 1].sum() == 2
    assert simulator.games.memory_weight[0, 16] == 0.0
    assert simulator.games.memory_weight[0, 17] == 1.0
    assert not simulator.games.memory[0, :, :, 16].any()


def test_all_captures_of_a_tick_happen_at_once():
    # Each team surrounds one drone of the other; neither capture may prevent the other.
    red, blue = ring_around(10, 10), ring_around(35, 35)
    simulator = scene([*red, (35, 35)], [*blue, (10, 10)])
    simulator.advance(1)
    assert simulator.teams[0, 16] == 1
    assert simulator.teams[0, -1] == 0


def test_the_step_stops_at_the_deciding_tick():
    # Three red drones in one cell disarm the others; blue's only drone is on the ring of that cell.
    simulator = scene([(20, 28)] * 3, [(20, 30)])
    simulator.games.fields[0, 1, 2, 2] = 10**8  # blue's field is strongest where nobody is
    simulator.advance(30)
    assert simulator.decided.tolist() == [True]
    assert simulator.games.ticks.tolist() == [1]


def test_without_captures_nobody_changes_sides():
    simulator = scene(ring_around(20, 30), [(20, 30), (45, 5)])
    config = GameConfig.from_dict({"drones_per_team": [16, 2], "capture": {"enabled": False}})
    peaceful = Simulator(config)
    peaceful.reset([0], scenario={"positions": simulator.positions[0], "teams": simulator.teams[0]})
    peaceful.advance(30)
    assert peaceful.sizes.tolist() == [[16, 2]]
    assert not peaceful.decided.any()


def test_ring_counts_match_counting():
    np.testing.assert_array_equal(RING_COUNTS, ring_sums(np.zeros((50, 50), np.int64))[1])


@pytest.mark.parametrize("threshold", [0.75, 0.375])
def test_where_a_team_captures_matches_exact_fractions(threshold):
    simulator = Simulator(GameConfig(capture=CaptureConfig(threshold=threshold)), num_games=30)
    simulator.reset(range(30))
    simulator.advance(90)
    for game in range(30):
        for team in range(2):
            expected = captures_where(simulator.occupancy[game, team], threshold)
            np.testing.assert_array_equal(simulator.captures_here[game, team], expected)


@pytest.mark.parametrize("threshold", [0.375, 0.875])
def test_drones_are_captured_by_the_threshold_that_was_asked_for(threshold):
    config = GameConfig(capture=CaptureConfig(threshold=threshold), memory=MemoryConfig(trail=1.0))
    captured = 0
    for seed in range(3):
        simulator, generator = Simulator(config), np.random.default_rng(seed)
        simulator.reset([seed])
        rules = RuleReference(simulator.teams[0], trail_ticks=30, threshold=threshold)
        for tick in range(150):
            if tick % 30 == 0:
                for team in range(2):
                    simulator.command(team, generator.random((1, 10, 10)) ** 4)
            simulator.advance(1)
            captured += len(rules.tick(simulator.positions[0]))
            np.testing.assert_array_equal(simulator.teams[0], rules.teams)
            np.testing.assert_array_equal(simulator.games.captures[0], rules.captures)
            np.testing.assert_array_equal(simulator.games.recaptures[0], rules.recaptures)
            if simulator.decided[0]:
                break
    assert captured > 0


@pytest.mark.parametrize(("ago", "counts"), [(30, 1), (31, 0)])
def test_a_second_counts_whole(ago, counts):
    simulator = scene(ring_around(20, 30), [(20, 30), *FAR])
    simulator.games.capture_ticks[0, 16] = 1 - ago
    simulator.advance(1)
    assert simulator.games.captures.tolist() == [[1, 0]]
    assert simulator.games.recaptures.tolist() == [[counts, 0]]
    assert simulator.games.capture_ticks[0, 16] == 1
