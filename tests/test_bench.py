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


def test_speeds_follow_from_rates_at_every_size_that_can_be(monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    made, warm, said, rates = [], [], [], {}

    def face(name):
        def make(config, games, threads):
            made.append((name, config.num_drones, games, threads, config.observations[0].grid))

            def step():
                warm.append(name)

            step.number = len(made)
            return step

        return make

    def rate(step):
        rates.setdefault(step.number, iter([7.0, 3.0, 5.0]))
        return step.number * next(rates[step.number])

    monkeypatch.setattr(bench, "rate", rate)
    speeds = bench.measure(
        {"batch": face("batch"), "parallel_env": face("parallel_env")},
        games=(1, 4, 1000), drones=(6, 104), threads=(1, 2, 3), grid=10, repeats=3, say=said.append,
    )  # fmt: skip
    assert made == [
        ("batch", 6, 1, 1, 10), ("parallel_env", 6, 1, 1, 10), ("batch", 6, 4, 1, 10), ("batch", 6, 4, 2, 10),
        ("batch", 6, 1000, 1, 10), ("batch", 6, 1000, 2, 10), ("batch", 104, 1, 1, 10),
        ("parallel_env", 104, 1, 1, 10), ("batch", 104, 4, 1, 10), ("batch", 104, 4, 2, 10),
    ]  # fmt: skip
    assert warm == [name for name, *_ in made]
    assert said[0] == "[1/5] 1 games of 6 drones" and said[-1] == "[5/5] 4 games of 104 drones"
    for number, (speed, (name, drones, games, threads, _)) in enumerate(zip(speeds, made, strict=True), 1):
        steps = np.array([5.0, 3.0, 7.0]) * number * games
        assert (speed.face, speed.drones, speed.games, speed.threads) == (name, drones, games, threads)
        assert speed.env_steps == steps[0]
        assert [speed.drone_steps, speed.low, speed.high] == [*(steps * drones * 10)]


def test_a_rate_is_of_calls_in_a_time(monkeypatch):
    now = [0.0]
    monkeypatch.setattr("swarm_pz.bench.time.perf_counter", lambda: now[0])

    def step():
        now[0] += 0.125

    assert bench.rate(step) == 8.0
    assert now[0] == pytest.approx(0.375)


SHORT = GameConfig(drones_per_team=2, time_limit=2.0)


@pytest.mark.parametrize(
    ("face", "kind"),
    [(bench.simulator_face, Simulator), (bench.batch_env_face, BatchEnv), (bench.parallel_env_face, CaptureEnv)],
)
def test_ended_games_start_afresh_within_the_measured_time(monkeypatch, face, kind):
    begun, threads, reset = [], set(), kind.reset
    monkeypatch.setattr("os.cpu_count", lambda: 2)

    def note(env, *given, **named):
        begun.append(env)
        threads.add(getattr(env, "threads", None))
        return reset(env, *given, **named)

    monkeypatch.setattr(kind, "reset", note)
    step = face(SHORT, 2, 2)
    before = len(begun)
    simulator = {Simulator: lambda: begun[0], BatchEnv: lambda: begun[0].simulator}.get(kind, lambda: None)()
    for _ in range(3):
        if simulator is not None:
            simulator.games.teams[1] = 0  # red has all: decided
        step()
    assert len(begun) > before
    if simulator is not None:
        assert simulator.threads == 2


def test_the_observations_of_both_seats_are_made(monkeypatch):
    seen, observe = [], BatchEnv.observe
    monkeypatch.setattr(
        BatchEnv,
        "observe",
        lambda env, observation, team: seen.append((observation, team)) or observe(env, observation, team),
    )
    bench.batch_env_face(SHORT, 2, 1)()
    assert seen == [(SHORT.observations[0], 0), (SHORT.observations[1], 1)]


def test_the_parts_of_a_drone_step_add_up(monkeypatch):
    # Rates a second of: coefficients, solve, restoring, a step of ten periods, observations.
    rates = iter(np.repeat([1e5, 5e4, 1e5, 2e3, 1e4], 5))
    monkeypatch.setattr(bench, "rate", lambda step: next(rates))
    parts = bench.phases(SHORT, games=2)
    each = 1e9 / (2 * 4)
    assert parts == pytest.approx(
        {
            "memory, rollout and coefficients": each / 1e5,
            "costate": each / 5e4 - each / 1e5,
            "ticks and capture": (each / 2e3 - each / 1e5) / 10 - each / 5e4,
            "observations of both sides": each / 1e4 / 10,
        }
    )


def test_the_picture_has_a_panel_a_face_and_a_line_a_size(monkeypatch, tmp_path):
    drawn, save = [], Figure.savefig
    monkeypatch.setattr(
        Figure, "savefig", lambda figure, *given, **how: drawn.append(figure) or save(figure, *given, **how)
    )
    speeds = [
        bench.Speed(
            face=face, games=games, drones=drones, threads=threads, drone_steps=1e6 * (games + drones + threads),
            low=0.0, high=9e9, env_steps=1.0,
        )
        for face in ("batch", "parallel_env", "other")
        for drones in (10, 20)
        for games in (1, 4)
        for threads in (1, 2)
        if games >= threads
    ]  # fmt: skip
    bench.plot(speeds, tmp_path / "speed.png")
    axes = drawn[0].axes
    assert [one.get_title() for one in axes] == ["batch", "other"]
    lines = {line.get_label(): line.get_xydata().tolist() for line in axes[1].lines}
    assert lines == {
        f"{drones} drones, {threads} thread{'s' * (threads > 1)}": [
            [games, games + drones + threads] for games in (1, 4) if games >= threads
        ]
        for drones in (10, 20)
        for threads in (1, 2)
    }
