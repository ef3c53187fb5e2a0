"""What the planner is shown when it sees through a grid."""

from __future__ import annotations

import numpy as np

from benchmarks.sight import Peering, _Seen, play
from swarm_pz.config import GameConfig
from swarm_pz.simulator import Simulator


def test_a_grid_hides_where_in_a_cell_a_drone_is_and_velocities_can_be_hidden_too():
    simulator = Simulator(GameConfig(drones_per_team=20), 2)
    simulator.reset([0, 1])
    simulator.advance(30)
    games = simulator.snapshot()
    seen = _Seen(simulator, 10, moves=False, generator=np.random.default_rng(0)).snapshot([1])
    assert not seen.velocities.any() and games.velocities.any()
    np.testing.assert_array_equal(np.floor(10 * seen.positions), np.floor(10 * games.positions[1:]))
    assert np.abs(seen.positions - games.positions[1:]).max() > 0.05
    exact = _Seen(simulator, 0, moves=True, generator=np.random.default_rng(0)).snapshot([1])
    for one, other in zip(exact, games, strict=True):
        np.testing.assert_array_equal(one, other[1:])
    np.testing.assert_array_equal(simulator.games.positions, games.positions)  # nothing is changed by being looked at


def test_equal_seeds_see_and_play_the_same():
    simulator = Simulator(GameConfig(drones_per_team=3), 1)
    simulator.reset([0])
    answers = []
    for _ in range(2):
        planner = Peering(simulator.config, 10, moves=True, drone_steps=2_000)
        planner.reset([5], np.array([0]))
        answers.append(planner.plan(simulator, np.array([1]), np.array([0])))
    np.testing.assert_array_equal(*answers)


def test_a_row_says_what_was_seen():
    row = play((25, False), games=2, drone_steps=600)
    assert (row["grid"], row["moves"], row["games"], row["opponent"]) == (25, False, 2, "uniform")
