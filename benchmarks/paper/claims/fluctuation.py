"""Whether a team keeps to its target while captures make it smaller and larger."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper import style
from benchmarks.paper.coverage import COVERED, JUDGED, TARGETS, hand_over, metric_over_time, over_seeds, start
from benchmarks.paper.curves import over_time
from benchmarks.paper.figure import Figure, Finding, game_seeds
from swarm_pz.config import RED, CaptureConfig, GameConfig
from swarm_pz.evaluation.intervals import mean_with_interval

SEEDS, DRONES = 20, 12
"""Games, and drones of each team at the start."""
LOST, LOST_AT = 4, 10
"""Of red's drones, how many are captured at once, and in which second."""
PERIODS = 10
"""Control periods in a second."""


def some_at_once(second: int, teams: NDArray[np.int8], generator: np.random.Generator) -> NDArray[np.int64]:
    """Return `LOST` of red's drones in one second, nobody before and after: who changes sides in a game."""
    return generator.choice(np.flatnonzero(teams == RED), LOST if second == LOST_AT else 0, replace=False)


def one_a_second(_: int, teams: NDArray[np.int8], generator: np.random.Generator) -> NDArray[np.int64]:
    """Return one drone of either team, each as likely as the others."""
    return generator.choice(len(teams), 1)


CHANGES: dict[str, Callable[[int, NDArray[np.int8], np.random.Generator], NDArray[np.int64]] | None] = {
    "nobody changes sides": None,
    f"{LOST} of {DRONES} captured at {LOST_AT} s": some_at_once,
    "a drone changes sides each second": one_a_second,
}


def fly(config: GameConfig, seeds: Sequence[int], target: str, changes: str) -> NDArray[np.float64]:
    """Return red's metric (seeds, seconds) over the places of whoever was red at the time."""
    simulator = start(config, seeds, TARGETS[target])
    generators = [np.random.default_rng([seed, 1]) for seed in seeds]
    choose = CHANGES[changes]

    def then(number: int) -> None:
        if choose is None or number % PERIODS:
            return
        chosen = np.zeros(simulator.teams.shape, np.bool_)
        for row, generator in enumerate(generators):
            chosen[row, choose(number // PERIODS, simulator.teams[row], generator)] = True
        hand_over(simulator, chosen)

    return metric_over_time(simulator, then=then)


def measure(seed: int) -> Finding:
    """Cover all targets while nobody, some at once, or one after the other change sides."""
    seeds = game_seeds(seed, SEEDS)
    config = GameConfig(drones_per_team=DRONES, capture=CaptureConfig(enabled=False))
    metric = {changes: {target: fly(config, seeds, target, changes) for target in TARGETS} for changes in CHANGES}
    judged = {
        changes: {target: mean_with_interval(values[:, JUDGED - 1]) for target, values in found.items()}
        for changes, found in metric.items()
    }
    parts = {
        changes: all(interval[1] <= COVERED for _, interval in judged[changes].values())
        for changes in list(CHANGES)[1:]
    }
    named = {
        f"metric_at_{JUDGED}_s_{changes.replace(' ', '_')}_{target}": found
        for changes, targets in judged.items()
        for target, found in targets.items()
    }
    said = "; ".join(
        f"{changes}: " + ", ".join(f"{mean:.5f} ({target})" for target, (mean, _) in found.items())
        for changes, found in judged.items()
    )
    unsure = [
        f"{target} ({changes}: {interval[0]:.5f} to {interval[1]:.5f})"
        for changes in parts
        for target, (_, interval) in judged[changes].items()
        if interval[1] > COVERED
    ]
    return Finding(
        numbers={**named},
        method=f"bootstrap over {SEEDS} seeds",
        holds=parts,
        seen=f"Red's {DRONES} drones follow one command, sent once; blue's {DRONES} cover the square. Captured drones "
        f"are drawn by lot. The metric of all places where red's drones were, after {JUDGED} s: {said}."
        + (f" Not surely at most {COVERED:g}: {', '.join(unsure)}." if unsure else ""),
        configs={"two teams": config},
        seeds=seeds,
        series={target: {changes: over_seeds(metric[changes][target]) for changes in CHANGES} for target in TARGETS},
    )


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw the metric over time for each target, a line for each way of changing sides."""
    style.for_targets(figure, series, over_time, "ergodic metric E (no unit; 0: covered exactly)")


FIGURE = Figure(
    name="fluctuation",
    title=f"{DRONES} drones and their target while captures change who they are (means over {SEEDS} seeds, bands 95 %)",
    claim="A team converges to its last target whatever the number of its drones, also while captures change it.",
    section="III-C",
    quote="Even if the number of agents under their control is fluctuating, their swarm will still converge to their "
    "last target.",
    paper="The paper says so of its decentralized control, since no command depends on how many drones there are; it "
    "shows teams of fixed size.",
    rule=f"On all three targets the mean metric after {JUDGED} s is at most {COVERED:g}, as asked of teams of fixed "
    f"size, with its whole interval: where {LOST} of {DRONES} drones are captured after {LOST_AT} s, and where of "
    f"{2 * DRONES} drones one changes sides each second, which is about as often as in a game.",
    measure=measure,
    draw=draw,
    size=(11.5, 4.4),
    seconds=12,
)
