"""Coverage by a team while captures make it smaller and larger."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper import style
from benchmarks.paper.coverage import (
    COVERED,
    JUDGED,
    SECONDS,
    SOON,
    hand_over,
    metric_over_time,
    over_seeds,
    start,
    worst_fall,
    worst_judged,
)
from benchmarks.paper.drawings import DRAWINGS
from benchmarks.paper.figure import CONVERGED, Figure, Finding, Setting, asked, below, estimate
from swarm_pz.config import RED, CaptureConfig, GameConfig

SEEDS, DRONES = 20, 12
"""Games, and drones of each team at the start."""
LOST, LOST_AT = 4, 10
"""Number of red's drones that are captured at once, and the second when they are."""
PERIODS = 10
"""Control periods in a second."""


def some_at_once(second: int, teams: NDArray[np.int8], generator: np.random.Generator) -> NDArray[np.int64]:
    """Return the drones that change sides: `LOST` of red's in one second, none before and after."""
    return generator.choice(np.flatnonzero(teams == RED), LOST if second == LOST_AT else 0, replace=False)


def one_a_second(_: int, teams: NDArray[np.int8], generator: np.random.Generator) -> NDArray[np.int64]:
    """Return one drone of either team, drawn uniformly."""
    return generator.choice(len(teams), 1)


CHANGES: dict[str, Callable[[int, NDArray[np.int8], np.random.Generator], NDArray[np.int64]] | None] = {
    "nobody changes sides": None,
    f"{LOST} of {DRONES} captured at {LOST_AT} s": some_at_once,
    "a drone changes sides each second": one_a_second,
}


def fly(config: GameConfig, seeds: Sequence[int], command: NDArray[np.float64], changes: str) -> NDArray[np.float64]:
    """Return red's metric (seeds, seconds) over the places of the drones that were red at the time."""
    simulator = start(config, seeds, command)
    generators = [np.random.default_rng([seed, 1]) for seed in seeds]
    choose = CHANGES[changes]

    def then(number: int) -> None:
        if choose is None or number % PERIODS:
            return
        chosen = np.zeros(simulator.teams.shape, np.bool_)
        for row, generator in enumerate(generators):
            chosen[row, choose(number // PERIODS, simulator.teams[row], generator)] = True
        hand_over(simulator, chosen)

    return metric_over_time(simulator, then=then)


def measure(setting: Setting) -> Finding:
    """Cover all drawings while no drone changes sides, or some at once, or one after the other."""
    seeds = setting.seeds(SEEDS)
    config = setting.config.replace(drones_per_team=DRONES, capture=CaptureConfig(enabled=False))
    commands = {name: drawing.density(setting.mapping) for name, drawing in DRAWINGS.items()}
    metric = {
        changes: {name: fly(config, seeds, command, changes) for name, command in commands.items()}
        for changes in CHANGES
    }
    flights = {changes: np.stack([*by_drawing.values()], axis=1) for changes, by_drawing in metric.items()}
    changing = list(CHANGES)[1:]
    parts = [
        asked(
            f"{changes}: E after {SECONDS} s over {SOON} s, below {CONVERGED:g}",
            estimate(flights[changes], worst_fall),
            below(CONVERGED),
        )
        for changes in changing
    ]
    parts += [
        asked(
            f"{changes}: E after {JUDGED} s, below {COVERED:g}",
            estimate(flights[changes], worst_judged),
            below(COVERED),
            ours=True,
        )
        for changes in CHANGES
    ]
    return Finding(
        parts=parts,
        method=f"bootstrap over {len(seeds)} seeds",
        configs={"two teams": config},
        seeds=seeds,
        series={name: {changes: over_seeds(metric[changes][name]) for changes in CHANGES} for name in DRAWINGS},
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw the metric over time for each drawing, a line for each way of changing sides."""
    every = figure.subplots(1, len(series), sharey=True, sharex=True)
    for axes, (target, metric) in zip(every, series.items(), strict=True):
        for (label, values), colour, dash in zip(metric.items(), style.SERIES, style.DASHES, strict=False):
            style.band(axes, np.arange(1, SECONDS + 1), values, colour, dash, label)
        style.bound(axes)
        axes.set(yscale="log", xlabel="time (s)", xlim=(0, SECONDS), ylim=(1e-5, 1.0))
        axes.set_title(target.replace("_", " "))
        axes.label_outer()
    figure.supylabel("ergodic metric E", fontsize=style.POINTS)
    style.legend_below(figure, every[0], 3)


FIGURE = Figure(
    name="fluctuation",
    claim="A team converges to its last target whatever the number of its drones, also while captures change it.",
    section="III-C",
    quote="Even if the number of agents under their control is fluctuating, their swarm will still converge to their "
    "last target.",
    note=f"Red's {DRONES} drones follow one command, sent once; blue's {DRONES} cover the square. Captured "
    "drones are drawn at random. The worst of three drawings counts.",
    measure=measure,
    draw=draw,
    height=2.3,
    first="On three raw targets E after 30 s is at most 0.001 where 4 of 12 drones are captured after 10 s, and where "
    "one of 24 changes sides each second.",
    first_held=False,
    revised="The paper says that the swarm converges, not how far, and its targets are drawn.",
)
