"""Whether the same command works for teams of any size."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.evaluation.intervals import bootstrap
from swarm_pz.figures import style
from swarm_pz.figures.coverage import COVERED, JUDGED, SECONDS, TARGETS, lone_team, metric_over_time, over_seeds, start
from swarm_pz.figures.figure import Figure, Finding, game_seeds

SEEDS = 20
SIZES = (6, 12, 24)


def worst_mean(values: NDArray[np.float64]) -> Any:
    """Return the largest mean over seeds of values (seeds, targets, sizes)."""
    return values.mean(axis=0).max()


def largest_difference(values: NDArray[np.float64]) -> Any:
    """Return the largest difference between two sizes on a target, of means of values (seeds, targets, sizes)."""
    return np.ptp(values.mean(axis=0), axis=1).max()


def measure(seed: int) -> Finding:
    """Let teams of all sizes cover all targets."""
    seeds = game_seeds(seed, SEEDS)
    configs = {f"{size} drones": lone_team(size) for size in SIZES}
    metric = {
        target: {name: metric_over_time(start(config, seeds, command)) for name, config in configs.items()}
        for target, command in TARGETS.items()
    }
    judged = np.stack([[values[:, JUDGED - 1] for values in sizes.values()] for sizes in metric.values()])
    judged = judged.transpose(2, 0, 1)
    worst, difference = bootstrap(judged, worst_mean), bootstrap(judged, largest_difference)
    names = f"worst_metric_at_{JUDGED}_s", f"largest_difference_at_{JUDGED}_s"
    means = judged.mean(axis=0)
    place = np.unravel_index(means.argmax(), means.shape)
    return Finding(
        statistic={name: float(found[0]) for name, found in zip(names, (worst, difference), strict=True)},
        interval={name: (float(f[1]), float(f[2])) for name, f in zip(names, (worst, difference), strict=True)},
        method=f"bootstrap over {SEEDS} seeds",
        supported=bool(worst[2] <= COVERED),
        seen=f"One command, sent once, to {', '.join(map(str, SIZES))} drones on three targets: after {JUDGED} s the "
        f"worst mean is {worst[0]:.5f} ({SIZES[place[1]]} drones, {list(TARGETS)[place[0]]}), "
        + (f"so that all nine are below {COVERED:g}" if worst[2] <= COVERED else f"not surely below {COVERED:g}")
        + f". They do not cover it equally well: between sizes the mean differs by up to {difference[0]:.5f}. More "
        f"drones fill an even cover more finely, and {SIZES[-1]} come {means[0, 0] / means[0, -1]:.0f} times closer to "
        f"it than {SIZES[0]}.",
        configs=configs,
        seeds=seeds,
        series={
            target: {name: over_seeds(values) for name, values in sizes.items()} for target, sizes in metric.items()
        },
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw the metric over time for each target, a line a size."""
    times = np.arange(1, SECONDS + 1)
    panels = figure.subplots(1, len(series), sharey=True)
    for axes, (target, sizes) in zip(panels, series.items(), strict=True):
        for (name, values), colour, dash in zip(sizes.items(), style.SERIES, style.DASHES, strict=False):
            style.band(axes, times, values, colour, dash, name)
            if axes is panels[0]:
                end = (SECONDS, values["mean"][-1])
                axes.annotate(name, end, (-4, -12), textcoords="offset points", ha="right", color=colour)
        axes.plot([JUDGED, JUDGED], [1e-5, COVERED], color=style.DARK, linewidth=0.8)
        axes.plot([JUDGED, SECONDS], [COVERED, COVERED], color=style.DARK, linewidth=0.8)
        axes.annotate(
            f"{COVERED:g} from {JUDGED} s on", (SECONDS, COVERED), (0, 3), textcoords="offset points", ha="right"
        )
        axes.set(yscale="log", xlabel="time (s)", title=f"target: {target}", xlim=(0, SECONDS), ylim=(1e-5, 0.3))
    panels[0].set_ylabel("ergodic metric E (no unit; 0: covered exactly)")
    handles, labels = panels[0].get_legend_handles_labels()
    for handle, label in zip(handles, labels, strict=True):
        handle.set_label(f"{label}: mean over {SEEDS} seeds, band 95 %")
    style.legend_below(figure, handles)


FIGURE = Figure(
    name="scale_invariance",
    title="One command for 6, 12 and 24 drones",
    claim="Control is scale-invariant: the same command makes teams of any size cover the target.",
    section="III-C",
    quote="all three swarm sizes converge to the three different target distributions",
    paper="The paper names scale invariance as a trait that control of swarms at high cadence needs, since team sizes "
    "change all the time, and shows that its decentralized ergodic control has it.",
    rule=f"On all three targets and for all three sizes the mean metric after {JUDGED} s is at most {COVERED:g}, with "
    "the whole interval.",
    measure=measure,
    draw=draw,
    size=(11.5, 4.3),
    seconds=5,
    revised="the rule also asked that sizes differ by at most 0.0005, which they do not; that was nobody's claim.",
)
