"""Flights for the comparison with flocking: what three ways to command two modes make of them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import RED, GameConfig
from swarm_pz.evaluation.intervals import rounded
from swarm_pz.figures.coverage import BIMODAL, SECONDS, TARGETS, gaussian, lone_team, over_seeds, periods, start
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.commands import FlockingCommand
from swarm_pz.simulator.ergodicity import ErgodicMetric

DRONES = 12
REACHED = 0.005
"""Ergodic metric at which the target counts as reached."""
CELLS = 25
"""Cells a side of the maps."""
NEAR = 0.25
"""Map widths within which a drone counts as near a mode."""
ERGODIC, SEQUENCE, ADAPTER = "ergodic: one density", "flocking: two attractors", "flocking: the density's mode"
COMMANDS = {ERGODIC: 1, SEQUENCE: 2, ADAPTER: 1}

Array = NDArray[np.float64]


def first_reached(metric: Array) -> Array:
    """Return the second (seeds,) after which a metric (seeds, seconds) is first low enough; infinite for never."""
    low = metric <= REACHED
    return np.where(low.any(axis=1), low.argmax(axis=1) + 1.0, np.inf)


def near_modes(places: Array) -> Array:
    """Return, for places (..., 2), the squared distance to each mode (..., 2); NaN where not near."""
    squared = np.stack([((places - mode[:2]) ** 2).sum(axis=-1) for mode in np.array(BIMODAL)], axis=-1)
    return np.where(squared <= NEAR**2, squared, np.nan)


def asked() -> tuple[Array, Array]:
    """Return the share of the target's mass near each mode, and its rms distance from the mode there."""
    cells = 400
    target = gaussian(*BIMODAL[0], cells) + gaussian(*BIMODAL[1], cells)
    centres = (np.arange(cells) + 0.5) / cells
    squared = near_modes(np.stack(np.meshgrid(centres, centres), axis=-1))
    weights = target[..., None] * np.isfinite(squared)
    share = weights.sum(axis=(0, 1)) / target.sum()
    return share, np.sqrt((weights * np.nan_to_num(squared)).sum(axis=(0, 1)) / weights.sum(axis=(0, 1)))


class Flight:
    """What one controller did in all games.

    Attributes
    ----------
    metric : float64 array (seeds, seconds)
    map : float64 array (CELLS, CELLS)
        Where drones were, in multiples of an even cover.
    shares : float64 array (seeds, 2)
        Share of all drones' time near each mode.
    reaches : float64 array (2,)
        Their rms distance from the mode there; NaN where nobody came.
    seconds : float64 array (seeds,)
        When the target was reached; infinite for never.
    """

    def __init__(self, simulator: Simulator, each_second: Callable[[int], None] | None = None) -> None:
        self.config = simulator.config
        metric, values, places = ErgodicMetric(simulator, RED), [], []

        def observe(number: int) -> None:
            metric.observe()
            places.append(simulator.positions.astype(np.float64))
            if number % 10 == 0:
                values.append(metric.value())
                if each_second is not None:
                    each_second(number // 10)

        periods(simulator, SECONDS, observe)
        self.metric = np.stack(values, axis=1)
        past = np.stack(places, axis=1)
        edges = np.linspace(0, 1, CELLS + 1)
        counts = np.histogram2d(past[..., 1].ravel(), past[..., 0].ravel(), bins=(edges, edges))[0]
        self.map = counts / counts.mean()
        squared = near_modes(past)
        self.shares = np.isfinite(squared).mean(axis=(1, 2))
        near = np.isfinite(squared).sum(axis=(0, 1, 2))
        self.reaches = np.sqrt(np.nansum(squared, axis=(0, 1, 2)) / np.where(near > 0, near, np.nan))
        self.seconds = first_reached(self.metric)

    def series(self, commands: int) -> dict[str, Any]:
        """Return what is drawn."""
        return {
            "commands": commands,
            "map": rounded(self.map, 3),
            "metric": over_seeds(self.metric),
            "seconds": [float(value) if np.isfinite(value) else None for value in self.seconds],
            "share": over_seeds(self.shares),
            "reach": [float(f"{value:.4g}") if np.isfinite(value) else None for value in self.reaches],
        }


def fly(seeds: list[int]) -> dict[str, Flight]:
    """Fly all games with each controller."""
    ergodic = lone_team(DRONES)
    flocking = lone_team(DRONES, GameConfig(controllers="flocking"))
    simulator = start(flocking, seeds, TARGETS["bimodal"])

    def send(mode: int) -> None:
        command = FlockingCommand(position=BIMODAL[mode][:2], weight=flocking.flocking.migration[1])
        simulator.command(RED, [command] * len(seeds))
        # The metric compares with the whole target, whichever attractor is in force.
        simulator.games.coefficients[:] = wanted

    wanted = simulator.games.coefficients.copy()
    send(0)
    sequence = Flight(simulator, lambda second: send(1) if second == SECONDS // 2 else None)
    return {
        ERGODIC: Flight(start(ergodic, seeds, TARGETS["bimodal"])),
        SEQUENCE: sequence,
        ADAPTER: Flight(start(flocking, seeds, TARGETS["bimodal"])),
    }


def target_map() -> Array:
    """Return the target on the maps' cells, its mean 1."""
    target = gaussian(*BIMODAL[0], CELLS) + gaussian(*BIMODAL[1], CELLS)
    return np.asarray(target / target.mean())
