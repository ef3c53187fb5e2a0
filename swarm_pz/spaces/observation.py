"""Observations of a game from one side: grid images, lists of drones, or a row for each drone.

Grid observations are images, channel first, of brightness 0 to 255, `[channel, row = y, column = x]`.
`ObservationConfig(channels=...)` selects channels and their order:

| channel                  | shows                                                    | coarsening |
|--------------------------|----------------------------------------------------------|------------|
| `own_positions`          | 64 for each drone in the cell, up to 255                 | sum        |
| `opposing_positions`     | the same of the other team                               | sum        |
| `own_trail_age`          | 255 where a drone is now, falling to 0 with the trail    | maximum    |
| `opposing_trail_age`     | the same of the other team                               | maximum    |
| `own_capture_field`      | 255 value / maximum; >= 192 exactly where it captures    | maximum    |
| `opposing_capture_field` | the same of the other team                               | maximum    |
| `own_target`             | 255 times the target density / its largest command cell  | mean       |
| `own_share`              | 255 times its share of all drones, everywhere            | -          |
| `time_left`              | 255 times the fraction of time left, everywhere          | -          |
| `own_now`                | 64 for each drone, shared among the four nearest         | as given   |
|                          | cells: where it is, to a fraction of a cell; up to 255   |            |
| `opposing_now`           | the same of the other team                               | as given   |
| `own_soon`               | the same of where it is in 0.5 s, if it keeps its        | as given   |
|                          | velocity: with `own_now`, where it is going              |            |
| `opposing_soon`          | the same of the other team                               | as given   |

The first nine are the default (`swarm_pz.config.CHANNELS`); the others (`swarm_pz.config.MOTION_CHANNELS`) are opt-in.

Observations of kind `drones` have a row for every drone of either side, at its number: x, y, vx, vy, and 1 for an own
drone or -1. Use them with `direct`, where each drone is commanded separately.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from swarm_pz.config import CHANNELS, GRID_CELLS, MOTION_CHANNELS, GameConfig, ObservationConfig
from swarm_pz.kernels.observation import ViewParameters, list_entities, paint_grids
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.commands import interpolation_matrix

_WORTH_THREADS = 256
"""Least number of images for which threads are quicker."""
_VECTOR = 32
"""Numbers that compiled loops process at once."""

Observations = Any
"""uint8 array (n, C, G', G'), float32 array (n, N, 5), or a dict of arrays with first axis n; n sides of n games."""


def top_speed(config: GameConfig) -> float:
    """Return the largest velocity along an axis that a drone reaches in a game, in the units of velocities.

    Walls stop drones, so v^2 <= v0^2 + 2 a / g: initial speed v0, largest acceleration a, speed factor g.
    With `min_speed`, walls reverse velocities, and drones may gain speed all game long.
    """
    acceleration, dynamics, start = config.controller.max_acceleration, config.dynamics, config.spawn.speed
    if dynamics.min_speed > 0.0:
        return max(start, dynamics.min_speed) + acceleration * config.time_limit
    return math.sqrt(start**2 + 2.0 * acceleration / dynamics.speed_factor)


def observation_space(config: GameConfig, observation: ObservationConfig) -> spaces.Space[Any]:
    """Return the space of one side's observation: a Box of images or of drones, or a Dict of drone lists."""
    if observation.kind == "grids":
        return spaces.Box(0, 255, (len(observation.channels), observation.grid, observation.grid), np.uint8)
    n, fastest = config.num_drones, top_speed(config)
    if observation.kind == "drones":
        low, high = np.array([0.0, 0.0, -fastest, -fastest, -1.0]), np.array([1.0, 1.0, fastest, fastest, 1.0])
        return spaces.Box(np.tile(low, (n, 1)).astype(np.float32), np.tile(high, (n, 1)).astype(np.float32))
    entries: dict[str, spaces.Space[Any]] = {}
    for side in ("own", "opposing"):
        entries[f"{side}_positions"] = spaces.Box(0.0, 1.0, (n, 2), np.float32)
        entries[f"{side}_velocities"] = spaces.Box(-fastest, fastest, (n, 2), np.float32)
        entries[f"{side}_mask"] = spaces.MultiBinary(n)
    entries["own_share"] = spaces.Box(0.0, 1.0, (1,), np.float32)
    entries["time_left"] = spaces.Box(0.0, 1.0, (1,), np.float32)
    return spaces.Dict(entries)


def observe(
    simulator: Simulator,
    observation: ObservationConfig,
    teams: NDArray[np.int64],
    rows: NDArray[np.int64],
    limit_ticks: int | None = None,
) -> Observations:
    """Return fresh observations of the games `rows` (n,), each from the side of one of `teams` (n,).

    `limit_ticks` replaces the configuration's time limit. Observations lie in `observation_space`.
    """
    limit = simulator.config.limit_ticks if limit_ticks is None else limit_ticks
    if observation.kind == "drones":
        return _rows_of_drones(simulator, teams, rows)
    if observation.kind == "entities":
        return _entities(simulator, teams, rows, limit)
    observations = np.empty((len(rows), len(observation.channels), observation.grid, observation.grid), np.uint8)
    rows, teams = np.ascontiguousarray(rows, np.int64), np.ascontiguousarray(teams, np.int64)  # as kernels read them
    shown, config = simulator.shown, simulator.config
    view = _view_parameters(observation, shown.trails.shape[1], config.command_cells, config.capture.threshold)

    def paint(places: NDArray[np.int64]) -> None:
        weights = simulator.rules.ring_weights
        simulator.call(paint_grids, shown, rows, places, teams, limit, view, weights, observations)

    everywhere = np.arange(len(rows))
    if len(rows) * len(observation.channels) < _WORTH_THREADS:
        paint(everywhere)
    else:
        simulator.for_rows(everywhere, paint)
    return observations


def of_game(observations: Observations, place: int) -> Observations:
    """Return one game's observation, of n."""
    if isinstance(observations, dict):
        return {name: part[place] for name, part in observations.items()}
    return observations[place]


@cache
def _view_parameters(observation: ObservationConfig, trail: int, cells: int, threshold: float) -> ViewParameters:
    line = np.arange(GRID_CELLS) // (GRID_CELLS // observation.grid)
    return ViewParameters(
        threshold=threshold,
        coarse_cells=(line[:, None] * observation.grid + line).ravel().astype(np.uint16),
        brightness=brightness_of_ages(trail),
        interpolation=_padded_interpolation(observation.grid, cells),
        channels=np.array([(CHANNELS + MOTION_CHANNELS).index(channel) for channel in observation.channels]),
    )


def brightness_of_ages(trail_ticks: int) -> NDArray[np.uint8]:
    """Return the brightness of a trail by its age in ticks: 255 for now, falling to 0."""
    ages = np.arange(trail_ticks)
    return ((255 * (trail_ticks - ages) + trail_ticks // 2) // trail_ticks).astype(np.uint8)


def coarse_interpolation(grid: int, cells: int) -> NDArray[np.float64]:
    """Return weights (grid, cells) that interpolate a command and average blocks of it, along one axis."""
    full = interpolation_matrix(GRID_CELLS, cells)
    return np.ascontiguousarray(full.reshape(grid, GRID_CELLS // grid, cells).mean(axis=1))


def _padded_interpolation(grid: int, cells: int) -> NDArray[np.float64]:
    padded = np.zeros((cells, -(-grid // _VECTOR) * _VECTOR))
    padded[:, :grid] = coarse_interpolation(grid, cells).T
    return padded


def _rows_of_drones(simulator: Simulator, teams: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.float32]:
    """Return a row for every drone."""
    games = simulator.games
    side = np.where(games.teams[rows] == teams[:, None], np.float32(1.0), np.float32(-1.0))
    fastest = np.float32(top_speed(simulator.config))  # rounding, and scenarios, can exceed it
    velocities = np.clip(games.velocities[rows], -fastest, fastest)
    return np.concatenate([games.positions[rows], velocities, side[..., None]], axis=2)


def _entities(
    simulator: Simulator, teams: NDArray[np.int64], rows: NDArray[np.int64], limit: int
) -> dict[str, NDArray[Any]]:
    """List each side's drones first to last, padded with zeros; a mask marks those that exist."""
    shape = 2, len(rows), simulator.config.num_drones
    places, speeds = np.zeros((*shape, 2), np.float32), np.zeros((*shape, 2), np.float32)
    masks, (shares, times) = np.zeros(shape, np.int8), np.empty((2, len(rows), 1), np.float32)
    fastest = np.float32(top_speed(simulator.config))
    simulator.call(list_entities, simulator.shown, rows, teams, limit, fastest, places, speeds, masks, shares, times)
    entries: dict[str, NDArray[Any]] = {}
    for side, name in enumerate(("own", "opposing")):
        entries[f"{name}_positions"], entries[f"{name}_velocities"] = places[side], speeds[side]
        entries[f"{name}_mask"] = masks[side]
    return entries | {"own_share": shares, "time_left": times}
