"""Observations of `swarm_pz.spaces.observation`: the nine default channels, with or without motion, or lists."""

from __future__ import annotations

from typing import Any

import jax
from jax import numpy as jnp

from swarm_pz.config import GRID_CELLS, SOON, GameConfig
from swarm_pz.jax.fields import cells_of
from swarm_pz.jax.params import Array, Params, State
from swarm_pz.kernels.observation import CAPTURES_FROM, POSITION_STEP
from swarm_pz.spaces.observation import brightness_of_ages, coarse_interpolation

_BRIGHTNESS = brightness_of_ages(GameConfig().trail_ticks)


def observe(state: State, fields: Array, limits: Array, side: int, params: Params) -> Any:
    """Return a side's observation: uint8 images (9 or 13, grid, grid), or a dict of lists of drones.

    `fields` are both capture fields (2, 50, 50), whose cells above `limits` (2,) capture.
    """
    if not params.grid:
        return _entities(state, side, params)
    teams, grid = (side, 1 - side), params.grid
    is_its = [state.teams == team for team in teams]
    own = is_its[0].sum()
    time_left = (state.tick <= params.times_left).sum().astype(jnp.uint8)
    planes = [
        *(_positions(state.positions, its, grid) for its in is_its),
        *(_trail_ages(state, its, grid) for its in is_its),
        *(_field(fields[team], limits[team], grid) for team in teams),
        _target(state.targets[side], grid),
        jnp.full((grid, grid), params.shares[own]),
        jnp.full((grid, grid), time_left),
    ]
    if params.motion:
        soon = state.positions + SOON * state.velocities
        planes += [_shared(places, its, grid) for places in (state.positions, soon) for its in is_its]
    return jnp.stack(planes)


def _coarse(cells: Array, grid: int) -> Array:
    """Return the cell of a coarser grid that holds each cell of the full grid."""
    block = GRID_CELLS // grid
    return cells // GRID_CELLS // block * grid + cells % GRID_CELLS // block


def _positions(positions: Array, is_its: Array, grid: int) -> Array:
    """Add 64 for each drone to its cell, up to 255."""
    image = jnp.zeros(grid * grid, jnp.int32).at[_coarse(cells_of(positions), grid)].add(POSITION_STEP * is_its)
    return jnp.minimum(image, 255).astype(jnp.uint8).reshape(grid, grid)


def _shared(places: Array, is_its: Array, grid: int) -> Array:
    """Distribute 64 for each drone over the four cells whose centres surround it, up to 255."""
    at = (jnp.clip(places, 0.0, 1.0) * grid - 0.5).T
    low = jnp.floor(at)
    x, y = jnp.clip(jnp.stack([low, low + 1.0], axis=1), 0.0, grid - 1.0).astype(jnp.int32)
    of_x, of_y = jnp.stack([1.0 - (at - low), at - low], axis=1)
    parts = (POSITION_STEP * of_y[:, None] * of_x + 0.5).astype(jnp.int32)
    image = jnp.zeros(grid * grid, jnp.int32).at[y[:, None] * grid + x].add(parts * is_its)
    return jnp.minimum(image, 255).astype(jnp.uint8).reshape(grid, grid)


def _trail_ages(state: State, is_its: Array, grid: int) -> Array:
    """Show how recently the team's drones were in each cell."""
    length = len(state.trails)
    ages = (state.tick - 1 - jnp.arange(length)) % length
    shade = jnp.where(is_its & (state.trails >= 0), jnp.asarray(_BRIGHTNESS)[ages][:, None], 0)
    cells, block = jnp.maximum(state.trails, 0).astype(jnp.int32), GRID_CELLS // grid
    # On the full grid, since a GPU is slow if many trails share a cell.
    image = jnp.zeros(GRID_CELLS**2, jnp.uint8).at[cells.reshape(-1)].max(shade.reshape(-1).astype(jnp.uint8))
    return image.reshape(grid, block, grid, block).max(axis=(1, 3))


def _field(field: Array, limit: Array, grid: int) -> Array:
    """Show 255 value / maximum, clipped to 192 or more where a cell captures, and below 192 elsewhere."""
    block = GRID_CELLS // grid
    highest = field.reshape(grid, block, grid, block).max(axis=(1, 3))
    most = highest.max()
    # Exact rounding: an estimate in float32, corrected by the remainder in 32 bits, which may wrap round.
    nearly = (255.0 * (highest / jnp.maximum(most, 1))).astype(jnp.int32)
    left = 510 * highest + most - 2 * most * nearly
    brightness = nearly + (left >= 2 * most) - (left < 0)
    is_held = highest > limit
    kept = jnp.where(is_held, jnp.maximum(brightness, CAPTURES_FROM), jnp.minimum(brightness, CAPTURES_FROM - 1))
    return jnp.where(most > 0, kept, 0).astype(jnp.uint8)


def _target(target: Array, grid: int) -> Array:
    """Show the commanded density, divided by its largest cell."""
    weights = jnp.asarray(coarse_interpolation(grid, len(target)), jnp.float32)
    with jax.default_matmul_precision("highest"):
        image = weights @ (target / target.max()) @ weights.T
    return jnp.minimum(255.0 * image + 0.5, 255.0).astype(jnp.uint8)


def _entities(state: State, side: int, params: Params) -> dict[str, Array]:
    """List each side's drones in order, padded with zeros."""
    entities = {}
    for name, team in (("own", side), ("opposing", 1 - side)):
        is_its = state.teams == team
        order = jnp.argsort(~is_its, stable=True)
        mask = is_its[order]
        entities[f"{name}_positions"] = jnp.where(mask[:, None], state.positions[order], 0.0)
        entities[f"{name}_velocities"] = jnp.where(mask[:, None], state.velocities[order], 0.0)
        entities[f"{name}_mask"] = mask.astype(jnp.int8)
    own = entities["own_mask"].sum(keepdims=True, dtype=jnp.float32)
    entities["own_share"] = own / params.sizes.sum()
    entities["time_left"] = 1.0 - jnp.minimum(state.tick / params.limit_ticks, 1.0).astype(jnp.float32)[None]
    return entities
