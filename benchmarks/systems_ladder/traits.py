"""What control systems can, alone: coverage, and what becomes of it when something changes.

Coverage is the ergodic metric of a team that starts in a corner, with nobody about, against even coverage: 0 is
perfect. Systems are asked for what they do by themselves, which for those that cover is to cover evenly. Of each
change the ratio of the metric with it to the metric without it, on the same starts, is told: 1 is no change.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper.coverage import TARGETS, hand_over, lone_team
from benchmarks.paper.figure import game_seeds
from benchmarks.systems_ladder.bimodal import bimodal_commands
from swarm_pz.config import RED, TICKS_PER_CONTROL_PERIOD, GameConfig
from swarm_pz.config.registry import system_of
from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.intervals import bootstrap, mean_with_interval, median_with_interval, rounded
from swarm_pz.kernels.controllers.ergodic import sobolev_weights
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.commands import make_target
from swarm_pz.simulator.ergodicity import ErgodicMetric

Array = NDArray[np.float64]

SIZES = (5, 10, 20, 40)
"""Drones of a team; the second is that of all other traits."""
LOST = 0.3
"""Share of the drones that is captured."""
TALK, LOSS = 0.2, 0.5
"""Map widths that messages reach, and the share of them that is lost, where talk is hard."""
REACHED = 0.005
"""Ergodic metric at which the bimodal target counts as covered."""

Change = Callable[[Simulator], None]


def measure_traits(system: str, game: GameConfig, *, seed: int, starts: int, seconds: int) -> dict[str, Any]:
    """Return the traits of a control system as plain values, each from so many starts.

    They are `coverage` by size, the ratios `permutation`, `captured`, `leader`, `talk` and `loss`, each a mean with its
    interval, and `bimodal`, what covers two modes. A team flies for so many seconds before it is judged, and before
    something changes.
    """
    rules, seeds, generator = game.replace(controllers=system), game_seeds(seed, starts), np.random.default_rng(seed)
    alone = {size: lone_team(size, rules) for size in SIZES}
    even = {size: _metric(_start(alone[size], seeds), seconds) for size in SIZES}
    usual, before = alone[SIZES[1]], even[SIZES[1]]
    later = _after(_start(usual, seeds), seconds)

    def talking(**numbers: float) -> Array:
        return _metric(_start(usual.replace(controller=usual.controller.replace(**numbers)), seeds), seconds)

    changed = {
        "permutation": (_metric(_permuted(usual, seeds), seconds), before),
        "captured": (_after(_start(usual, seeds), seconds, lambda sim: _capture(sim, LOST, generator)), later),
        "leader": (_after(_start(usual, seeds), seconds, _capture_leader), later),
        "talk": (talking(communication_radius=TALK), before),
        "loss": (talking(message_loss=LOSS), before),
    }
    return {
        "system": system,
        "takes": system_of(system).takes,
        "coverage": {str(size): _mean(values) for size, values in even.items()},
        "size": _ratio(even[SIZES[-1]], even[SIZES[0]]),
        **{name: _ratio(*pair) for name, pair in changed.items()},
        "bimodal": measure_bimodal(system, game, seed=seed, starts=starts, seconds=2 * seconds),
    }


def measure_bimodal(system: str, game: GameConfig, *, seed: int, starts: int, seconds: int) -> dict[str, Any] | None:
    """Return how many commands it takes to cover two modes, and how well they are covered in the end.

    `commands` is their median number, None where most do not; None of all if it is not known here how commands of its
    kind ask for two modes.
    """
    rules = lone_team(SIZES[1], game.replace(controllers=system))
    commands = bimodal_commands(system_of(system), rules)
    if commands is None:
        return None
    simulator = _start(rules, game_seeds(seed, starts))
    metric = ErgodicMetric(simulator, RED)
    sent, needed = np.zeros(starts), np.full(starts, np.inf)
    latest: Any = None
    for second in range(seconds):
        asked = commands(second, simulator)
        if not np.array_equal(asked, latest):
            simulator.command(RED, asked)
            sent, latest = sent + 1, asked
        _observe(simulator, metric, 1)
        needed = np.where(np.isinf(needed) & (_value(metric, TARGETS["bimodal"]) <= REACHED), sent, needed)
    median, interval = median_with_interval(needed)
    return {
        "reached": int(np.isfinite(needed).sum()),
        "starts": starts,
        "commands": _finite(median),
        "commands_ci95": [_finite(end) for end in interval],
        "sent": int(sent[0]),
        "metric": _mean(_value(metric, TARGETS["bimodal"])),
    }


# --- flying -------------------------------------------------------------------------------------------


def _start(config: GameConfig, seeds: list[int]) -> Simulator:
    simulator = Simulator(config, len(seeds))
    simulator.reset(seeds)
    return simulator


def _permuted(config: GameConfig, seeds: list[int]) -> Simulator:
    """Start the same games with the drones in another order."""
    first, simulator = _start(config, seeds), Simulator(config, len(seeds))
    for row, seed in enumerate(seeds):
        order = np.random.default_rng(seed).permutation(config.num_drones)
        simulator.reset([seed], [row], {"positions": first.positions[row][order]})
    return simulator


def _observe(simulator: Simulator, metric: ErgodicMetric, seconds: int) -> None:
    for _ in range(10 * seconds):
        simulator.advance(TICKS_PER_CONTROL_PERIOD)
        metric.observe()


def _value(metric: ErgodicMetric, density: Array) -> Array:
    """Return the metric (E,) against a density, whatever the team was told."""
    coefficients = metric.coefficients
    phi = make_target(density, coefficients.shape[-1])[1]
    weights = sobolev_weights(coefficients.shape[-1])
    return np.asarray((weights * (coefficients - phi) ** 2).sum(axis=(1, 2)), np.float64)


def _metric(simulator: Simulator, seconds: int) -> Array:
    """Fly, and return how evenly the square was covered (E,)."""
    metric = ErgodicMetric(simulator, RED)
    _observe(simulator, metric, seconds)
    return _value(metric, TARGETS["uniform"])


def _after(simulator: Simulator, seconds: int, change: Change | None = None) -> Array:
    """Fly, change something, fly as long again, and return how evenly the square was covered since (E,)."""
    _metric(simulator, seconds)
    if change is not None:
        change(simulator)
    return _metric(simulator, seconds)


def _capture(simulator: Simulator, share: float, generator: np.random.Generator) -> None:
    """Let the other side have some drones of each game, drawn at random."""
    drones = simulator.teams.shape[1]
    order = generator.random(simulator.teams.shape).argsort(axis=1)
    hand_over(simulator, order < round(share * drones))


def _capture_leader(simulator: Simulator) -> None:
    """Let the other side have the drone that is nearest to where the command asks for most, the first of the peaks."""
    cells = simulator.targets.shape[-1]
    peaks = simulator.targets[:, RED].reshape(simulator.num_games, -1).argmax(axis=1)
    places = (np.stack([peaks % cells, peaks // cells], axis=1) + 0.5) / cells
    apart = simulator.positions - places[:, None]
    nearest = (apart * apart).sum(axis=2).argmin(axis=1)
    hand_over(simulator, np.arange(simulator.teams.shape[1]) == nearest[:, None])


# --- numbers ------------------------------------------------------------------------------------------


def _mean(values: Array) -> dict[str, Any]:
    mean, interval = mean_with_interval(values)
    return {"mean": mean, "ci95": list(interval)}


def _ratio(changed: Array, before: Array) -> dict[str, Any]:
    """Return the ratio of two means over the same starts, and its interval from a bootstrap over starts."""
    if (before <= 0).any():
        raise ResultsError(f"coverage before a change must be above 0, got {before.tolist()}")
    pairs = np.stack([changed, before], axis=1)
    ratio, low, high = bootstrap(pairs, lambda drawn: drawn[:, 0].mean() / drawn[:, 1].mean())
    return {"mean": float(ratio), "ci95": rounded(np.array([low, high]))}


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
