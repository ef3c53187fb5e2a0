"""Whether passing messages on makes up for a talk that does not reach far."""

from __future__ import annotations

import numpy as np

from benchmarks.paper.coverage import TARGETS, over_seeds
from benchmarks.paper.figure import Figure, Finding, Part, Setting, asked, below, estimates
from benchmarks.paper.talk import CLOSE, RADII, covered, over_radius, rules, steps_that_fall, times_silence

SEEDS = 20
HOPS = {"one hop": False, "relays": True}
"""Whether drones pass on what they hear."""


def measure(setting: Setting) -> Finding:
    """Cover the targets with every radius, without and with relays."""
    seeds = setting.seeds(SEEDS)
    configs = {
        name: {f"{name}, radius {radius:g}": rules(communication_radius=radius, relay=relay) for radius in RADII}
        for name, relay in HOPS.items()
    }
    metric = np.stack([covered(by_radius, seeds) for by_radius in configs.values()], axis=1)
    one, relayed = estimates(list(HOPS), metric, times_silence).values()
    gains = metric[:, 0].mean(axis=0) / metric[:, 1].mean(axis=0)
    steps = len(TARGETS) * (len(RADII) - 1)
    parts = [
        asked(f"with relays, worst radius over radius 0, below {1 + CLOSE:g}", relayed, below(1 + CLOSE), ours=True),
        asked("without", one, ours=True),
        Part("most that relays help, times", float(gains.max()), None, None, ours=True),
    ]
    parts += [
        Part(f"of {steps} steps to a smaller radius, lower the metric, {name}", float(falls), None, None, ours=True)
        for name, falls in zip(HOPS, steps_that_fall(metric).sum(axis=1), strict=True)
    ]
    return Finding(
        parts=parts,
        method=f"bootstrap over {len(seeds)} seeds; a step falls if the whole interval of its mean does",
        configs={name: config for by_radius in configs.values() for name, config in by_radius.items()},
        seeds=seeds,
        series={
            target: {name: over_seeds(metric[:, which, number]) for which, name in enumerate(HOPS)}
            for number, target in enumerate(TARGETS)
        },
    )


FIGURE = Figure(
    name="relays",
    claim="Drones that pass on what they hear are not misled by hearing a few: at no radius do they cover less well "
    "than if they heard nobody.",
    note="With `controller.relay` a drone averages over all whom it is connected with.",
    measure=measure,
    draw=over_radius,
    heights=(5.4, 2.5),
    seconds=18,
    presets=("paper",),
)
