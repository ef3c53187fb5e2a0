"""Ergodic control beside flocking: two spots at once, or one attractor after the other."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper import style
from benchmarks.paper.coverage import SECONDS, Flight, gaussian, lone_team, over_seeds, start
from benchmarks.paper.drawings import DRAWINGS, interpolated
from benchmarks.paper.figure import Figure, Finding, Number, Part, Setting, above, asked, below, estimate, game_seeds
from swarm_pz.config import RED, TICKS_PER_SECOND, GameConfig
from swarm_pz.evaluation.intervals import median_with_interval, rounded
from swarm_pz.simulator import Simulator
from swarm_pz.systems import FlockingCommand

SEEDS, DRONES = 20, 12
TRIED = 5
"""Seeds that choose a schedule; the best schedule is measured on other seeds."""
MODES = ((0.3, 0.3), (0.77, 0.77))
"""Middles of the drawing's spots: a diffuse one at the lower left, a compact one at the upper right."""
REACHED = 0.005
"""Ergodic metric at which the target counts as reached; this bound is ours."""
CELLS = 25
"""Cells a side of the maps."""
NEAR = 0.25
"""Map widths within which a drone counts as near a mode."""
SETTLED = 10
"""Seconds that a flock has to reach its attractor before its spread is measured."""
SCHEDULES = [(first, other) for first in (4, 8, 12, 16) for other in (2, 3, 5, 8)]
"""Schedules to try: seconds at the lower and at the upper attractor, in turn."""
ERGODIC, ALONE, SEQUENCE = "ergodic: one drawing", "flock: one attractor", "flock: best schedule"

Array = NDArray[np.float64]


def first_reached(metric: Array) -> Array:
    """Return the second (seeds,) after which a metric (seeds, seconds) is first low enough; infinite for never."""
    low = metric <= REACHED
    return np.where(low.any(axis=1), low.argmax(axis=1) + 1.0, np.inf)


def kept_from(metric: Array) -> Array:
    """Return the second (seeds,) from which on a metric (seeds, seconds) stays low enough; infinite for never."""
    high = (metric > REACHED)[:, ::-1]
    last = np.where(high.any(axis=1), metric.shape[1] - high.argmax(axis=1), 0)
    return np.where(last < metric.shape[1], last + 1.0, np.inf)


def near_modes(places: Array) -> Array:
    """Return, for places (..., 2), the squared distance to each mode (..., 2); NaN where not near."""
    squared = np.stack([((places - np.array(mode)) ** 2).sum(axis=-1) for mode in MODES], axis=-1)
    return np.where(squared <= NEAR**2, squared, np.nan)


def wanted(density: Array) -> tuple[Array, Array]:
    """Return the share of a target's mass near each mode, and its rms distance from the mode there."""
    cells = 400
    target = interpolated(density, cells)
    centres = (np.arange(cells) + 0.5) / cells
    squared = near_modes(np.stack(np.meshgrid(centres, centres), axis=-1))
    weights = target[..., None] * np.isfinite(squared)
    share = weights.sum(axis=(0, 1)) / target.sum()
    return share, np.sqrt((weights * np.nan_to_num(squared)).sum(axis=(0, 1)) / weights.sum(axis=(0, 1)))


def flock(
    config: GameConfig,
    seeds: list[int],
    target: Array,
    weights: tuple[float, float],
    schedule: tuple[int, int] | None = None,
) -> Flight:
    """Fly flocks to both attractors in turn, or to the first one alone, and compare with the whole target."""
    simulator = start(config.replace(controllers="flocking"), seeds, target)
    coefficients = simulator.games.coefficients.copy()

    def send(mode: int) -> None:
        _attract(simulator, MODES[mode], weights[mode])
        simulator.games.coefficients[:] = coefficients  # the whole target, under either attractor

    send(0)
    if schedule is None:
        return Flight(simulator)
    return Flight(simulator, turns(schedule, send))


def turns(schedule: tuple[int, int], send: Callable[[int], None]) -> Callable[[int], None]:
    """Return a function to call after each second; it sends the attractor whose turn begins."""
    first, whole = schedule[0], sum(schedule)

    def each_second(second: int) -> None:
        if second % whole in (0, first):
            send(int(second % whole == first))

    return each_second


def _attract(simulator: Simulator, place: tuple[float, float], weight: float) -> None:
    simulator.command(RED, [FlockingCommand(position=place, weight=weight)] * simulator.num_games)


def best_schedule(config: GameConfig, seeds: list[int], target: Array, weights: tuple[float, float]) -> tuple[int, int]:
    """Return the schedule whose flocks are the nearest to the target in the second half of the time."""

    def score(schedule: tuple[int, int]) -> float:
        return float(flock(config, seeds, target, weights, schedule).metric[:, SECONDS // 2 :].mean())

    return min(SCHEDULES, key=score)


def weights_of(config: GameConfig) -> list[float]:
    """Return three weights of attractors, from the least to the largest."""
    return [float(weight) for weight in np.linspace(*config.flocking.migration, 3)]


def spreads(config: GameConfig, seeds: list[int], target: Array) -> Array:
    """Return the rms distance (seeds, weights) that flocks keep from an attractor in the middle, by its weight."""
    distances = []
    for weight in weights_of(config):
        simulator = start(config.replace(controllers="flocking"), seeds, target)
        _attract(simulator, (0.5, 0.5), weight)
        simulator.advance(SETTLED * TICKS_PER_SECOND)
        places = Flight(simulator).places
        distances.append(np.sqrt(((places - 0.5) ** 2).sum(axis=-1).mean(axis=(1, 2))))
    return np.stack(distances, axis=1)


def times_near(flight: Flight, target: Array) -> Array:
    """Return the time (seeds, 2) that drones spend near each mode, over what the target asks."""
    return np.asarray(np.isfinite(near_modes(flight.places)).mean(axis=(1, 2)) / wanted(target)[0])


def lesser(values: Array) -> Any:
    """Return the lesser mean of values (seeds, 2)."""
    return values.mean(axis=0).min()


def widths(flight: Flight) -> Array:
    """Return the sum of squared distances of near drones from each mode, and their number (seeds, 2, 2)."""
    squared = near_modes(flight.places)
    return np.stack([np.nansum(squared, axis=(1, 2)), np.isfinite(squared).sum(axis=(1, 2))], axis=1)


def diffuse_over_compact(sums: Array) -> Any:
    """Return the rms width of drones around the first mode over that around the other, of `widths`.

    It is 0 if no drone came near one of them.
    """
    squared, count = sums.sum(axis=0)
    return np.sqrt(np.divide(*squared) * np.divide(*count[::-1])) if count.all() else 0.0


def widest_over_narrowest(values: Array) -> Any:
    """Return the width of flocks with the least weight over that with the largest, of spreads (seeds, weights)."""
    return values[:, 0].mean() / values[:, -1].mean()


def equal_spots(width: float, cells: int) -> Array:
    """Return a target of two equal spots of an rms width."""
    density = sum(gaussian(*mode, width / np.sqrt(2), cells) for mode in MODES)
    return np.asarray(density / np.max(density))


def measure(setting: Setting) -> Finding:
    """Fly, find the flock's best schedule, and measure the effect of an attractor's weight."""
    seeds, tries = setting.seeds(SEEDS), [500 + seed for seed in game_seeds(setting.seed, TRIED)]
    config = lone_team(DRONES, setting.config)
    drawn = DRAWINGS["two_spots"].density(setting.mapping)
    spread = spreads(config, seeds, drawn)
    least, *_, most = weights_of(config)
    equal = equal_spots(float(spread[:, -1].mean()), len(drawn))
    flights: dict[str, dict[str, Flight]] = {}
    parts_of_schedules, seconds = [], {}
    for name, target, weights in (("drawn", drawn, (least, most)), ("equal", equal, (most, most))):
        schedule = best_schedule(config, tries, target, weights)
        flights[name] = {
            ERGODIC: Flight(start(config, seeds, target)),
            ALONE: flock(config, seeds, target, weights),
            SEQUENCE: flock(config, seeds, target, weights, schedule),
        }
        seconds[name] = {
            (way, kind): median_with_interval(when(flights[name][way].metric))
            for way in (ERGODIC, SEQUENCE)
            for kind, when in (("first", first_reached), ("for good", kept_from))
        }
        parts_of_schedules += [
            Part(f"{name} spots, best schedule: {which} one, s", float(dwell), None, "", ours=True)
            for which, dwell in zip(("lower", "upper"), schedule, strict=True)
        ]
    near = {way: estimate(times_near(one, drawn), lesser) for way, one in flights["drawn"].items()}
    shape, wide = (
        estimate(*arguments)
        for arguments in ((widths(flights["drawn"][ERGODIC]), diffuse_over_compact), (spread, widest_over_narrowest))
    )
    asks = wanted(drawn)[1]
    parts = [
        asked("one drawing: time at the spot served less, over what is asked, above half", near[ERGODIC], above(0.5)),
        asked("one attractor: the same, below half", near[ALONE], below(0.5)),
        asked("attractors in turn: the same, above half", near[SEQUENCE], above(0.5)),
        asked("one drawing: diffuse spot over compact one, rms, above 1", shape, above(1.0)),
        asked("a flock's width with the least weight over that with the largest, above 1", wide, above(1.0)),
        asked("that, over what the drawn spots ask, above 1", _over(wide, float(asks[0] / asks[1])), above(1.0)),
        *(
            asked(f"{name} spots, s to E={REACHED:g} {kind}, {way}", number, ours=True)
            for name, numbers in seconds.items()
            for (way, kind), number in numbers.items()
        ),
        *parts_of_schedules,
    ]
    return Finding(
        parts=parts,
        method=f"bootstrap over {len(seeds)} seeds; order statistics for seconds, which are medians",
        configs={"ergodic": config, "flocking": config.replace(controllers="flocking")},
        seeds=seeds,
        series={
            "target": rounded(interpolated(drawn, CELLS) / interpolated(drawn, CELLS).mean()),
            "maps": {way: rounded(CELLS**2 * one.maps(CELLS).mean(axis=0), 3) for way, one in flights["drawn"].items()},
            "metric": {name: {way: over_seeds(one.metric) for way, one in of.items()} for name, of in flights.items()},
            "weights": weights_of(config),
            "spreads": over_seeds(spread),
            "asked": rounded(asks),
        },
    )


def _over(number: Number, by: float) -> Number:
    value, (low, high) = number
    return value / by, (low / by, high / by)


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw maps of drones, the metric for both targets, and the effect of an attractor's weight."""
    top, bottom = figure.add_gridspec(2, 1)
    cells, curves = top.subgridspec(1, 4), bottom.subgridspec(1, 3)
    maps = [figure.add_subplot(cells[place]) for place in range(4)]
    for axes, (name, histogram) in zip(maps, ({"asked for": series["target"]} | series["maps"]).items(), strict=True):
        style.arena(axes, name)
        axes.set(xlabel="", ylabel="", xticks=(), yticks=())
        image = axes.imshow(histogram, origin="lower", extent=(0, 1, 0, 1), cmap="Greys", vmin=0, vmax=8)
        for middle in MODES:
            look = {"fill": False, "edgecolor": style.DARK, "linestyle": "--", "linewidth": 0.6, "clip_on": False}
            axes.add_patch(style.patch("Circle", middle, NEAR, **look))
    figure.colorbar(image, ax=maps, label=f"time in {SECONDS} s / even cover", extend="max")
    times, (drawn, equal, right) = np.arange(1, SECONDS + 1), (figure.add_subplot(curves[place]) for place in range(3))
    for axes, (name, metrics) in zip((drawn, equal), series["metric"].items(), strict=True):
        for (way, values), colour, dash in zip(metrics.items(), style.SERIES, style.DASHES, strict=False):
            style.band(axes, times, values, colour, dash, way)
        style.mark(axes, REACHED, f"ours: {REACHED:g}")
        axes.set(yscale="log", xlabel="time (s)", xlim=(0, SECONDS), title=f"{name} spots: metric E (mean, 95 %)")
    spread, colour = series["spreads"], style.SERIES[1]
    style.whisker(right, series["weights"], *(spread[key] for key in ("mean", "low", "high")), fmt="o-", color=colour)
    for reach, mode, side in zip(series["asked"], ("diffuse", "compact"), ("bottom", "top"), strict=True):
        right.axhline(reach, color=style.GREY, linewidth=0.7)
        right.text(max(series["weights"]), reach, f"{mode} spot", color=style.GREY, ha="right", va=side)
    right.set(xlabel="weight of the attractor", title="a flock's width (rms, map widths)")
    right.set_ylim(0, 1.25 * max(*series["asked"], *spread["high"]))
    style.legend_below(figure, drawn, 3)


FIGURE = Figure(
    name="flocking_comparison",
    claim="One drawing asks for two targets at once, one diffuse and one compact, which takes a flock a sequence of "
    "attractors; their weights set how compact it is.",
    section="IV-C",
    quote="Our system enables players to specify both targets at once, while flocking requires "
    "both targets to be specified in sequence, one at a time",
    note="Under `paper` a flock is 11 % wider with the least weight than with the largest, where the drawing asks for "
    "28 %. The equal spots are as compact as a flock. This flock differs from the published one: in separation, "
    "constant speed, the limit to turning, cohesion (from a sum there), start and weight. Other flocks may do better. "
    "People were not timed.",
    measure=measure,
    draw=draw,
    height=4.4,
    first="Within 60 s more than half of the ergodic teams reach E = 0.005, and less than half of the flocks.",
    first_held=False,
    revised="A flock does reach it, by a sequence, and that is what the paper says. So the best of some schedules is "
    "flown. How soon is ours to ask.",
)
