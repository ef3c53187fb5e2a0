"""Spaces of actions and observations, subclasses of those of JaxMARL and Gymnax if these are installed."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from typing import Any, Literal, NamedTuple

import jax
from jax import numpy as jnp

from swarm_pz.config import CHANNELS, MOTION_CHANNELS, GameConfig
from swarm_pz.config.base import check
from swarm_pz.jax.params import Array, Params
from swarm_pz.spaces.actions import LARGEST_MODE, mode_waves
from swarm_pz.spaces.densities import named_commands

_CELLS = GameConfig().command_cells

ActionKind = Literal["command", "modes", "discrete"]


def library_classes(module: str, name: str, libraries: tuple[str, ...] = ("jaxmarl", "gymnax")) -> tuple[Any, ...]:
    """Return the class `name` of a module of each library that is installed."""
    classes = []
    for library in libraries:
        with suppress(ImportError):
            classes.append(getattr(import_module(f"{library}.environments.{module}"), name))
    return tuple(classes)


class Box(*library_classes("spaces", "Box")):  # type: ignore[misc]
    """Arrays of a shape, with values from low to high."""

    def __init__(self, low: float, high: float, shape: tuple[int, ...], dtype: Any) -> None:
        self.low, self.high, self.shape, self.dtype = low, high, shape, dtype

    def sample(self, key: Array) -> Array:
        """Draw an array."""
        drawn = jax.random.uniform(key, self.shape, minval=self.low, maxval=self.high + (self.dtype == jnp.uint8))
        return drawn.astype(self.dtype)

    def contains(self, values: Array) -> Array:
        """Return whether an array belongs to the space."""
        return jnp.all((values >= self.low) & (values <= self.high))


class Discrete(*library_classes("spaces", "Discrete")):  # type: ignore[misc]
    """Whole numbers from 0 to n - 1."""

    def __init__(self, n: int) -> None:
        self.n, self.shape, self.dtype = n, (), jnp.int32

    def sample(self, key: Array) -> Array:
        """Draw a number."""
        return jax.random.randint(key, self.shape, 0, self.n, self.dtype)

    def contains(self, value: Array) -> Array:
        """Return whether a number belongs to the space."""
        return (value >= 0) & (value < self.n)


class Actions(NamedTuple):
    """One way to write densities: its space, and how an action becomes a density (10, 10)."""

    space: Any
    read: Callable[[Array], Array]


def make_actions(kind: ActionKind) -> Actions:
    """Return actions as in other wrappers: densities, weights of cosines, or numbers of named densities."""
    if kind == "command":
        return Actions(Box(0.0, 1.0, (_CELLS, _CELLS), jnp.float32), lambda action: action)
    if kind == "modes":
        waves = jnp.asarray(mode_waves(_CELLS), jnp.float32)

        def of_modes(action: Array) -> Array:
            weights = jnp.clip(action, -LARGEST_MODE, LARGEST_MODE) / LARGEST_MODE
            logs = (weights[:, None, None] * waves).sum(axis=0)
            return jnp.exp(logs - logs.max())

        return Actions(Box(-LARGEST_MODE, LARGEST_MODE, (len(waves),), jnp.float32), of_modes)
    check(kind == "discrete", "action", kind, "'command', 'modes' or 'discrete'")
    named = jnp.asarray(named_commands(_CELLS), jnp.float32)
    # Trainers of JaxMARL pass arrays (1,).
    return Actions(Discrete(len(named)), lambda action: named[jnp.reshape(action, ())])


def make_observations(params: Params, *, is_vector: bool) -> Box:
    """Return the space of images, or of the same as a vector in [0, 1]; raise a ConfigError for lists of drones."""
    check(params.grid > 0, "observation.kind", "entities", "'grids' here, an image of one shape")
    shape = (len(CHANNELS) + params.motion * len(MOTION_CHANNELS), params.grid, params.grid)
    if is_vector:
        return Box(0.0, 1.0, (shape[0] * params.grid**2,), jnp.float32)
    return Box(0.0, 255.0, shape, jnp.uint8)
