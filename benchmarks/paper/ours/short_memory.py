"""Whether hearing a few misleads drones because they forget soon."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from benchmarks.paper.coverage import TARGETS, over_seeds
from benchmarks.paper.figure import Figure, Finding, Part, Setting, asked, below, estimate, estimates
from benchmarks.paper.talk import RADII, Array, covered, over_radius, rules, steps_that_fall, times_silence

SEEDS = 20
REMEMBERED_S = (2.0, 4.0, 8.0)
"""Time constants of the controller's memory."""


def growth(values: Array) -> Any:
    """Return `times_silence` at each time constant but the first over that at the one before; values as there."""
    worst = times_silence(values)
    return worst[1:] / worst[:-1]


def measure(setting: Setting) -> Finding:
    """Cover the targets with every radius at every time constant."""
    seeds = setting.seeds(SEEDS)
    configs = {
        remembered: {
            f"{remembered:g} s, radius {radius:g}": rules(remembered, communication_radius=radius) for radius in RADII
        }
        for remembered in REMEMBERED_S
    }
    metric = np.stack([covered(by_radius, seeds) for by_radius in configs.values()], axis=1)
    times = estimates([f"worst radius over radius 0, remembering {s:g} s" for s in REMEMBERED_S], metric, times_silence)
    changes = estimates(
        [f"that at {b:g} s over {a:g} s, below 1" for a, b in itertools.pairwise(REMEMBERED_S)], metric, growth
    )
    steps = len(TARGETS) * (len(RADII) - 1)
    even = list(TARGETS).index("uniform")
    parts = [asked(text, number, below(1.0), ours=True) for text, number in changes.items()]
    parts += [asked(text, number, ours=True) for text, number in times.items()]
    for place, (remembered, falls) in enumerate(zip(REMEMBERED_S, steps_that_fall(metric).sum(axis=1), strict=True)):
        text = f"of {steps} steps to a smaller radius, lower the metric, remembering {remembered:g} s"
        parts.append(Part(text, float(falls), None, None, ours=True))
        text = f"uniform target, hearing nobody, remembering {remembered:g} s"
        parts.append(asked(text, estimate(metric[:, place, even, -1]), ours=True))
    return Finding(
        parts=parts,
        method=f"bootstrap over {len(seeds)} seeds; a step falls if the whole interval of its mean does",
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
    claim="Hearing a few misleads drones because they forget soon: the longer they remember, the less it costs.",
    measure=measure,
    draw=over_radius,
    heights=(5.4, 2.5),
    seconds=25,
    presets=("paper",),
)
