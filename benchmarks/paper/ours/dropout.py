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
from benchmarks.paper.figure import Figure, Finding, Setting, asked, below, estimate
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


def measure(setting: Setting) -> Finding:
    """Cover the bimodal target at several rates of failure and of capture, and with fewer drones that never fail."""
    seeds = setting.seeds(SEEDS)
    configs = {
        name_of(rate): lone_team(DRONES).replace(dynamics=DynamicsConfig(failure_rate=rate, repair_rate=REPAIR_RATE))
        for rate in FAILURE_RATES
    } | {FEWER: lone_team(DRONES // 2)}
    failing = {name: metric_over_time(start(config, seeds, TARGETS["bimodal"])) for name, config in configs.items()}
    captured = {name_of(rate): captured_and_back(seeds, rate) for rate in FAILURE_RATES if rate}
    judged = {name_of(rate) for rate in FAILURE_RATES if rate <= HALF_OUT}
    parts = []
    for name, values in failing.items():
        holds = below(COVERED) if name in judged else None
        text = f"{name}: E after {JUDGED} s" + (f", below {COVERED:g}" if holds else "")
        parts.append(asked(text, estimate(values[:, JUDGED - 1]), holds, ours=True))
    for name, values in captured.items():
        at = values[:, JUDGED - 1]
        parts.append(
            asked(f"{name}, failing over captured and back", ratio(failing[name][:, JUDGED - 1], at), ours=True)
        )
    return Finding(
        parts=parts,
        method=f"bootstrap over {len(seeds)} seeds",
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
    panels = style.panels(figure, 2, (1, 2), sharey=True)
    never = dict(list(series["failing"].items())[:1])
    over_time(panels[0], series["failing"])
    over_time(panels[1], never | series["captured"])
    panels[0].set_title("drones fail, and return to work")
    panels[1].set_title("drones are captured, and come back")
    panels[0].set_ylabel("E of working drones")
    style.legend_below(figure, panels[0], (2, 6))


FIGURE = Figure(
    name="dropout",
    claim="A team keeps its target while drones fail and return: nobody needs to be told.",
    note=f"{DRONES} drones on the bimodal target. A drone that fails returns after {1 / REPAIR_RATE:.0f} s on average, "
    "with nothing remembered; how many are out is in the long run.",
    measure=measure,
    draw=draw,
    heights=(4.6, 2.6),
    seconds=12,
    presets=("paper",),
)
