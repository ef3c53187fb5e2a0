"""The rules of capture, one scene for each rule; `test_mirror` compares whole games."""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.simulator import Simulator
from tests.reference import captures_where

CENTRES = (np.arange(50) + 0.5) / 50
RING = [(row, column) for row in range(18, 23) for column in range(28, 33) if max(abs(row - 20), abs(column - 30)) == 2]
"""All cells of the ring around (20, 30)."""
# A lone drone would capture on the ring around it. Two of its mates in one far cell raise the
# maximum of their team's field, so that it captures nothing there.
FAR = [(45, 5), (45, 5)]


def scene(red_cells: list[tuple[int, int]], blue_cells: list[tuple[int, int]], **options) -> Simulator:
    """Place resting drones in cells (row, column); too little time passes for them to leave."""
    positions = [(CENTRES[column], CENTRES[row]) for row, column in red_cells + blue_cells]
    simulator = Simulator(GameConfig(drones_per_team=(len(red_cells), len(blue_cells)), **options))
    simulator.reset([0], scenario={"positions": positions, "teams": [0] * len(red_cells) + [1] * len(blue_cells)})
    return simulator


@pytest.mark.parametrize(
    ("inside", "enabled", "sizes"),
    [((20, 30), True, [17, 2]), ((20, 33), True, [16, 3]), ((20, 30), False, [16, 3])],
    ids=["on the ring's middle", "beside the ring", "without captures"],
)
def test_a_drone_is_captured_where_it_is_surrounded(inside, enabled, sizes):
    simulator = scene(RING, [inside, *FAR], capture=CaptureConfig(enabled=enabled))
    simulator.advance(1)
    assert simulator.sizes.tolist() == [sizes]


@pytest.mark.parametrize("count", [1, 10])
def test_no_density_saves_who_is_surrounded_and_the_step_stops_at_the_deciding_tick(count):
    simulator = scene(RING, [(20, 30)] * count)
    simulator.games.occupancy[0, 1, 2, 2] = 2000  # blue's field has its maximum where no drone is: it captures nobody
    simulator.games.occupancy[0, 1, 24, 34] = 200  # blue's field exceeds red's at the blue drones, too
    simulator.advance(30)
    assert simulator.sizes.tolist() == [[16 + count, 0]]
    assert simulator.decided.tolist() == [True] and simulator.games.ticks.tolist() == [1]


def test_a_captured_drone_brings_its_trail_follows_its_new_teams_command_and_is_counted_among_its_mates():
    simulator = scene(RING, [(20, 30), *FAR])
    simulator.advance(1)
    just_captured = simulator.snapshot()
    assert simulator.teams[0, 16] == 0
    assert simulator.occupancy[0].sum(axis=(1, 2)).tolist() == [17, 2]
    assert simulator.games.memory_weight[0, 16:18].tolist() == [0.0, 1.0]
    assert not simulator.games.memory[0, :, :, 16].any()

    def accelerations_after_the_next_solve(team=None, velocity=0.0):
        simulator.restore(just_captured)
        simulator.games.velocities[0, 16] = velocity
        if team is not None:
            simulator.command(team, np.eye(100)[:1].reshape(1, 10, 10))
        simulator.advance(3)
        return simulator.games.accelerations[0].copy()

    as_it_was = accelerations_after_the_next_solve()
    elsewhere = accelerations_after_the_next_solve(velocity=0.2)
    np.testing.assert_array_equal(accelerations_after_the_next_solve(1)[:17], as_it_was[:17])
    assert (accelerations_after_the_next_solve(0)[16] != as_it_was[16]).any()
    assert (elsewhere[:16] != as_it_was[:16]).any(axis=1).all(), "where it is counts for every red drone"
    np.testing.assert_array_equal(elsewhere[17:], as_it_was[17:])


def test_all_captures_of_a_tick_happen_at_once():
    # Each team surrounds one drone of the other; neither capture may prevent the other.
    other = [(row + 15, column + 5) for row, column in RING]
    simulator = scene([*RING, (35, 35)], [*other, (20, 30)])
    simulator.advance(1)
    assert simulator.teams[0, [16, -1]].tolist() == [1, 0]


@pytest.mark.parametrize("threshold", [0.75, 0.375])
def test_where_a_team_captures_matches_exact_fractions(threshold):
    simulator = Simulator(GameConfig(capture=CaptureConfig(threshold=threshold)), num_games=10)
    simulator.reset(range(10))
    simulator.advance(60)
    for game, team in np.ndindex(10, 2):
        expected = captures_where(simulator.occupancy[game, team], threshold)
        np.testing.assert_array_equal(simulator.captures_here[game, team], expected)


@pytest.mark.parametrize(("ago", "counts"), [(30, 1), (31, 0)])
def test_a_second_counts_whole(ago, counts):
    simulator = scene(RING, [(20, 30), *FAR])
    simulator.games.capture_ticks[0, 16] = 1 - ago
    simulator.advance(1)
    assert simulator.games.captures.tolist() == [[1, 0]]
    assert simulator.games.recaptures.tolist() == [[counts, 0]]
    assert simulator.games.capture_ticks[0, 16] == 1


@pytest.mark.parametrize("each", [109, 1000], ids=["the most that int16 holds", "1,000 against 1,000"])
def test_all_trails_in_one_cell_do_not_overflow_the_field_at_the_corner(each):
    config = GameConfig(drones_per_team=each)
    places = np.full((2 * each, 2), CENTRES[2])
    places[each], places[each + 1 :] = CENTRES[0], CENTRES[40]
    simulator = Simulator(config)
    simulator.reset([0], scenario={"positions": places, "teams": [0] * each + [1] * each})
    simulator.games.occupancy[0, 0, 4, 4] = config.num_drones * config.trail_ticks - each  # as if all trails were red's
    simulator.advance(1)
    assert simulator.sizes.tolist() == [[each + 1, each - 1]]
