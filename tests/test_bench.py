"""What is measured, of which sizes, and how figures follow from rates; the rates themselves are any machine's."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.figure import Figure

from swarm_pz import bench
from swarm_pz.config import GameConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.envs.parallel_env import CaptureEnv
from swarm_pz.simulator import Simulator

SHORT = GameConfig(drones_per_team=2, time_limit=2.0)


def test_speeds_follow_from_rates_at_every_size_that_can_be(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    made, warm, said, rates = [], [], [], {}

    def api(name):
        def make(config, games, threads):
            made.append((name, config.num_drones, games, threads, config.observations[0].grid))
            number = len(made)
            return lambda: warm.append(number) or number

        return make

    def rate(step):
        number = step()
        return number * next(rates.setdefault(number, iter([7.0, 3.0, 5.0])))

    monkeypatch.setattr(bench, "steps_per_second", rate)
    speeds = bench.measure(
        {"batch": api("batch"), "parallel_env": api("parallel_env")},
        games=(1, 4, 1000), drones=(6, 104), threads=(1, 2, 3), grid=10, repeats=3, log=said.append,
    )  # fmt: skip
    assert made == [
        ("batch", 6, 1, 1, 10), ("parallel_env", 6, 1, 1, 10), ("batch", 6, 4, 1, 10), ("batch", 6, 4, 2, 10),
        ("batch", 6, 1000, 1, 10), ("batch", 6, 1000, 2, 10), ("batch", 104, 1, 1, 10),
        ("parallel_env", 104, 1, 1, 10), ("batch", 104, 4, 1, 10), ("batch", 104, 4, 2, 10),
    ]  # fmt: skip
    assert all(warm.count(number) == 4 for number in range(1, 11)), "a step that does not count, and three that do"
    assert said[0] == "[1/5] 1 games of 6 drones" and said[-1] == "[5/5] 4 games of 104 drones"
    for number, (speed, (name, drones, games, threads, _)) in enumerate(zip(speeds, made, strict=True), 1):
        steps = np.array([5.0, 3.0, 7.0]) * number * games
        assert (speed.api, speed.drones, speed.games, speed.threads) == (name, drones, games, threads)
        assert [speed.env_steps, speed.drone_steps, speed.slowest, speed.fastest] == [steps[0], *(steps * drones * 10)]


@pytest.mark.parametrize(
    ("make_step", "kind"),
    [
        (bench.make_simulator_step, Simulator),
        (bench.make_batch_env_step, BatchEnv),
        (bench.make_parallel_env_step, CaptureEnv),
    ],
)
def test_ended_games_start_afresh_and_both_seats_observe_within_the_measured_time(monkeypatch, make_step, kind):
    begun, seen, reset, observe = [], [], kind.reset, BatchEnv.observe
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    monkeypatch.setattr(kind, "reset", lambda env, *given, **named: begun.append(env) or reset(env, *given, **named))
    monkeypatch.setattr(BatchEnv, "observe", lambda env, shown, team: seen.append(team) or observe(env, shown, team))
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


def test_the_parts_of_a_drone_step_add_up(monkeypatch):
    # Rates a second of: coefficients, solve, restoring, a step of ten periods, observations.
    rates = iter(np.repeat([1e5, 5e4, 1e5, 2e3, 1e4], 5))
    monkeypatch.setattr(bench, "steps_per_second", lambda step: next(rates))
    each = 1e9 / (2 * 4)
    assert bench.phases(SHORT, games=2) == pytest.approx(
        {
            "memory, rollout and coefficients": each / 1e5,
            "costate": each / 5e4 - each / 1e5,
            "ticks and capture": (each / 2e3 - each / 1e5) / 10 - each / 5e4,
            "observations of both sides": each / 1e4 / 10,
        }
    )


def test_the_picture_has_a_panel_an_api_and_a_line_a_size(monkeypatch, tmp_path):
    drawn, save = [], Figure.savefig
    monkeypatch.setattr(Figure, "savefig", lambda figure, *given, **how: drawn.append(figure) or save(figure, *given))
    looks = {"slowest": 0.0, "fastest": 9e9, "env_steps": 1.0}
    sizes = [(drones, games, threads) for drones in (10, 20) for games in (1, 4) for threads in (1, 2)]
    speeds = [
        bench.Speed(api=api, drones=d, games=g, threads=t, drone_steps=1e6 * (g + d + t), **looks)
        for api in ("batch", "parallel_env", "other")
        for d, g, t in sizes
    ]
    bench.plot(speeds, tmp_path / "speed.png")
    assert [axes.get_title() for axes in drawn[0].axes] == ["batch", "other"]
    lines = {line.get_label(): line.get_xydata().tolist() for line in drawn[0].axes[1].lines}
    assert lines == {
        f"{d} drones, {t} thread{'s' * (t > 1)}": [[g, g + d + t] for g in (1, 4)] for d in (10, 20) for t in (1, 2)
    }
