"""Flights for the comparison with flocking: what three ways to command two modes make of them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper.coverage import SECONDS, Flight, lone_team, over_seeds, start
from benchmarks.paper.drawings import DRAWINGS, interpolated
from swarm_pz.config import RED, TICKS_PER_SECOND, GameConfig
from swarm_pz.evaluation.intervals import rounded
from swarm_pz.simulator import Simulator
from swarm_pz.systems import FlockingCommand

DRONES = 12
DRAWING = DRAWINGS["two_spots"]
MODES = ((0.3, 0.3), (0.77, 0.77))
"""Middles of the drawing's spots: a diffuse one at the lower left, a compact one at the upper right."""
REACHED = 0.005
"""Ergodic metric at which the target counts as reached."""
CELLS = 25
"""Cells a side of the maps."""
NEAR = 0.25
"""Map widths within which a drone counts as near a mode."""
SETTLED = 10
"""Seconds that a flock gets to come to its attractor before its spread is measured."""
ERGODIC, SEQUENCE, ADAPTER = "ergodic: one drawing", "flocking: two attractors", "flocking: the drawing's mode"
COMMANDS = {ERGODIC: 1, SEQUENCE: 2, ADAPTER: 1}

Array = NDArray[np.float64]


def first_reached(metric: Array) -> Array:
    """Return the second (seeds,) after which a metric (seeds, seconds) is first low enough; infinite for never."""
    low = metric <= REACHED
    return np.where(low.any(axis=1), low.argmax(axis=1) + 1.0, np.inf)


def near_modes(places: Array) -> Array:
    """Return, for places (..., 2), the squared distance to each mode (..., 2); NaN where not near."""
    squared = np.stack([((places - np.array(mode)) ** 2).sum(axis=-1) for mode in MODES], axis=-1)
    return np.where(squared <= NEAR**2, squared, np.nan)


def asked() -> tuple[Array, Array]:
    """Return the share of the target's mass near each mode, and its rms distance from the mode there."""
    cells = 400
    target = interpolated(DRAWING.density, cells)
    centres = (np.arange(cells) + 0.5) / cells
    squared = near_modes(np.stack(np.meshgrid(centres, centres), axis=-1))
    weights = target[..., None] * np.isfinite(squared)
    share = weights.sum(axis=(0, 1)) / target.sum()
    return share, np.sqrt((weights * np.nan_to_num(squared)).sum(axis=(0, 1)) / weights.sum(axis=(0, 1)))


def switch() -> int:
    """Return the second at which a flock should leave the first mode, to be at both as long as the target asks."""
    shares, _ = asked()
    return round(SECONDS * float(shares[0] / shares.sum()))


def fly(seeds: list[int]) -> dict[str, Flight]:
    """Fly all games in each way."""
    ergodic, flocking = lone_team(DRONES), lone_team(DRONES, GameConfig(controllers="flocking"))
    simulator = start(flocking, seeds, DRAWING.density)
    wanted, second_mode = simulator.games.coefficients.copy(), switch()

    def send(mode: int) -> None:
        # The diffuse one with the least weight that there is, the compact one with the largest.
        _attract(simulator, MODES[mode], flocking.flocking.migration[mode])
        # The metric compares with the whole target, whichever attractor is in force.
        simulator.games.coefficients[:] = wanted

    send(0)
    sequence = Flight(simulator, lambda second: send(1) if second == second_mode else None)
    return {
        ERGODIC: Flight(start(ergodic, seeds, DRAWING.density)),
        SEQUENCE: sequence,
        ADAPTER: Flight(start(flocking, seeds, DRAWING.density)),
    }


def _attract(simulator: Simulator, place: tuple[float, float], weight: float) -> None:
    simulator.command(RED, [FlockingCommand(position=place, weight=weight)] * simulator.num_games)


def weights() -> list[float]:
    """Return attractors' weights, from the least to the largest that there is."""
    return [float(weight) for weight in np.linspace(*GameConfig().flocking.migration, 6)]


def spreads(seeds: list[int]) -> Array:
    """Return the rms distance (seeds, weights) that flocks keep from an attractor in the middle, by its weight."""
    config, found = lone_team(DRONES, GameConfig(controllers="flocking")), []
    for weight in weights():
        simulator = start(config, seeds, DRAWING.density)
        _attract(simulator, (0.5, 0.5), weight)
        simulator.advance(SETTLED * TICKS_PER_SECOND)
        places = Flight(simulator).places
        found.append(np.sqrt(((places - 0.5) ** 2).sum(axis=-1).mean(axis=(1, 2))))
    return np.stack(found, axis=1)


def reaches_of(places: Array) -> Array:
    """Return the rms distance (2,) from each mode of drones near it, of places (..., 2); NaN where nobody came."""
    squared = near_modes(places).reshape(-1, len(MODES))
    near = np.isfinite(squared).sum(axis=0)
    return np.asarray(np.sqrt(np.nansum(squared, axis=0) / np.where(near > 0, near, np.nan)))


def series(flight: Flight, commands: int) -> dict[str, Any]:
    """Return what is drawn of a flight: its map in multiples of an even cover, and its time near each mode."""
    shares, reaches = np.isfinite(near_modes(flight.places)).mean(axis=(1, 2)), reaches_of(flight.places)
    return {
        "commands": commands,
        "map": rounded(CELLS**2 * flight.maps(CELLS).mean(axis=0), 3),
        "metric": over_seeds(flight.metric),
        "share": over_seeds(shares),
        "reach": [float(f"{value:.4g}") if np.isfinite(value) else None for value in reaches],
    }


def target_map() -> Array:
    """Return the target on the maps' cells, its mean 1."""
    target = interpolated(DRAWING.density, CELLS)
    return np.asarray(target / target.mean())
