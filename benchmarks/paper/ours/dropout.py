"""How well a target is kept while drones fail and return, beside drones that are captured and come back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper import style
from benchmarks.paper.coverage import (
    COVERED,
    JUDGED,
    TARGETS,
    hand_over,
    lone_team,
    metric_over_time,
    over_seeds,
    start,
)
from benchmarks.paper.curves import over_time
from benchmarks.paper.figure import Figure, Finding, estimate, game_seeds
from benchmarks.paper.talk import ratio
from swarm_pz.config import CONTROL_PERIOD, RED, DynamicsConfig

SEEDS, DRONES = 40, 12
REPAIR_RATE = 0.1
FAILURE_RATES = (0.0, 0.02, 0.05, 0.1, 0.3)
"""Failures a second and working drone; the same repair rate for all."""
HALF_OUT = 0.1
"""Failure rate at which, in the long run, half of the drones are out."""
FEWER = f"{DRONES // 2} that never fail"


def share_out(failure_rate: float, repair_rate: float) -> float:
    """Return the share of drones that is out in the long run: a / (a + b) of a two-state Markov chain."""
    return failure_rate / (failure_rate + repair_rate)


def name_of(rate: float) -> str:
    """Return what a rate of failure is called: the share of drones that are out."""
    return f"{100 * share_out(rate, REPAIR_RATE):.0f} % out"


def captured_and_back(seeds: Sequence[int], rate: float) -> NDArray[np.float64]:
    """Return the metric (seeds, seconds) of a team whose drones change sides at the rates at which others fail.

    Who is away covers the square for the other team, and comes back from wherever that is.
    """
    simulator = start(lone_team(DRONES), seeds, TARGETS["bimodal"])
    generators = [np.random.default_rng([seed, 1]) for seed in seeds]
    leaves, returns = (-np.expm1(-per_second * CONTROL_PERIOD) for per_second in (rate, REPAIR_RATE))

    def then(_: int) -> None:
        drawn = np.stack([generator.random(DRONES) for generator in generators])
        changing = drawn < np.where(simulator.teams == RED, leaves, returns)
        if changing.any():
            hand_over(simulator, changing)

    return metric_over_time(simulator, then=then)


def measure(seed: int) -> Finding:
    """Cover the bimodal target at several rates of failure and of capture, and with fewer drones that never fail."""
    seeds = game_seeds(seed, SEEDS)
    configs = {
        name_of(rate): lone_team(DRONES).replace(dynamics=DynamicsConfig(failure_rate=rate, repair_rate=REPAIR_RATE))
        for rate in FAILURE_RATES
    } | {FEWER: lone_team(DRONES // 2)}
    failing = {name: metric_over_time(start(config, seeds, TARGETS["bimodal"])) for name, config in configs.items()}
    captured = {name_of(rate): captured_and_back(seeds, rate) for rate in FAILURE_RATES if rate}
    judged, judged_captured = (
        {name: estimate(values[:, JUDGED - 1]) for name, values in metric.items()} for metric in (failing, captured)
    )
    worse = {name: ratio(failing[name][:, JUDGED - 1], values[:, JUDGED - 1]) for name, values in captured.items()}
    holds = all(judged[name_of(rate)][1][1] <= COVERED for rate in FAILURE_RATES if rate <= HALF_OUT)
    numbers = {
        **_keyed(f"metric_at_{JUDGED}_s_", judged),
        **_keyed(f"metric_at_{JUDGED}_s_captured_", judged_captured),
        **_keyed("failing_over_captured_", worse),
    }
    whole, half, most = (judged[name_of(rate)][0] for rate in (0.0, HALF_OUT, FAILURE_RATES[-1]))
    times, ends = worse[name_of(HALF_OUT)]
    return Finding(
        numbers=numbers,
        method=f"bootstrap over {SEEDS} seeds",
        holds=holds,
        seen=f"{DRONES} drones on the bimodal target; each fails at random and returns, with nothing remembered, after "
        f"{1 / REPAIR_RATE:.0f} s on average. After {JUDGED} s the metric is {whole:.5f} without failures, {half:.5f} "
        f"with half of the drones out at every time, and {most:.5f} with three quarters out. "
        + (
            "Nobody is told: the others fill the gaps."
            if holds
            else "The target is still followed, but not as closely as claimed, and not only because they are fewer: "
            f"{DRONES // 2} drones that never fail come to {judged[FEWER][0]:.5f}."
        )
        + f" Drones that are captured and come back at the same rates come to "
        f"{judged_captured[name_of(HALF_OUT)][0]:.5f} with half of them away; those that fail to {times:.2f} times "
        f"that ({ends[0]:.2f} to {ends[1]:.2f}).",
        configs=configs,
        seeds=seeds,
        series={
            "failing": {name: over_seeds(values) for name, values in failing.items()},
            "captured": {name: over_seeds(values) for name, values in captured.items()},
        },
    )


def _keyed(before: str, found: dict[str, Any]) -> dict[str, Any]:
    return {before + name.replace(" % ", "_percent_").replace(" ", "_"): value for name, value in found.items()}


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw the metric over time, a line a rate: of drones that fail, and of those that are captured."""
    panels = figure.subplots(1, 2, sharey=True)
    never = dict(list(series["failing"].items())[:1])
    over_time(panels[0], series["failing"])
    over_time(panels[1], never | series["captured"])
    panels[0].set_title("drones fail where they are, and return to work")
    panels[1].set_title("drones are captured, and come back")
    panels[0].set_ylabel("ergodic metric E of working drones (no unit)")
    style.legend_below(figure, panels[0], columns=6)


FIGURE = Figure(
    name="dropout",
    title=f"{DRONES} drones that come and go (means over {SEEDS} seeds, bands 95 %; shares out in the long run)",
    claim="A team keeps its target while drones fail and return: nobody needs to be told.",
    paper="The paper's drones come and go by [capture](figures.md#fluctuation), and its commands do not depend on how "
    "many there are. We know of no picture in it of drones that fail.",
    rule=f"With up to half of the drones out at every time the mean metric after {JUDGED} s is at most {COVERED:g}, "
    "with its whole interval.",
    measure=measure,
    draw=draw,
    size=(10.5, 4.6),
    seconds=12,
)
