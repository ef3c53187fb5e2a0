"""Teams whose drones hear each other badly: their rules, how well they cover, and curves over what is left of talk."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper import style
from benchmarks.paper.coverage import JUDGED, TARGETS, lone_team, metric_over_time, start
from benchmarks.paper.figure import Interval
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.intervals import bootstrap

Array = NDArray[np.float64]

DRONES = 12
RADII = (1.5, 0.8, 0.4, 0.2, 0.1, 0.05, 0.0)
"""Map widths; the first one reaches across the square, with the last one nobody hears anybody."""
CLOSE = 0.2
"""How far the metric may be from that of drones that hear nobody and count as the same, as a share."""


def rules(remembered_s: float | None = None, **controller: Any) -> GameConfig:
    """Return rules of a team alone, with fields of the controller, and another time constant of its memory if given."""
    config = lone_team(DRONES)
    if remembered_s is not None:
        config = config.replace(memory=config.memory.replace(controller=remembered_s))
    return config.replace(controller=config.controller.replace(**controller))


def covered(configs: Mapping[str, GameConfig], seeds: Sequence[int]) -> Array:
    """Return the metric when it is judged, (seeds, targets, rules), of teams under each of some rules."""
    games = [
        [metric_over_time(start(config, seeds, command), JUDGED)[:, -1] for config in configs.values()]
        for command in TARGETS.values()
    ]
    return np.array(games).transpose(2, 0, 1)


def ratio(above: Array, below: Array) -> tuple[float, Interval]:
    """Return how many times the mean of one sample (seeds,) is that of another, and its interval."""
    value, low, high = bootstrap(np.stack([above, below], axis=1), lambda drawn: np.divide(*drawn.mean(axis=0)))
    return float(value), (float(low), float(high))


def times_silence(values: Array) -> Any:
    """Return the worst mean metric in times of that of a team that hears nobody, over targets and what is heard.

    Values are (seeds, ..., targets, radii), and nobody is heard at the last radius; it counts as no other.
    """
    means = values.mean(axis=0)
    return (means[..., :-1] / means[..., -1:]).max(axis=(-2, -1))


def steps_that_fall(values: Array) -> NDArray[np.int64]:
    """Count neighbours along the last axis of values (seeds, ..., steps) whose mean falls with its whole interval."""
    _, _, high = bootstrap(np.diff(values, axis=-1))
    return np.asarray((high < 0).sum(axis=-1))


def radius_names(radii: Sequence[float]) -> list[str]:
    """Return what stands below an axis of radii."""
    return ["all", *(f"{radius:g}" for radius in radii[1:])]


def over_talk(axes: Any, names: Sequence[str], found: Mapping[str, Mapping[str, Any]]) -> None:
    """Draw means with intervals over what is heard, from much to little: a line for each entry of `found`."""
    places = np.arange(len(names))
    for (label, values), colour, dash in zip(found.items(), style.SERIES, style.DASHES, strict=False):
        ends = [values[key] for key in ("mean", "low", "high")]
        style.whisker(axes, places, *ends, fmt="o", linestyle=dash, color=colour, label=label)
    axes.set_xticks(places, names)
    axes.set(yscale="log", xlabel="radius (map widths)")


def over_radius(figure: Any, series: Mapping[str, Mapping[str, Any]]) -> None:
    """Draw the metric over the radius for each target of `series`, a line for each of what stands there."""
    names, label = radius_names(RADII), f"E after {JUDGED} s"
    style.for_targets(figure, dict(series), lambda axes, found: over_talk(axes, names, found), label)
