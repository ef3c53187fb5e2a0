from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import BLUE, RED, GameConfig, ObservationConfig, SpawnConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.policies.drone_tracker import DroneTracker

CONFIG = GameConfig(drones_per_team=4)
DRONES = ObservationConfig(kind="drones")


def games(count=3, config=CONFIG):
    env = BatchEnv(config, count)
    env.reset(range(count))
    return env


def follow(env, team, tracker, rows, steps, chance):
    """Play, and let a tracker look on from a side."""
    for _ in range(steps):
        tracker.look(env.observe(DRONES, team, rows), rows)
        env.step(chance.random((env.num_games, 2, 10, 10)) ** 8)
    tracker.look(env.observe(DRONES, team, rows), rows)


@pytest.mark.parametrize("team", [RED, BLUE])
def test_what_one_side_sees_is_kept_with_that_side_as_red(team):
    env, tracker, rows = games(), DroneTracker(CONFIG), np.array([2, 0])
    tracker.forget(rows)
    follow(env, team, tracker, rows, 4, np.random.default_rng(0))
    true, known = env.simulator, tracker.env.simulator
    np.testing.assert_array_equal(known.velocities[rows], true.velocities[rows])
    np.testing.assert_array_equal(known.teams[rows] == RED, true.teams[rows] == team)
    assert known.time_s[rows].tolist() == [4.0, 4.0]
    fields, seen = true.capture_field[rows][:, [team, 1 - team]], known.capture_field[rows]
    assert np.corrcoef(fields.ravel(), seen.ravel())[0, 1] > 0.9
    positions = ObservationConfig(channels=("own_positions", "opposing_positions", "own_now", "own_soon"))
    np.testing.assert_array_equal(tracker.env.observe(positions, RED, rows), env.observe(positions, team, rows))


def test_a_new_game_owes_nothing_to_the_one_before_and_others_stay_where_room_is_made():
    rows, env = np.array([1]), games()
    used, fresh = DroneTracker(CONFIG), DroneTracker(CONFIG)
    used.forget(rows)
    follow(env, RED, used, rows, 3, np.random.default_rng(0))
    for tracker in (used, fresh):
        tracker.forget(rows)
        env.reset([7], rows)
        follow(env, RED, tracker, rows, 2, np.random.default_rng(1))
    used.forget(np.array([700]))
    assert used.env.num_games > 700
    one, other = used.env.simulator.games, fresh.env.simulator.games
    for name in one._fields:
        np.testing.assert_array_equal(getattr(one, name)[1], getattr(other, name)[1], err_msg=name)


def test_games_begin_at_different_times_and_on_different_sides_with_drones_that_move_already():
    config = CONFIG.replace(command_period=0.5, spawn=SpawnConfig(speed=0.2))
    env, tracker, rows = games(2, config), DroneTracker(config), np.arange(2)
    tracker.look(env.observe(DRONES, RED, rows[:1]), rows[:1])
    known, true = tracker.env.simulator, env.simulator
    np.testing.assert_array_equal(known.velocities[0], true.velocities[0])
    assert known.games.seeds[0] != true.games.seeds[0], "what will happen by chance is not to be known"
    env.step(np.random.default_rng(0).random((2, 2, 10, 10)) ** 8)
    tracker.look(env.observe(DRONES, np.array([RED, BLUE]), rows), rows)
    assert known.time_s[rows].tolist() == [0.5, 0.0]
    np.testing.assert_array_equal(known.positions[rows], true.positions)
    np.testing.assert_array_equal(known.teams[rows], [true.teams[0], 1 - true.teams[1]])


@pytest.mark.parametrize("own", [1.0, -1.0])
def test_a_game_may_be_seen_first_as_none_begins(own):
    tracker = DroneTracker(CONFIG)
    drones = np.full((1, 8, 5), 0.5, np.float32)
    drones[..., 2:4], drones[..., 4] = 40.0, own
    tracker.look(drones, np.zeros(1, int))
    known = tracker.env.simulator.games
    assert (known.velocities[0] == 40.0).all() and (known.teams[0] == (RED if own > 0 else BLUE)).all()


def test_a_game_that_went_as_predicted_is_taken_over_whole_but_drones_are_where_they_are_seen():
    tracker, env, rows = DroneTracker(CONFIG), games(), np.array([1])
    tracker.forget(rows)
    follow(env, RED, tracker, rows, 1, np.random.default_rng(0))
    predicted, drones = env.simulator.snapshot(rows), env.observe(DRONES, RED, rows)[0]
    drones[:, :4] += np.float32(1e-5)
    tracker.adopt(predicted, drones, 1)
    known = tracker.env.simulator.games
    np.testing.assert_array_equal(known.memory[1], predicted.memory[0])
    np.testing.assert_array_equal(known.trails[1], predicted.trails[0])
    np.testing.assert_array_equal(known.positions[1], drones[:, :2])
    np.testing.assert_array_equal(known.velocities[1], drones[:, 2:4])
