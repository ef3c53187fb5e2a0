from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.config import (
    PRESETS,
    CaptureConfig,
    DynamicsConfig,
    GameConfig,
    ObservationConfig,
    RewardConfig,
)
from swarm_pz.envs.batch_env import BatchEnv, by_game
from swarm_pz.errors import ConfigError, GameOverError, PolicyError
from swarm_pz.policy import load
from tests.games import assert_same, unchanged

SMALL = GameConfig(drones_per_team=2)
CLOCK = ObservationConfig(grid=10, channels=("time_left",))


def begun(config=SMALL, games=1, **options):
    batch = BatchEnv(config, games, **options)
    batch.reset(range(games))
    return batch


def step(batch, *after):
    return batch.step(np.ones((batch.num_games, 2, 10, 10)), *after)


def test_rewards_are_zero_sum_and_add_up_to_the_change_of_size_and_the_outcome():
    reward = RewardConfig(size_change=0.5, outcome=2.0)
    batch = begun(GameConfig(drones_per_team=(2, 4), reward=reward, time_limit=60.0), 8)
    generator, returns, won = np.random.default_rng(0), np.zeros((8, 2)), np.zeros(8)
    for _ in range(60):
        if not batch.running.any():
            break
        result = batch.step(generator.random((8, 2, 10, 10)) ** 6)
        np.testing.assert_array_equal(result.rewards.sum(axis=1), 0.0)
        returns += result.rewards
        won += np.where(result.terminated, np.where(batch.simulator.sizes[:, 0] > 0, 1.0, -1.0), 0.0)
    assert won.any() and not batch.running.any()
    expected = 0.5 * (batch.simulator.sizes[:, 0] - 2) / 3 + 2.0 * won
    np.testing.assert_allclose(returns[:, 0], expected, atol=1e-9)


# --- how a game ends --------------------------------------------------------------------------------------------------


def test_a_game_decided_in_the_last_tick_of_the_limit_is_won_and_not_timed_out():
    batch = begun(games=2, max_cycles=1)

    def decide_the_first_at_the_limit():
        if batch.simulator.games.ticks[0] == batch.config.step_ticks:
            batch.simulator.games.teams[0] = 0

    result = step(batch, decide_the_first_at_the_limit)
    assert (result.terminated.tolist(), result.truncated.tolist()) == ([True, False], [False, True])
    assert [batch.outcome(0, team) for team in (0, 1)] == ["win", "loss"]
    assert batch.infos(result, np.array([0, 1]), np.array([0, 0]))["outcome"].tolist() == [1, -1]


def test_how_a_game_ended_is_told_once():
    batch = begun(games=3, max_cycles=50)
    batch.simulator.games.ticks[1] = 49 * 30

    def decide():
        batch.simulator.games.teams[0] = 0
        batch.simulator.games.captures[0] = 2, 0

    first = step(batch, decide)
    assert (first.terminated.tolist(), first.truncated.tolist()) == ([True, False, False], [False, True, False])
    assert first.rewards[0].tolist() == [2.0, -2.0]
    second = step(batch)
    for values in (second.rewards, second.terminated, second.truncated, second.captured, second.recaptured):
        assert not values[:2].any()
    assert [batch.outcome(row, 1) for row in range(3)] == ["loss", "draw", None]


def test_a_step_before_the_start_or_after_the_end_is_refused_and_only_games_begun_anew_run_again():
    batch = BatchEnv(SMALL, 3, max_cycles=1)
    with pytest.raises(GameOverError, match="call reset"):
        step(batch)
    batch.reset([0, 1], rows=[2, 0])
    assert batch.running.tolist() == [True, False, True]
    step(batch)
    with pytest.raises(GameOverError, match="call reset"):
        step(batch)
    batch.reset([5], rows=[1])
    assert batch.running.tolist() == [False, True, False]


def test_a_last_step_may_be_a_part_of_one_and_the_limit_counts_for_each_game_by_itself():
    batch = begun(SMALL.replace(time_limit=2.5), 2)
    assert (batch.max_cycles, batch.limit_s) == (3, 2.5)
    batch.simulator.games.ticks[1] = 60
    result = step(batch)
    assert batch.simulator.games.ticks.tolist() == [30, 75] and result.truncated.tolist() == [False, True]
    with pytest.raises(ConfigError, match=r"max_cycles must be a whole number in \[1, 1000000000000\]"):
        batch.max_cycles = 10**12 + 1
    batch.max_cycles = 10**12
    assert (batch.max_cycles, batch.limit_s) == (10**12, 1e12)


def test_the_time_left_is_that_of_the_steps_asked_for_and_a_limit_that_has_passed_ends_the_game_where_it_is():
    batch = begun(max_cycles=4)
    step(batch)
    assert (batch.observe(CLOCK, 0) == round(0.75 * 255)).all()
    assert batch.observe(ObservationConfig(kind="entities"), 0)["time_left"] == 0.75
    batch.max_cycles = 2
    assert (batch.observe(CLOCK, 1) == round(0.5 * 255)).all()
    batch.max_cycles = 1
    batch.simulator.games.ticks[:] = 90
    assert (batch.observe(CLOCK, 0) == 0).all()
    assert step(batch).truncated.all()
    assert batch.simulator.time_s.tolist() == [3.0]


def test_without_captures_every_game_is_a_draw():
    batch = begun(GameConfig(drones_per_team=(0, 2), capture=CaptureConfig(enabled=False)), max_cycles=1)
    result = step(batch)
    assert not result.terminated.any() and result.truncated.all() and not result.rewards.any()
    assert batch.outcome(0, 0) == batch.outcome(0, 1) == "draw"
    assert batch.infos(result, np.array([0, 1]), np.array([0, 0]))["outcome"].tolist() == [0, 0]


def test_it_is_called_back_after_every_control_period_until_the_end_which_changes_nothing_else():
    batch, alone, times = begun(SMALL.replace(time_limit=1.2), 2), begun(SMALL.replace(time_limit=1.2), 2), []
    for _ in range(2):
        step(batch, lambda: times.append(batch.simulator.time_s.tolist()))
        step(alone)
    np.testing.assert_allclose(times, np.repeat(np.arange(1, 13)[:, None] / 10, 2, axis=1))
    assert_same(batch.simulator.games, alone.simulator.games)
    batch.reset([0, 1])
    times.clear()

    def decide():
        times.append(batch.simulator.time_s[0])
        batch.simulator.games.teams[:, :] = 0 if len(times) == 4 else batch.simulator.games.teams

    step(batch, decide)
    np.testing.assert_allclose(times, [0.1, 0.2, 0.3, 0.4])


OPTIONS = {
    "default": {},
    "handicap": {"drones_per_team": (1, 4), "command_cells": 4, "reward": RewardConfig(size_change=-0.3, outcome=2.5)},
    "no captures": {"capture": CaptureConfig(enabled=False)},
    "released": PRESETS["released"],
    "failing": {"dynamics": DynamicsConfig(failure_rate=1.0, repair_rate=1.0), "controllers": ("ergodic", "direct")},
    "flocking": {"controllers": ("ergodic", "flocking")},
}


@pytest.mark.parametrize("options", OPTIONS)
def test_one_call_a_step_gives_what_periods_one_by_one_give(options):
    config = GameConfig(**{"drones_per_team": 3, "time_limit": 3.5, **OPTIONS[options]})
    one, other, generator = begun(config, 3, threads=2), begun(config, 3), np.random.default_rng(0)
    for batch in (one, other):
        batch.simulator.games.ticks[1] = 45  # ends before the others, within a step
        batch.running[2] = False
    while one.running.any():
        sides = [[space.low + (space.high - space.low) * generator.random(space.shape) ** 4 for _ in range(3)]
                 for space in (system.space(config) for system in config.team_systems)]  # fmt: skip
        commands = (sides[0], sides[1]) if one.simulator.control.is_given else np.stack(sides, axis=1)
        for mine, its in zip(one.step(commands), other.step(commands, lambda: None), strict=True):
            np.testing.assert_array_equal(mine, its)
            assert mine.dtype == its.dtype and not np.signbit(mine[mine == 0]).any()
        assert_same(one.simulator.games, other.simulator.games)
    assert not other.running.any()


RING = [(row, column) for row in range(18, 23) for column in range(28, 33) if max(abs(row - 20), abs(column - 30)) == 2]
"""Cells around (20, 30)."""


@pytest.mark.parametrize("recently", [False, True])
def test_a_step_tells_who_took_how_many_and_how_many_of_these_back(recently):
    cells = np.array([*RING, (20, 30), (45, 5), (45, 5)])  # red is about to take a drone
    batch = BatchEnv(GameConfig(drones_per_team=(16, 3), command_period=0.1), 2)
    batch.reset([0, 1], scenario={"positions": (cells[:, ::-1] + 0.5) / 50})
    if recently:  # to take it back
        batch.simulator.games.capture_ticks[1, 16] = -10
    batch.simulator.games.captures[:], batch.simulator.games.recaptures[:] = 5, 3  # from earlier steps
    result = step(batch)
    assert (result.captured == [[1, 0], [1, 0]]).all()
    assert result.recaptured.tolist() == [[0, 0], [int(recently), 0]]
    infos = batch.infos(result, np.array([0, 1, 1]), np.array([1, 1, 0]))
    assert {name: values.tolist() for name, values in infos.items()} == {
        "size": [17, 2, 2], "captured": [1, 0, 0], "lost": [0, 1, 1], "recaptured": [int(recently), 0, 0],
        "time_s": [0.1] * 3, "outcome": [0] * 3,
    }  # fmt: skip
    assert by_game(batch.infos(None, np.array([0]), np.array([1]))) == [
        {"size": 17, "captured": 0, "lost": 0, "recaptured": 0, "time_s": 0.1, "outcome": 0}
    ]


# --- what is asked and refused ----------------------------------------------------------------------------------------


class Spy:
    """A policy that keeps what it is shown, and answers each game with a density of its own."""

    def __init__(self, privileged):
        self.bad = False
        if privileged:
            self.plan = lambda simulator, teams, rows: self._answer((simulator, teams), rows)
        else:
            self.observation = ObservationConfig(grid=10, channels=("own_positions", "own_share"))
            self.act = lambda observations, rows: self._answer(observations, rows)

    def _answer(self, shown, rows):
        self.shown, self.rows = shown, rows
        return np.stack([np.full((10, 10), 1.5 if self.bad else (1 + row) / 10) for row in rows])


@pytest.mark.parametrize("privileged", [False, True])
def test_a_policy_is_shown_the_games_that_it_is_asked_about_each_from_its_side(privileged):
    batch = begun(GameConfig(drones_per_team=(2, 5)), 4)
    spy, teams, rows = Spy(privileged), np.array([1, 0, 1]), np.array([3, 0, 2])
    answer = batch.ask(spy, teams, rows)
    np.testing.assert_array_equal(answer[:, 0, 0], [0.4, 0.1, 0.3])
    np.testing.assert_array_equal(spy.rows, rows)
    if privileged:
        assert spy.shown[0] is batch.simulator
        np.testing.assert_array_equal(spy.shown[1], teams)
    else:
        np.testing.assert_array_equal(spy.shown, batch.observe(spy.observation, teams, rows))
        assert spy.shown[:, 1, 0, 0].tolist() == [182, 73, 182]
    spy.bad = True
    with pytest.raises(PolicyError, match=r"policy Spy's answer must be numbers in \[0, 1\] of shape \(3, 10, 10\)"):
        batch.ask(spy, teams, rows)


def test_nothing_may_be_asked_of_no_games():
    batch = begun(games=2)
    with unchanged(batch.simulator):
        batch.reset(rows=[])
        batch.reset([], rows=[])
        batch.simulator.command(1, np.ones((0, 10, 10)), rows=[])
        batch.simulator.restore(batch.simulator.snapshot([]), [])
    nobody = np.zeros(0, np.int64)
    assert batch.observe(ObservationConfig(grid=10), 0, []).shape == (0, 9, 10, 10)
    assert batch.observe(ObservationConfig(kind="entities"), [], [])["own_mask"].shape == (0, 4)
    assert batch.infos(None, nobody, nobody)["size"].shape == (0,)
    for name in ("ring", "planner"):
        assert batch.ask(load(name, batch.config), nobody, nobody).shape == (0, 10, 10)
