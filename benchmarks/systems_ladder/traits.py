"""What control systems can, alone: even coverage, a target of each one's own kind, and what changes do to it.

All numbers are ergodic metrics of a team that starts in a corner, with nobody about: 0 is perfect. Changes are judged
by a target that the system can reach: even coverage for systems that cover, a Gaussian in the middle for those that
fly to places. What is told is how well a team keeps it with the change, by how well it does without, on the same
starts: 1 is no change.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper.coverage import BIMODAL, TARGETS, hand_over, lone_team
from benchmarks.paper.figure import game_seeds
from benchmarks.systems_ladder.asking import Commands, Modes, commands_for, density_of
from benchmarks.systems_ladder.contest import TRACKS, rules_of_track
from swarm_pz.config import RED, TICKS_PER_CONTROL_PERIOD, GameConfig
from swarm_pz.config.registry import system_of
from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.intervals import bootstrap, mean_with_interval, median_with_interval, rounded
from swarm_pz.kernels.controllers.ergodic import sobolev_weights
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.commands import make_target
from swarm_pz.simulator.ergodicity import ErgodicMetric

Array = NDArray[np.float64]

SIZE, SIZES = 10, (5, 40)
"""Drones of a team, and of the two that are compared."""
EVEN: Modes = ()
MIDDLE: Modes = ((0.5, 0.5, 0.1),)
LOST = 0.3
"""Share of the drones that is captured."""
TALK = 0.2
"""Map widths that messages reach where talk is hard."""
REACHED = 0.005
"""Ergodic metric at which the bimodal target counts as covered."""

Change = Callable[[Simulator], None]


def measure_traits(system: str, game: GameConfig, *, seed: int, starts: int, seconds: int) -> dict[str, Any]:
    """Return the traits of a control system as plain values, each from so many starts.

    They are `even`, the metric of even coverage by track; `own`, that of its own `target`; the ratios of this, `size`,
    `permutation`, `captured`, `leader` and `talk`; and `bimodal`, what covers two modes. All but the last and
    the ratios are means with their intervals. A team flies for so many seconds before anything changes, and as long
    again, which is judged.
    """
    rules, seeds, generator = game.replace(controllers=system), game_seeds(seed, starts), np.random.default_rng(seed)
    usual = lone_team(SIZE, rules)

    def keeping(config: GameConfig, change: Change | None = None, start: Any = _start) -> Array:
        return _kept(start(config, seeds), system, seconds, change)

    def talking(**numbers: float) -> Array:
        return keeping(usual.replace(controller=usual.controller.replace(**numbers)))

    own = keeping(usual)
    few, many = (keeping(lone_team(size, rules)) for size in SIZES)
    changed = {
        "size": (many, few),
        "permutation": (keeping(usual, start=_permuted), own),
        "captured": (keeping(usual, lambda sim: _capture(sim, LOST, generator)), own),
        "leader": (keeping(usual, _capture_leader), own),
        "talk": (talking(communication_radius=TALK), own),
    }
    return {
        "system": system,
        "takes": system_of(system).takes,
        "target": "even" if own_target(system) == EVEN else "middle",
        "even": {
            track: _mean(_even(_start(lone_team(SIZE, rules_of_track(track, rules)), seeds), seconds))
            for track in TRACKS
        },
        "own": _mean(own),
        **{name: _ratio(*pair) for name, pair in changed.items()},
        "bimodal": measure_bimodal(system, game, seed=seed, starts=starts, seconds=2 * seconds),
    }


def own_target(system: str) -> Modes:
    """Return the target of a system that its changes are judged by."""
    return EVEN if system_of(system).takes in ("density", "attraction") else MIDDLE


def measure_bimodal(system: str, game: GameConfig, *, seed: int, starts: int, seconds: int) -> dict[str, Any] | None:
    """Return how many commands it takes to cover two modes, and how well they are covered in the end.

    `commands` is their median number, None where most do not; None of all if it is not known here how commands of its
    kind ask for two modes.
    """
    rules = lone_team(SIZE, game.replace(controllers=system))
    commands = commands_for(BIMODAL, system_of(system), rules)
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


def _even(simulator: Simulator, seconds: int) -> Array:
    """Fly, and return how evenly the square was covered (E,)."""
    metric = ErgodicMetric(simulator, RED)
    _observe(simulator, metric, seconds)
    return _value(metric, TARGETS["uniform"])


def _kept(simulator: Simulator, system: str, seconds: int, change: Change | None = None) -> Array:
    """Ask for the system's own target, fly, change something, fly as long again, and return the metric since (E,)."""
    target = own_target(system)
    commands = commands_for(target, system_of(system), simulator.config) if target else None
    _follow(simulator, commands, seconds)
    if change is not None:
        change(simulator)
    return _value(_follow(simulator, commands, seconds), density_of(target))


def _follow(simulator: Simulator, commands: Commands | None, seconds: int) -> ErgodicMetric:
    """Fly, and send the command of every second if it is another one; without any, it does what it does by itself."""
    metric = ErgodicMetric(simulator, RED)
    latest: Any = None
    for second in range(seconds):
        asked = None if commands is None else commands(second, simulator)
        if asked is not None and not np.array_equal(asked, latest):
            simulator.command(RED, asked)
            latest = asked
        _observe(simulator, metric, 1)
    return metric


def _capture(simulator: Simulator, share: float, generator: np.random.Generator) -> None:
    """Let the other side have some drones of each game, drawn at random."""
    drones = simulator.teams.shape[1]
    order = generator.random(simulator.teams.shape).argsort(axis=1)
    hand_over(simulator, order < round(share * drones))


def _capture_leader(simulator: Simulator) -> None:
    """Let the other side have the drone that is nearest to the middle."""
    apart = simulator.positions - 0.5
    nearest = (apart * apart).sum(axis=2).argmin(axis=1)
    hand_over(simulator, np.arange(simulator.teams.shape[1]) == nearest[:, None])


# --- numbers ------------------------------------------------------------------------------------------


def _mean(values: Array) -> dict[str, Any]:
    mean, interval = mean_with_interval(values)
    return {"mean": mean, "ci95": list(interval)}


def _ratio(changed: Array, before: Array) -> dict[str, Any]:
    """Return the ratio of two means over the same starts, and its interval from a bootstrap over starts."""
    if (before <= 0).any():
        raise ResultsError(f"a metric without a change must be above 0, got {before.tolist()}")
    pairs = np.stack([changed, before], axis=1)
    ratio, low, high = bootstrap(pairs, lambda drawn: drawn[:, 0].mean() / drawn[:, 1].mean())
    return {"mean": float(ratio), "ci95": rounded(np.array([low, high]))}


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
