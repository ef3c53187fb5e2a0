"""Sizes that are measured, and how figures follow from rates; the rates themselves are any machine's."""

from __future__ import annotations

import pytest

from swarm_pz import bench
from swarm_pz.config import GameConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.envs.parallel_env import CaptureEnv
from swarm_pz.errors import ConfigError
from swarm_pz.simulator import Simulator

SHORT = GameConfig(drones_per_team=2, time_limit=2.0)


def test_speeds_are_medians_at_every_size_that_can_be_measured(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    rates = iter([7.0, 3.0, 5.0] * 10)
    monkeypatch.setattr(bench, "steps_per_second", lambda step: next(rates))
    apis = dict.fromkeys(("batch", "parallel_env", "jax"), lambda *size: lambda: size)
    found = bench.measure(apis, games=(1, 4), drones=(6,), threads=(1, 2, 3), log=lambda _: None)
    sizes = [("batch", 1, 1), ("parallel_env", 1, 1), ("jax", 1, 1), ("batch", 4, 1), ("batch", 4, 2), ("jax", 4, 1)]
    assert [(one.api, one.games, one.threads) for one in found] == sizes
    assert all((one.env_steps, one.drone_steps) == (5.0 * one.games, 300.0 * one.games) for one in found)
    with pytest.raises(ConfigError, match="threads must be at most as many as games"):
        bench.measure(apis, games=(1,), drones=(6,), threads=(3,), log=lambda _: None)


@pytest.mark.parametrize(
    ("make_step", "kind"),
    [
        (bench.make_simulator_step, Simulator),
        (bench.make_batch_env_step, BatchEnv),
        (bench.make_parallel_env_step, CaptureEnv),
    ],
)
def test_ended_games_begin_anew_and_both_sides_observe_within_the_measured_time(monkeypatch, make_step, kind):
    begun, seen, reset, observe = [], [], kind.reset, BatchEnv.observe
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    monkeypatch.setattr(kind, "reset", lambda env, *given, **named: begun.append(env) or reset(env, *given, **named))
    monkeypatch.setattr(
        BatchEnv, "observe", lambda env, shown, team, *more: seen.append(team) or observe(env, shown, team, *more)
    )
    step = make_step(SHORT, 2, 2)
    before, simulator = len(begun), begun[0] if kind is Simulator else getattr(begun[0], "simulator", None)
    for _ in range(3):
        if simulator is not None:
            assert simulator.threads == 2
            simulator.games.teams[1] = 0  # red has all: decided
        step()
    assert len(begun) > before
    if kind is BatchEnv:
        assert set(seen) == {0, 1}
