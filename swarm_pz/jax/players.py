"""Players that choose their commands under `jit`: scripts, and learned policies by their weights."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import jax
import numpy as np
from jax import numpy as jnp
from safetensors import SafetensorError
from safetensors.numpy import load_file

from swarm_pz.config import CHANNELS, MOTION_CHANNELS, GameConfig
from swarm_pz.errors import CheckpointError
from swarm_pz.jax.network import Weights, decide, density_of, features_of
from swarm_pz.jax.params import GRIDS, Array
from swarm_pz.policies import zoo
from swarm_pz.spaces.densities import cell_centres

_X, _Y = (jnp.asarray(axis, jnp.float32) for axis in cell_centres(GameConfig().command_cells))


class Player(NamedTuple):
    """A player: `act` maps a key and uint8 images (9, grid, grid), or (13, grid, grid) with `motion`, to a density.

    Densities (10, 10) are in [0, 1].
    """

    grid: int
    act: Callable[[Array, Array], Array]
    motion: bool = False
    """Whether it sees `MOTION_CHANNELS`, too."""


def _ring(_: Array, images: Array) -> Array:
    image = images[CHANNELS.index("opposing_positions")].astype(jnp.float32)
    places = (jnp.arange(image.shape[-1]) + 0.5) / image.shape[-1]
    total = image.sum()
    x, y = (jnp.where(total > 0, image.sum(axis=axis) @ places / jnp.maximum(total, 1.0), 0.5) for axis in (0, 1))
    return _ring_around(x, y, 0.08)


def _ring_around(x: Array | float, y: Array | float, width: float, radius: float = 0.25) -> Array:
    density = jnp.exp(-(((jnp.hypot(_X - x, _Y - y) - radius) / width) ** 2))
    return density / density.max()


SCRIPTS = {
    "uniform": Player(10, lambda *_: jnp.ones_like(_X)),
    "noise": Player(10, lambda key, _: jax.random.uniform(key, _X.shape)),
    "halo": Player(10, lambda *_: _ring_around(0.5, 0.5, 0.15)),
    "ring": Player(25, _ring),
}
"""Scripts of `swarm_pz.policies.scripted` that also play here."""


def player_of(weights: Weights, grid: int, *, motion: bool = False) -> Player:
    """Return the player that plays a network's mean action."""

    def act(_: Array, images: Array) -> Array:
        return density_of(decide(weights, features_of(weights, images[None] / np.float32(255.0)))[0])

    return Player(grid, act, motion)


def load(name: str | Path) -> Player:
    """Return a script by its name, or a learned policy: one that ships, or a folder that training wrote.

    Raises a CheckpointError if there is no such player, or if it observes what games in JAX do not show.
    """
    if name in SCRIPTS:
        return SCRIPTS[str(name)]
    folder = getattr(zoo, str(name)).folder if hasattr(zoo, str(name)) else Path(name)
    try:
        card = json.loads((folder / "policy.json").read_text())
        weights = {key: jnp.asarray(values) for key, values in load_file(folder / "policy.safetensors").items()}
    except (OSError, ValueError, SafetensorError) as error:
        raise CheckpointError(
            f"a player must be one of {', '.join(SCRIPTS)}, or a learned policy's name or folder, got {str(name)!r}: "
            f"{error}"
        ) from error
    shown = [list(CHANNELS), [*CHANNELS, *MOTION_CHANNELS]]
    if card.get("channels") not in shown or card.get("grid") not in GRIDS:
        raise CheckpointError(
            f"{name} must look at the default channels, also followed by {', '.join(MOTION_CHANNELS)}, on a grid of "
            f"{', '.join(map(str, GRIDS))}, which is what games in JAX show; its card says {card.get('channels')} and "
            f"{card.get('grid')}"
        )
    return player_of(weights, card["grid"], motion=card["channels"] == shown[1])
