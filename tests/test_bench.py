"""Sizes that are measured, and how figures follow from rates; the rates themselves are any machine's."""

from __future__ import annotations

import pytest

from swarm_pz import bench
from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError

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
