"""Coverage by a team whose drones are renumbered."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper import style
from benchmarks.paper.coverage import (
    JUDGED,
    SOON,
    ErgodicMetric,
    give,
    lone_team,
    over_seeds,
    periods,
    start,
    worst_fall,
)
from benchmarks.paper.drawings import DRAWINGS
from benchmarks.paper.figure import CONVERGED, Figure, Finding, Setting, asked, below, estimate, exactly, within
from swarm_pz.config import RED, TICKS_PER_CONTROL_PERIOD, GameConfig
from swarm_pz.evaluation.intervals import rounded
from swarm_pz.kernels.game import Games
from swarm_pz.simulator import Simulator

SEEDS, DRONES = 20, 24
SHOWN = "two_spots"
"""The drawing whose flights are shown."""
WARM_UP = 5
"""Seconds of game before drones are permuted."""
ROUNDING = 1e-6
"""Largest difference in map widths after one control period: some roundings of float32."""
SAME = 0.0001
"""Difference of the ergodic metric that counts as none."""
_SECOND_AXIS = (
    "positions", "velocities", "accelerations", "altitudes", "teams", "memory_weight", "plans", "capture_ticks",
    "failed",
)  # fmt: skip


def permuted(games: Games, order: NDArray[np.int64]) -> Games:
    """Return games in which drone i is the former drone `order[i]`."""
    changed = {name: getattr(games, name)[:, order] for name in _SECOND_AXIS}
    memory = games.memory.copy()
    memory[..., : len(order)] = games.memory[..., order]
    return games._replace(**changed, memory=memory, trails=np.ascontiguousarray(games.trails[..., order]))


def distance(one: Simulator, other: Simulator, order: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return, for each game, the largest distance (E,) between a drone and its permuted self."""
    apart = one.positions[:, order].astype(np.float64) - other.positions
    return np.asarray(np.hypot(apart[..., 0], apart[..., 1]).max(axis=1))


def fly_both(config: GameConfig, seeds: list[int], order: NDArray[np.int64], command: Any) -> tuple[Any, Any]:
    """Fly every game twice, once with its drones in another order.

    Returns the metric of both (control periods, 2, seeds), and the distance between drones and their permuted selves
    (control periods, seeds).
    """
    one, other = (start(config, seeds, command) for _ in range(2))
    other.restore(permuted(one.snapshot(), order))
    give(other, command)
    metrics = [ErgodicMetric(simulator, RED) for simulator in (one, other)]
    apart, values = [], []

    def observe(_: int) -> None:
        other.advance(TICKS_PER_CONTROL_PERIOD)
        for metric in metrics:
            metric.observe()
        apart.append(distance(one, other, order))
        values.append([metric.value() for metric in metrics])

    periods(one, JUDGED, observe)
    return np.array(values), np.array(apart)


def largest_mean(differences: Any) -> Any:
    """Return the drawing's mean that is farthest from 0, of differences (seeds, drawings)."""
    means = differences.mean(axis=0)
    return means[np.abs(means).argmax()]


def measure(setting: Setting) -> Finding:
    """Compare the flights of both orders, for each drawing, and one control period amid a game."""
    config, seeds = lone_team(DRONES, setting.config), setting.seeds(SEEDS)
    order = np.random.default_rng(setting.seed).permutation(DRONES)
    commands = {name: drawing.density(setting.mapping) for name, drawing in DRAWINGS.items()}
    one, other = (start(config, seeds, commands[SHOWN]) for _ in range(2))
    one.advance(30 * WARM_UP)
    other.restore(permuted(one.snapshot(), order))
    one.advance(TICKS_PER_CONTROL_PERIOD)
    other.advance(TICKS_PER_CONTROL_PERIOD)
    largest = float(distance(one, other, order).max())

    flown = {name: fly_both(config, seeds, order, command) for name, command in commands.items()}
    metric = np.stack([curves for curves, _ in flown.values()])  # (drawings, control periods, 2, seeds)
    shown, apart = flown[SHOWN]
    return Finding(
        parts=[
            asked(
                f"swapped drones converge: E after {JUDGED} s over {SOON} s, worst of three, below {CONVERGED:g}",
                estimate(metric[:, 9::10, 1].transpose(2, 0, 1), worst_fall),
                below(CONVERGED),
            ),
            asked(
                f"to swap them changes E after {JUDGED} s by at most {SAME:g}, worst of three",
                estimate((metric[:, -1, 1] - metric[:, -1, 0]).T, largest_mean),
                within(SAME),
            ),
            exactly(
                f"farthest drone after a control period, at most {ROUNDING:g} map widths",
                largest,
                largest <= ROUNDING,
                ours=True,
            ),
        ],
        method=f"bootstrap over {len(seeds)} seeds",
        configs={"lone team": config},
        seeds=seeds,
        series={
            "largest_distance": rounded(np.median(apart, axis=1)),
            "most_distance": rounded(np.max(apart, axis=1)),
            "original": over_seeds(shown[:, 0].T),
            "permuted": over_seeds(shown[:, 1].T),
        },
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw the distances between drones and their permuted selves, and the metric of both orders."""
    left, right = figure.subplots(1, 2)
    times = 0.1 * np.arange(1, len(series["largest_distance"]) + 1)
    for name, dash, label in (
        ("largest_distance", "-", "median of the games"),
        ("most_distance", ":", "farthest of all games"),
    ):
        left.plot(times, np.maximum(series[name], 1e-9), dash, color=style.SERIES[2], label=label)
    style.mark(left, ROUNDING, "ours, for the first control period")
    left.set(yscale="log", xlabel="time since the permutation (s)", xlim=(0, times[-1]))
    left.set(ylabel="farthest drone (map widths)", title="single drones: what rounding does")
    left.legend(loc="lower right")
    for name, colour, dash in (("original", style.SERIES[0], "-"), ("permuted", style.SERIES[1], "--")):
        style.band(right, times, series[name], colour, dash, f"{name} order (mean, 95 %)")
    right.set(yscale="log", xlabel="time (s)", xlim=(0, times[-1]))
    right.set(ylabel="ergodic metric E (no unit)", title="the team: the same coverage")
    right.legend(loc="upper right")


FIGURE = Figure(
    name="permutation_invariance",
    claim="Control is permutation-invariant: it does not matter which drone is which.",
    section="III-C",
    quote="If Agent 1, Agent 2, etc. swapped positions, the swarm would still converge to the player's target",
    first="A control period after a permutation no drone is farther than 1e-6 map widths from its permuted self, and E "
    "after 30 s on a raw target differs by at most 0.0001.",
    first_held=True,
    revised="The paper says that swapped drones still converge, so that is asked as well. Its targets are drawn.",
    note="Under `paper` the game is chaotic: rounding alone soon changes the paths of single drones. The team covers "
    "as before.",
    measure=measure,
    draw=draw,
    height=2.3,
)
