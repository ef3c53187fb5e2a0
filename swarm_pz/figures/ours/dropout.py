"""How well a target is kept while drones come and go."""

from __future__ import annotations

from typing import Any

import numpy as np

from swarm_pz.config import DynamicsConfig
from swarm_pz.evaluation.intervals import mean_with_interval
from swarm_pz.figures import style
from swarm_pz.figures.coverage import COVERED, JUDGED, SECONDS, TARGETS, lone_team, metric_over_time, over_seeds, start
from swarm_pz.figures.figure import Figure, Finding, game_seeds

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


def measure(seed: int) -> Finding:
    """Cover the bimodal target at several rates of failure, and with fewer drones that never fail."""
    seeds = game_seeds(seed, SEEDS)
    configs = {
        f"{100 * share_out(rate, REPAIR_RATE):.0f} % out": lone_team(DRONES).replace(
            dynamics=DynamicsConfig(failure_rate=rate, repair_rate=REPAIR_RATE)
        )
        for rate in FAILURE_RATES
    } | {FEWER: lone_team(DRONES // 2)}
    metric = {name: metric_over_time(start(config, seeds, TARGETS["bimodal"])) for name, config in configs.items()}
    judged = {name: mean_with_interval(values[:, JUDGED - 1]) for name, values in metric.items()}
    keys = {name: f"metric_at_{JUDGED}_s_" + name.replace(" % ", "_percent_").replace(" ", "_") for name in judged}
    names = list(judged)
    supported = all(
        judged[name][1][1] <= COVERED for name, rate in zip(names, FAILURE_RATES, strict=False) if rate <= HALF_OUT
    )
    whole, half, most = (judged[names[place]][0] for place in (0, FAILURE_RATES.index(HALF_OUT), -2))
    return Finding(
        statistic={keys[name]: mean for name, (mean, _) in judged.items()},
        interval={keys[name]: ends for name, (_, ends) in judged.items()},
        method=f"bootstrap over {SEEDS} seeds",
        supported=supported,
        seen=f"{DRONES} drones on the bimodal target; each fails at random and returns, with nothing remembered, after "
        f"{1 / REPAIR_RATE:.0f} s on average. After {JUDGED} s the metric is {whole:.5f} without failures, {half:.5f} "
        f"with half of the drones out at every time, and {most:.5f} with three quarters out. "
        + (
            "Nobody is told: whoever works fills the gaps."
            if supported
            else "The target is still followed, but not as closely as claimed, and the smaller number is not all of "
            f"it: {DRONES // 2} drones that never fail come to {judged[FEWER][0]:.5f}."
        ),
        configs=configs,
        seeds=seeds,
        series={name: over_seeds(values) for name, values in metric.items()},
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw the metric over time, a line a rate."""
    axes = figure.subplots()
    times = np.arange(1, SECONDS + 1)
    colours = (style.DARK, *style.SERIES, style.GREY)
    dashes = ("-", *style.DASHES, (0, (1, 3)))
    for (name, values), colour, dash in zip(series.items(), colours, dashes, strict=True):
        style.band(axes, times, values, colour, dash, name)
        axes.annotate(
            name,
            (SECONDS, values["mean"][-1]),
            (4, -12 if name == FEWER else -3),
            annotation_clip=False,
            textcoords="offset points",
            color=colour,
        )
    axes.plot([JUDGED, SECONDS], [COVERED, COVERED], color=style.DARK, linewidth=0.8)
    axes.plot([JUDGED, JUDGED], [1e-5, COVERED], color=style.DARK, linewidth=0.8)
    axes.annotate(f"{COVERED:g} from {JUDGED} s on", (SECONDS, COVERED), (0, 3), textcoords="offset points", ha="right")
    axes.set(
        yscale="log",
        xlabel="time (s)",
        ylabel="ergodic metric E of working drones (no unit)",
        xlim=(0, SECONDS),
        ylim=(5e-5, 0.3),
    )
    axes.set_title(f"means over {SEEDS} seeds, bands 95 %; labels: drones out in the long run\n")


FIGURE = Figure(
    name="dropout",
    title=f"{DRONES} drones that come and go",
    claim="A team keeps its target while drones come and go: nobody needs to be told.",
    paper="The paper's drones come and go by capture, and its commands do not depend on how many there are. We know "
    "of no picture in it of drones that fail.",
    rule=f"With up to half of the drones out at every time the mean metric after {JUDGED} s is at most {COVERED:g}, "
    "with its whole interval.",
    measure=measure,
    draw=draw,
    size=(8.0, 4.6),
    seconds=5,
)
