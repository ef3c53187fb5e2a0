"""Whether hearing a few misleads drones because they forget soon."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from benchmarks.paper.coverage import TARGETS, over_seeds
from benchmarks.paper.figure import Figure, Finding, estimates, game_seeds
from benchmarks.paper.talk import DRONES, RADII, Array, covered, over_radius, rules, steps_that_fall, times_silence

SEEDS = 20
REMEMBERED_S = (2.0, 4.0, 8.0)
"""Time constants of the controller's memory."""


def growth(values: Array) -> Any:
    """Return `times_silence` at each time constant but the first over that at the one before; values as there."""
    worst = times_silence(values)
    return worst[1:] / worst[:-1]


def measure(seed: int) -> Finding:
    """Cover the targets with every radius at every time constant."""
    seeds = game_seeds(seed, SEEDS)
    configs = {
        remembered: {
            f"{remembered:g} s, radius {radius:g}": rules(remembered, communication_radius=radius) for radius in RADII
        }
        for remembered in REMEMBERED_S
    }
    metric = np.stack([covered(by_radius, seeds) for by_radius in configs.values()], axis=1)
    times = estimates([f"most_times_silence_at_{s:g}_s" for s in REMEMBERED_S], metric, times_silence)
    changes = estimates([f"at_{b:g}_s_over_{a:g}_s" for a, b in itertools.pairwise(REMEMBERED_S)], metric, growth)
    worst = [value for value, _ in times.values()]
    falls = steps_that_fall(metric).sum(axis=1).tolist()
    steps = len(TARGETS) * (len(RADII) - 1)
    found = ", ".join(f"{times:.1f} at {tau:g} s" for times, tau in zip(worst, REMEMBERED_S, strict=True))
    counts = ", ".join(map(str, falls))
    silent = ", ".join(f"{mean:.4f}" for mean in metric[:, :, list(TARGETS).index("uniform"), -1].mean(axis=0))
    return Finding(
        numbers={
            **times,
            **changes,
            **{f"steps_that_fall_at_{s:g}_s": (count, None) for s, count in zip(REMEMBERED_S, falls, strict=True)},
        },
        method=f"bootstrap over {SEEDS} seeds; a step falls if the whole interval of its mean does",
        holds=all(most < 1.0 for _, (_, most) in changes.values()),
        seen=f"The metric at the worst radius, relative to that of drones that hear nobody: {found}. {counts} of "
        f"{steps} steps to a smaller radius surely lower the metric. Drones that hear nobody differ, too: on the "
        f"uniform target they come to {silent}.",
        configs={name: config for by_radius in configs.values() for name, config in by_radius.items()},
        seeds=seeds,
        series={
            target: {
                f"memory of {remembered:g} s": over_seeds(metric[:, place, number])
                for place, remembered in enumerate(REMEMBERED_S)
            }
            for number, target in enumerate(TARGETS)
        },
    )


FIGURE = Figure(
    name="short_memory",
    title=f"{DRONES} drones that forget sooner or later, and hear less and less (means over {SEEDS} seeds, 95 %)",
    claim="Hearing a few misleads drones because they forget soon: the longer they remember, the less it costs.",
    paper="The paper's controller looks back over a fixed time; here the past fades with a time constant, 4 s by "
    "default.",
    rule="Take, at each time constant, the largest mean metric over all targets and radii in times of that with radius "
    "0. From 2 to 4 and from 4 to 8 s it falls, each with its whole interval.",
    measure=measure,
    draw=over_radius,
    size=(11.5, 4.4),
    seconds=25,
)
