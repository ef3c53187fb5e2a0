"""Whether passing messages on makes up for a talk that does not reach far."""

from __future__ import annotations

import numpy as np

from benchmarks.paper.coverage import JUDGED, TARGETS, over_seeds
from benchmarks.paper.figure import Figure, Finding, estimates, game_seeds
from benchmarks.paper.talk import CLOSE, DRONES, RADII, covered, over_radius, rules, steps_that_fall, times_silence

SEEDS = 20
HOPS = {"one hop": False, "relays": True}
"""Whether drones pass on what they hear."""


def measure(seed: int) -> Finding:
    """Cover the targets with every radius, without and with relays."""
    seeds = game_seeds(seed, SEEDS)
    configs = {
        name: {f"{name}, radius {radius:g}": rules(communication_radius=radius, relay=relay) for radius in RADII}
        for name, relay in HOPS.items()
    }
    metric = np.stack([covered(by_radius, seeds) for by_radius in configs.values()], axis=1)
    names = [name.replace(" ", "_") for name in HOPS]
    times = estimates([f"most_times_silence_with_{name}" for name in names], metric, times_silence)
    worst = [value for value, _ in times.values()]
    falls = steps_that_fall(metric).sum(axis=1).tolist()
    gains = metric[:, 0].mean(axis=0) / metric[:, 1].mean(axis=0)
    number, place = np.unravel_index(gains.argmax(), gains.shape)
    return Finding(
        numbers={
            **times,
            **{f"steps_that_fall_with_{name}": (count, None) for name, count in zip(names, falls, strict=True)},
        },
        method=f"bootstrap over {SEEDS} seeds; a step falls if the whole interval of its mean does",
        holds=times["most_times_silence_with_relays"][1][1] <= 1.0 + CLOSE,
        seen=f"At the worst radius the metric is {worst[0]:.1f} times that of drones that hear nobody, and with relays "
        f"{worst[1]:.1f} times; {falls[0]} and {falls[1]} of {len(TARGETS) * (len(RADII) - 1)} steps to a smaller "
        f"radius surely lower the metric. Relays help most at a radius of {RADII[place]:g} "
        f"({list(TARGETS)[number]}): by a factor of {gains[number, place]:.0f}.",
        configs={name: config for by_radius in configs.values() for name, config in by_radius.items()},
        seeds=seeds,
        series={
            target: {name: over_seeds(metric[:, which, number]) for which, name in enumerate(HOPS)}
            for number, target in enumerate(TARGETS)
        },
    )


FIGURE = Figure(
    name="relays",
    title=f"{DRONES} drones that pass on what they hear (means over {SEEDS} seeds, 95 %)",
    claim="Drones that pass on what they hear are not misled by hearing a few: at no radius do they cover less well "
    "than if they heard nobody.",
    paper="The paper's drones all hear each other. With `controller.relay` a drone averages over all whom it is "
    "connected with, over any number of drones between.",
    rule=f"With relays, at no radius and on no target is the mean metric after {JUDGED} s more than {1 + CLOSE:g} "
    "times that with radius 0, with the whole interval of the largest of these ratios.",
    measure=measure,
    draw=over_radius,
    size=(11.5, 4.4),
    seconds=18,
)
