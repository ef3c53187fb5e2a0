"""How coverage depends on who hears whom."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper import style
from benchmarks.paper.coverage import JUDGED, TARGETS, lone_team, over_seeds, periods, start
from benchmarks.paper.figure import Figure, Finding, Part, Setting, asked, estimate
from benchmarks.paper.talk import (
    CLOSE,
    DRONES,
    RADII,
    covered,
    over_talk,
    radius_names,
    ratio,
    rules,
    steps_that_fall,
    times_silence,
)
from swarm_pz.config import RED
from swarm_pz.kernels.controllers.ergodic import sobolev_weights
from swarm_pz.simulator.ergodicity import ErgodicMetric

SEEDS = 20
LOSSES = (0.0, 0.5, 0.8, 0.9, 0.95, 1.0)


def alone(seeds: list[int], target: str) -> NDArray[np.float64]:
    """Fly every drone in a game of its own, from the same start: the metric (seeds,) of their pasts together."""
    together = start(lone_team(DRONES), seeds, TARGETS[target])
    phi, starts = together.games.coefficients[:, RED], together.positions.reshape(-1, 1, 2)
    simulator = start(lone_team(1), [seed for seed in seeds for _ in range(DRONES)], TARGETS[target])
    simulator.games.positions[:] = starts
    metric = ErgodicMetric(simulator, RED)
    periods(simulator, JUDGED, lambda _: metric.observe())
    modes = phi.shape[-1]
    union = metric.coefficients.reshape(len(seeds), DRONES, modes, modes).mean(axis=1)
    return np.asarray((sobolev_weights(modes) * (union - phi) ** 2).sum(axis=(1, 2)))


def measure(setting: Setting) -> Finding:
    """Cover the targets with less and less talk."""
    seeds = setting.seeds(SEEDS)
    by_radius = {f"radius {radius:g}": rules(communication_radius=radius) for radius in RADII}
    by_loss = {f"loss {loss:g}": rules(message_loss=loss) for loss in LOSSES}
    radius, loss = covered(by_radius, seeds), covered(by_loss, seeds)
    lone = np.stack([alone(seeds, target) for target in TARGETS], axis=1)
    # The last radius and the last loss leave nobody to hear.
    parts = [
        Part(
            f"of {len(TARGETS) * (values.shape[-1] - 1)} steps to {what}, lower the metric, none",
            float(falls := steps_that_fall(values).sum()),
            None,
            not falls,
            ours=True,
        )
        for what, values in (("a smaller radius", radius), ("more loss", loss))
    ]
    for place, target in enumerate(TARGETS):
        silent = ratio(radius[:, place, -1], lone[:, place])
        text = f"{target}: radius 0 over lone drones, within {100 * CLOSE:.0f} %"
        parts.append(asked(text, silent, lambda *_, value=silent[0]: abs(value - 1.0) <= CLOSE, ours=True))
    parts.append(asked("worst radius over radius 0", estimate(radius, times_silence), ours=True))
    parts += [
        asked(f"{target}: lone drones over all hearing all", ratio(lone[:, place], radius[:, place, 0]), ours=True)
        for place, target in enumerate(TARGETS)
    ]
    with_lone = np.concatenate([radius, lone[..., None]], axis=-1)
    return Finding(
        parts=parts,
        method=f"bootstrap over {len(seeds)} seeds; a step falls if the whole interval of its mean does",
        configs=by_radius | by_loss,
        seeds=seeds,
        series={
            name: {target: over_seeds(values[:, place]) for place, target in enumerate(TARGETS)}
            for name, values in (("radius", with_lone), ("loss", loss))
        },
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw the metric against radius and against loss, a line a target."""
    panels = style.panels(figure, 2, (1, 2), sharey=True)
    names = {"radius": [*radius_names(RADII), "lone"], "loss": [f"{100 * loss:g}" for loss in LOSSES]}
    titles = {"radius": "who is near enough to hear", "loss": "what gets lost on the way"}
    for axes, name in zip(panels, titles, strict=True):
        over_talk(axes, names[name], {f"target: {target}": found for target, found in series[name].items()})
        axes.set_title(titles[name])
    panels[0].set_ylabel(f"E after {JUDGED} s")
    panels[1].set_xlabel("messages lost (%)")
    style.legend_below(figure, panels[0], (1, 3))


FIGURE = Figure(
    name="communication",
    claim="Talk is what makes drones a team: coverage gets worse as the communication radius falls and as messages "
    "are lost, down to that of lone drones.",
    note=f"The metric of {DRONES} drones after {JUDGED} s.",
    measure=measure,
    draw=draw,
    heights=(4.6, 2.6),
    seconds=15,
    revised="it was measured on the bimodal target alone, and a step counted as falling without regard to its "
    "interval; the claim did not hold then, either.",
    presets=("paper",),
)
