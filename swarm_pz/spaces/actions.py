"""Conversion of wrappers' actions into commands of a control system."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, Literal, get_args

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import GameConfig
from swarm_pz.config.base import check_choice, check_count
from swarm_pz.config.system import ControlSystem
from swarm_pz.config.values import check_indices, check_values
from swarm_pz.errors import ConfigError
from swarm_pz.simulator.commands import interpolation_matrix

LOG_DENSITY_RANGE = 4.0
"""Natural logarithm of the ratio between a command's value at action 1 and at action 0."""

_COARSEST = 2
"""Most half-waves, along both axes together, of a cosine of `action="modes"`."""
LARGEST_MODE = 2.0
"""Largest number of `action="modes"`. A number divided by it is the weight of its cosine in the density's logarithm.
So the initial noise of Gaussian policies, 1, changes densities gently."""

ActionKind = Literal["command", "normalised", "modes", "discrete"]


class Actions(ABC):
    """One form of actions."""

    space: spaces.Space[Any]
    names: tuple[str, ...] = ()
    """The names of discrete actions."""

    @abstractmethod
    def read(self, actions: ArrayLike, count: int, name: str) -> NDArray[np.float64]:
        """Turn actions (n, ...) into commands (n, ...)."""

    def read_one(self, action: ArrayLike, name: str) -> NDArray[np.float64]:
        """Turn an action into a command."""
        return np.asarray(self.read(np.asarray(action)[None], 1, name)[0])


def make_actions(config: GameConfig, system: ControlSystem, kind: ActionKind, cells: int | None) -> Actions:
    """Return the actions for a system's commands, arguments as of `Format`; raise a ConfigError if they do not fit."""
    check_choice(kind, "action", get_args(ActionKind))
    takes_densities = system.takes == "density"
    if kind == "discrete":
        if cells is not None:
            raise ConfigError(f"action='discrete' is a number: leave out action_cells, got {cells!r}")
        return _Numbers(config, system)
    if not takes_densities and (cells is not None or kind == "modes"):
        option = f"action={kind!r}" if cells is None else f"action_cells={cells!r}"
        raise ConfigError(
            f"{option} is for densities, and the control system {system.name} takes commands of kind {system.takes!r}: "
            f"use action='command' or 'normalised'"
        )
    if kind == "modes":
        if cells is not None:
            raise ConfigError(f"action='modes' is a short vector already: leave out action_cells, got {cells!r}")
        return _Modes(config)
    if takes_densities:
        return _Images(config, cells, is_log=kind == "normalised")
    return _Vectors(config, system, is_normalised=kind == "normalised")


class _Images(Actions):
    """Densities or log-densities, of a chosen number of cells."""

    def __init__(self, config: GameConfig, cells: int | None, *, is_log: bool) -> None:
        self._cells = config.command_cells
        self._side = check_count(self._cells if cells is None else cells, "action_cells", 2, self._cells)
        self._is_log, self._low = is_log, -1.0 if is_log else 0.0
        self._shape = (self._side, self._side)
        self.space = spaces.Box(self._low, 1.0, self._shape, np.float32)

    def read(self, actions: ArrayLike, count: int, name: str) -> NDArray[np.float64]:
        return self._spread(check_values(actions, (count, *self._shape), self._low, 1.0, name))

    def read_one(self, action: ArrayLike, name: str) -> NDArray[np.float64]:
        return np.asarray(self._spread(check_values(action, self._shape, self._low, 1.0, name)[None])[0])

    def _spread(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        return command_from_action(values, self._cells, is_log=self._is_log)


def command_from_action(actions: NDArray[np.float64], cells: int, *, is_log: bool) -> NDArray[np.float64]:
    """Turn actions (n, a, a) into densities (n, A, A): interpolate them, and take the softmax of log-densities.

    Actions are densities in [0, 1], or log-densities in [-1, 1] in units of `LOG_DENSITY_RANGE`; the largest value of
    a density from log-densities is 1.
    """
    if actions.shape[-1] != cells:
        fine = interpolation_matrix(cells, actions.shape[-1])
        actions = fine @ actions @ fine.T
    return np.exp(LOG_DENSITY_RANGE * (actions - actions.max(axis=(1, 2), keepdims=True))) if is_log else actions


def mode_waves(cells: int) -> NDArray[np.float64]:
    """Return the cosines (n, A, A) of `action="modes"`."""
    count = min(_COARSEST + 1, cells)
    along = np.cos(np.pi * np.outer(np.arange(count), (np.arange(cells) + 0.5) / cells))
    pairs = [(y, x) for y in range(count) for x in range(count) if 0 < y + x <= _COARSEST]
    return np.array([np.outer(along[y], along[x]) for y, x in pairs])  # no constant: it changes no density


class _Modes(Actions):
    """Densities whose logarithm is a sum of the coarsest cosines, the controller's own basis."""

    def __init__(self, config: GameConfig) -> None:
        self._waves = mode_waves(config.command_cells)
        self._shape = (len(self._waves),)
        self.space = spaces.Box(-LARGEST_MODE, LARGEST_MODE, self._shape, np.float32)

    def read(self, actions: ArrayLike, count: int, name: str) -> NDArray[np.float64]:
        weights = check_values(actions, (count, *self._shape), -LARGEST_MODE, LARGEST_MODE, name) / LARGEST_MODE
        logs = (weights[:, :, None, None] * self._waves).sum(axis=1)
        return np.asarray(np.exp(logs - logs.max(axis=(1, 2), keepdims=True)))


class _Vectors(Actions):
    """Commands of any other kind, in their own units or scaled to [-1, 1]."""

    def __init__(self, config: GameConfig, system: ControlSystem, *, is_normalised: bool) -> None:
        self._system, self._config = system, config
        own = system.learner_space(config)
        self._shape = own.shape
        self._low, self._high = own.low.astype(np.float64), own.high.astype(np.float64)
        self._is_normalised = is_normalised
        self.space: spaces.Box = (
            spaces.Box(-1.0, 1.0, own.shape, np.float32)
            if is_normalised
            else spaces.Box(own.low, own.high, dtype=np.float32)
        )

    def read(self, actions: ArrayLike, count: int, name: str) -> NDArray[np.float64]:
        if self._is_normalised:
            values = check_values(actions, (count, *self._shape), -1.0, 1.0, name)
            values = self._low + (values + 1.0) / 2.0 * (self._high - self._low)
        else:
            values = check_values(actions, (count, *self._shape), self._low, self._high, name)
        return self._system.parse_all(values, count, self._config, name)


class _Numbers(Actions):
    """The indices of named commands."""

    def __init__(self, config: GameConfig, system: ControlSystem) -> None:
        named = system.named(config)
        if not named:
            raise ConfigError(
                f"action='discrete' chooses among commands that have names, and the control system {system.name} has "
                f"none: use action='command' or 'normalised'"
            )
        self.names = tuple(named)
        self._commands = np.stack([np.asarray(command, np.float64) for command in named.values()])
        self.space = spaces.Discrete(len(named))

    def read(self, actions: ArrayLike, count: int, name: str) -> NDArray[np.float64]:
        known = len(self._commands)
        expected = f"{name} must be whole numbers in [0, {known}), one for each of {count} games"
        return np.asarray(self._commands[check_indices(actions, (count,), known, expected)])
