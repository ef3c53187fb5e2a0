"""A team alone: targets, flights and the ergodic metric over time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import BLUE, RED, TICKS_PER_CONTROL_PERIOD, TICKS_PER_SECOND, CaptureConfig, GameConfig
from swarm_pz.evaluation.intervals import bootstrap, rounded
from swarm_pz.kernels.controllers.ergodic import sobolev_weights
from swarm_pz.simulator import Simulator, make_target
from swarm_pz.simulator.ergodicity import basis

Array = NDArray[np.float64]

SECONDS = 60
"""Length of a flight."""
JUDGED = 30
"""Second at which coverage is judged."""
COVERED = 0.001
"""Ergodic metric below which a target counts as covered at that time; this bound is ours."""
SOON = 1
"""Second whose metric later ones are compared with."""


def gaussian(x0: float, y0: float, sigma: float, cells: int = 10) -> Array:
    """Return a Gaussian of unit mass, up to a factor, at the centres of cells (cells, cells)."""
    centres = (np.arange(cells) + 0.5) / cells
    squares = (centres[None, :] - x0) ** 2 + (centres[:, None] - y0) ** 2
    return np.asarray(np.exp(-squares / (2 * sigma**2)) / sigma**2)


class ErgodicMetric:
    """The distance of a team's past from its target, in all games of a simulator.

    E = sum_k (1 + |k|^2)^(-3/2) (c_k - phi_k)^2. c is the mean of F_k over all places of the team's working drones at
    all observations; phi is the target in force.
    """

    def __init__(self, simulator: Simulator, team: int) -> None:
        modes = simulator.config.controller.modes
        self._simulator, self._team = simulator, team
        self._weights = sobolev_weights(modes)
        self._sums = np.zeros((simulator.num_games, modes, modes))
        self._counts = np.zeros(simulator.num_games, np.int64)

    def observe(self) -> None:
        """Add where the team's drones are now."""
        games = self._simulator.games
        members = (games.teams == self._team) & ~games.failed
        sums = np.einsum("enab,en->eab", basis(games.positions, len(self._weights)), members)
        self._sums += sums
        self._counts += members.sum(axis=1)

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """(E, K, K) c_k of the past; NaN for a team that had no drones."""
        known = np.full_like(self._sums, np.nan)
        some = self._counts > 0
        known[some] = self._sums[some] / self._counts[some, None, None]
        return known

    def value(self) -> NDArray[np.float64]:
        """Return the metric (E,) of every game against the target in force; NaN for a team that had no drones."""
        phi = self._simulator.target_coefficients[:, self._team]
        return np.asarray((self._weights * (self.coefficients - phi) ** 2).sum(axis=(1, 2)))


def lone_team(size: int, config: GameConfig | None = None) -> GameConfig:
    """Return rules with one team, which nobody can capture."""
    config = config if config is not None else GameConfig()
    return config.replace(drones_per_team=(size, 0), capture=CaptureConfig(enabled=False))


def start(config: GameConfig, seeds: Sequence[int], command: ArrayLike) -> Simulator:
    """Start a game for each seed, all with the same command."""
    simulator = Simulator(config, len(seeds))
    simulator.reset(list(seeds))
    give(simulator, command)
    return simulator


def give(simulator: Simulator, command: ArrayLike) -> None:
    """Send a density (A, A) to the team in all games; it is the metric's target under every control system."""
    density = np.asarray(command, np.float64)
    simulator.command(RED, np.broadcast_to(density, (simulator.num_games, *density.shape)))
    if simulator.config.team_systems[RED].takes != "density":  # other systems derive another target from it
        simulator.games.coefficients[:, RED] = make_target(density, simulator.config.controller.modes)[1]


def periods(simulator: Simulator, seconds: int, after: Callable[[int], Any]) -> None:
    """Advance by control periods and call a function after each, with its number from 1 on."""
    for number in range(1, seconds * TICKS_PER_SECOND // TICKS_PER_CONTROL_PERIOD + 1):
        simulator.advance(TICKS_PER_CONTROL_PERIOD)
        after(number)


def hand_over(simulator: Simulator, drones: NDArray[np.bool_]) -> None:
    """Move drones (E, N) to the other side as captures do: they follow its command, with an empty memory.

    All trails are emptied, so that no capture field counts a drone for its former team.
    """
    games = simulator.snapshot()
    games.teams[drones] = RED + BLUE - games.teams[drones]
    np.moveaxis(games.memory, -1, 1)[np.nonzero(drones)] = 0.0
    games.memory_weight[drones] = 0.0
    games.trails[:] = -1
    games.occupancy[:] = 0
    simulator.restore(games)


def metric_over_time(simulator: Simulator, seconds: int = SECONDS, then: Callable[[int], Any] | None = None) -> Array:
    """Advance and return the ergodic metric (E, seconds) after each second, over all of the past.

    `then` is called after each control period, with its number from 1 on.
    """
    metric, values = ErgodicMetric(simulator, RED), []

    def observe(number: int) -> None:
        metric.observe()
        if number % 10 == 0:
            values.append(metric.value())
        if then is not None:
            then(number)

    periods(simulator, seconds, observe)
    return np.stack(values, axis=1)


class Flight:
    """Flights of a team in games that have just begun; `each_second` is called after each second, from 1 on.

    Attributes
    ----------
    config : GameConfig
    metric : float64 array (seeds, seconds)
        Ergodic metric over all of the past, after each second.
    places : float64 array (seeds, control periods, drones, 2)
    """

    def __init__(self, simulator: Simulator, each_second: Callable[[int], None] | None = None) -> None:
        self.config = simulator.config
        places = []

        def keep(number: int) -> None:
            places.append(simulator.positions.astype(np.float64))
            if number % 10 == 0 and each_second is not None:
                each_second(number // 10)

        self.metric = metric_over_time(simulator, SECONDS, keep)
        self.places = np.stack(places, axis=1)

    def maps(self, cells: int) -> Array:
        """Return the time-averaged trajectories (seeds, cells, cells): the share of all drones' time in each cell."""
        columns, rows = np.moveaxis(np.minimum((cells * self.places).astype(np.int64), cells - 1), -1, 0)
        flat = (rows * cells + columns).reshape(len(rows), -1)
        counts = np.stack([np.bincount(game, minlength=cells**2) for game in flat])
        return np.asarray(counts.reshape(-1, cells, cells) / flat.shape[1])


def over_seeds(values: Array) -> dict[str, Any]:
    """Return the mean (T,) over seeds of values (seeds, T), and the ends of its interval, as lists."""
    mean, low, high = bootstrap(values)
    return {"mean": rounded(mean), "low": rounded(low), "high": rounded(high)}


def worst_fall(values: Array) -> Any:
    """Return the largest ratio over flights of the mean last metric to that at `SOON`, of (seeds, flights, seconds)."""
    means = values.mean(axis=0)
    return (means[:, -1] / means[:, SOON - 1]).max()


def worst_judged(values: Array) -> Any:
    """Return the largest mean metric of a flight at `JUDGED`, of values (seeds, flights, seconds)."""
    return values[:, :, JUDGED - 1].mean(axis=0).max()
