"""How coverage depends on who hears whom."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import RED, GameConfig
from swarm_pz.ergodicity import ErgodicMetric, sobolev_weights
from swarm_pz.figures import style
from swarm_pz.figures.coverage import BIMODAL, JUDGED, TARGETS, lone_team, metric_over_time, periods, start
from swarm_pz.figures.finding import Figure, Finding, game_seeds
from swarm_pz.figures.intervals import bootstrap, rounded

SEEDS, DRONES = 60, 12
RADII = (0.0, 0.05, 0.1, 0.2, 0.4, 0.8, 1.5)
"""Map widths; the last one reaches across the square."""
LOSSES = (0.0, 0.5, 0.8, 0.9, 0.95, 1.0)
CLOSE = 0.2
"""How near a team that hears nobody must come to drones that are alone, as a share."""


def _rules(**controller: float) -> GameConfig:
    config = lone_team(DRONES)
    return config.replace(controller=config.controller.replace(**controller))


def alone(seeds: list[int]) -> NDArray[np.float64]:
    """Fly every drone in a game of its own, from the same start: the metric (seeds,) of their pasts together."""
    together = start(lone_team(DRONES), seeds, TARGETS["bimodal"])
    phi, starts = together.games.coefficients[:, RED], together.positions.reshape(-1, 1, 2)
    simulator = start(lone_team(1), [seed for seed in seeds for _ in range(DRONES)], TARGETS["bimodal"])
    simulator.games.positions[:] = starts
    metric = ErgodicMetric(simulator, RED)
    periods(simulator, JUDGED, lambda _: metric.observe())
    modes = phi.shape[-1]
    union = metric.coefficients.reshape(len(seeds), DRONES, modes, modes).mean(axis=1)
    return np.asarray((sobolev_weights(modes) * (union - phi) ** 2).sum(axis=(1, 2)))


def steps_that_fall(means: NDArray[np.float64]) -> int:
    """Count neighbours of which the later one is not larger."""
    return int((np.diff(means) <= 0).sum())


def measure(seed: int) -> Finding:
    """Cover the bimodal target with less and less talk."""
    seeds = game_seeds(seed, SEEDS)
    configs = {f"radius {radius:g}": _rules(communication_radius=radius) for radius in RADII}
    configs |= {f"loss {loss:g}": _rules(message_loss=loss) for loss in LOSSES}
    judged = {
        name: metric_over_time(start(config, seeds, TARGETS["bimodal"]), JUDGED)[:, -1]
        for name, config in configs.items()
    }
    reference = alone(seeds)
    by_radius = np.stack([judged[f"radius {radius:g}"] for radius in RADII[::-1]], axis=1)
    by_loss = np.stack([judged[f"loss {loss:g}"] for loss in LOSSES], axis=1)
    falls = steps_that_fall(by_radius.mean(axis=0)), steps_that_fall(by_loss.mean(axis=0))
    ratio = bootstrap(np.stack([by_radius[:, -1], reference], axis=1), lambda drawn: np.divide(*drawn.mean(axis=0)))
    gain = bootstrap(np.stack([reference, by_radius[:, 0]], axis=1), lambda drawn: np.divide(*drawn.mean(axis=0)))
    supported = sum(falls) == 0 and abs(float(ratio[0]) - 1.0) <= CLOSE
    return Finding(
        statistic={
            "steps_of_radius_without_rise": falls[0],
            "steps_of_loss_without_rise": falls[1],
            "radius_0_over_lone_drones": float(ratio[0]),
            "lone_drones_over_all_to_all": float(gain[0]),
        },
        interval={
            "radius_0_over_lone_drones": (float(ratio[1]), float(ratio[2])),
            "lone_drones_over_all_to_all": (float(gain[1]), float(gain[2])),
        },
        method=f"bootstrap over {SEEDS} seeds; counts of steps are of means",
        supported=supported,
        seen=_describe(by_radius.mean(axis=0), falls, float(ratio[0]), float(gain[0])),
        configs=configs,
        seeds=seeds,
        series={
            "radius": _series(RADII[::-1], by_radius),
            "loss": _series(LOSSES, by_loss),
            "alone": _series((0.0,), reference[:, None]),
        },
    )


def _describe(by_radius: NDArray[np.float64], falls: tuple[int, int], ratio: float, gain: float) -> str:
    # From the largest radius down, the first that is worth nothing any more.
    pairs = zip(RADII[::-1], by_radius, strict=True)
    useless = next(radius for radius, mean in pairs if mean >= 0.8 * by_radius[-1])
    apart = float(np.hypot(*np.subtract(BIMODAL[1][:2], BIMODAL[0][:2])))
    text = (
        f"{DRONES} drones on the bimodal target, metric after {JUDGED} s over {SEEDS} seeds. Lone drones, which know "
        f"of nobody, do {gain:.0f} times worse than a team in which all hear all; a team with radius 0 does as they "
        f"do (ratio {ratio:.2f}). More loss makes it worse at {len(LOSSES) - 1 - falls[1]} of {len(LOSSES) - 1} "
        f"steps, a smaller radius at {len(RADII) - 1 - falls[0]} of {len(RADII) - 1}."
    )
    if sum(falls):
        text += (
            f" From a radius of {useless:g} map widths on down talk is worth little or nothing here, and the order "
            f"among such radii is not the claimed one: the two modes are {apart:.1f} apart, and who hears only of its "
            "own does not learn how the other one is covered."
        )
    return text


def _series(x: tuple[float, ...], values: NDArray[np.float64]) -> dict[str, Any]:
    mean, low, high = (rounded(part) for part in bootstrap(values))
    return {"x": list(x), "mean": mean, "low": low, "high": high}


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw the metric against radius and against loss, beside lone drones and all-to-all."""
    panels = figure.subplots(1, 2, sharey=True)
    radii = [f"{radius:g}" if radius < max(RADII) else "all" for radius in series["radius"]["x"]]
    losses = [f"{100 * loss:g}" for loss in series["loss"]["x"]]
    lone = series["alone"]
    titles = {"radius": "who is near enough to hear", "loss": "what gets lost on the way"}
    for axes, name, labels in zip(panels, ("radius", "loss"), (radii, losses), strict=True):
        places = np.arange(len(labels))
        values = [series[name][key] for key in ("mean", "low", "high")]
        axes.axhspan(lone["low"][0], lone["high"][0], color=style.SERIES[1], alpha=0.25, label="lone drones, 95 %")
        axes.axhline(lone["mean"][0], color=style.SERIES[1], linewidth=1)
        style.whisker(axes, places, *values, fmt="o-", color=style.SERIES[0], label=f"mean over {SEEDS} seeds, 95 %")
        axes.set_xticks(places, labels)
        axes.set(yscale="log", title=f"{titles[name]}: less talk to the right")
        axes.annotate("lone drones", (0, lone["high"][0]), (-6, 3), textcoords="offset points", color=style.SERIES[1])
    panels[0].set(xlabel="communication radius (map widths)", ylabel=f"ergodic metric E after {JUDGED} s (no unit)")
    panels[1].set_xlabel("messages lost (%)")
    handles, _ = panels[0].get_legend_handles_labels()
    style.legend_below(figure, handles)


FIGURE = Figure(
    name="communication",
    title=f"{DRONES} drones that hear less and less of each other",
    claim="Talk is what makes drones a team: coverage gets worse as the communication radius falls and as messages "
    "are lost, down to that of lone drones.",
    paper="The paper's control is decentralized: drones share coefficients of where they have been. We know of no "
    "picture in it of what happens when they cannot.",
    rule=f"The mean metric after {JUDGED} s rises at every step to a smaller radius and to more loss, and with radius "
    f"0 it is within {100 * CLOSE:.0f} % of that of lone drones.",
    measure=measure,
    draw=draw,
    size=(10.5, 4.4),
    seconds=15,
)
