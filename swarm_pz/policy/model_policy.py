"""A trained model of Stable-Baselines3, or of a library like it, as a policy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from swarm_pz.config import CHANNELS, GRID_CELLS, GameConfig, ObservationConfig
from swarm_pz.config.system import ControlSystem
from swarm_pz.errors import PolicyError
from swarm_pz.simulator.spawn import Seed
from swarm_pz.spaces.actions import ActionKind, make_actions
from swarm_pz.spaces.formats import Format
from swarm_pz.spaces.observation import Observations

_ROWS = 8
"""Observations in a batch."""


@runtime_checkable
class Model(Protocol):
    """A trained model with spaces, as every algorithm of SB3 has."""

    observation_space: spaces.Space[Any]
    action_space: spaces.Space[Any]

    def predict(self, observation: Any, *, deterministic: bool) -> tuple[Any, Any]:
        """Return actions for a batch of observations, and a state that is None for models without memory."""


class ModelPolicy:
    """A policy that plays a model; the model's spaces set its observation and the form of its actions.

    Raises a PolicyError if no wrapper of this game has such spaces.

    Parameters
    ----------
    observation : ObservationConfig, optional
        What it was trained to see. If not given, it follows from the space: all nine channels, or those of
        the game's own observation if their number fits.
    deterministic : bool
        Whether it plays its best action, or draws one as in training.
    system : ControlSystem, optional
        The control system of its team, by default the first of `config.controllers`.
    """

    def __init__(
        self,
        model: Model,
        config: GameConfig,
        observation: ObservationConfig | None = None,
        *,
        deterministic: bool = True,
        system: ControlSystem | None = None,
    ) -> None:
        self.name = type(model).__name__
        self.model = model
        self.deterministic = deterministic
        system = config.team_systems[0] if system is None else system
        self.answers = system.takes
        self.observation, options = format_of(
            model.observation_space, model.action_space, config, observation, system=system
        )
        self._format = Format(config, self.observation, system, **options)
        if self._format.observation_space != model.observation_space:
            raise PolicyError(
                f"model {self.name} observes {model.observation_space}, but in this game it would be shown "
                f"{self._format.observation_space}"
            )

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games; a model without memory has nothing to forget."""

    def act(self, observations: Observations, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return commands (n, ...) for n observations."""
        count = len(rows)
        # Always `_ROWS` at once, with the last one repeated: other batch sizes round differently, and games
        # would depend on how many are played together.
        places = np.minimum(np.arange(-(-count // _ROWS) * _ROWS), count - 1).reshape(-1, _ROWS)
        return np.concatenate([self._answer(observations, part) for part in places])[:count]

    def _answer(self, shown: Observations, places: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return commands for `_ROWS` of the observations."""
        part = {name: lists[places] for name, lists in shown.items()} if isinstance(shown, dict) else shown[places]
        actions, state = self.model.predict(part, deterministic=self.deterministic)
        if state is not None:
            raise PolicyError(f"model {self.name} has a memory, which must be kept for each game: wrap it in a policy")
        return self._format.read(actions, _ROWS, f"model {self.name}'s actions")


def format_of(
    observation_space: spaces.Space[Any],
    action_space: spaces.Space[Any],
    config: GameConfig,
    observation: ObservationConfig | None = None,
    *,
    system: ControlSystem,
) -> tuple[ObservationConfig, dict[str, Any]]:
    """Return the observation and `Format` options for a model's spaces; arguments and errors as `ModelPolicy`."""
    return _view_of(observation_space, config, observation), _actions_of(action_space, config, system)


def _actions_of(space: spaces.Space[Any], config: GameConfig, system: ControlSystem) -> dict[str, Any]:
    """Return the options of `Format` that give an action space."""
    takes_densities = system.takes == "density"
    kinds: tuple[ActionKind, ...] = ("normalised", "command")
    sides = range(2, config.command_cells + 1) if takes_densities else (None,)
    known: list[dict[str, Any]] = [{"action": kind, "action_cells": side} for kind in kinds for side in sides]
    known += [{"action": "modes"}] if takes_densities else []
    known += [{"action": "discrete"}] if takes_densities or system.named(config) else []
    wanted = spaces.Box(space.low, space.high, dtype=np.float32) if isinstance(space, spaces.Box) else space
    tried: list[spaces.Space[Any]] = []
    for options in known:
        tried.append(make_actions(config, system, options["action"], options.get("action_cells")).space)
        if tried[-1] == wanted:
            return options
    if takes_densities:
        raise PolicyError(
            f"a model's actions must be densities Box(0, 1) or log-densities Box(-1, 1) of shape (a, a) with a from "
            f"2 to {config.command_cells}, modes {tried[-2]}, or {tried[-1]}, got {space}"
        )
    raise PolicyError(
        f"a model's actions must be those of the control system {system.name}, one of {', '.join(map(str, tried))}, "
        f"got {space}"
    )


def _view_of(space: spaces.Space[Any], config: GameConfig, observation: ObservationConfig | None) -> ObservationConfig:
    """Return the observation that a space belongs to."""
    if observation is not None:
        return observation
    if isinstance(space, spaces.Dict):
        return ObservationConfig(kind="entities")
    shape = space.shape or ()
    if isinstance(space, spaces.Box) and shape == (config.num_drones, 5):
        return ObservationConfig(kind="drones")
    if not isinstance(space, spaces.Box) or len(shape) != 3 or space.dtype != np.uint8 or shape[1] != shape[2]:
        raise PolicyError(
            f"a model must observe images (C, G, G) of uint8, lists of drones, or a row for each drone, got {space}: "
            "write a policy for a model that was trained behind wrappers of a library"
        )
    count, grid = shape[0], shape[1]
    channels = next((one.channels for one in config.observations if len(one.channels) == count), CHANNELS)
    if GRID_CELLS % grid or count != len(channels):
        raise PolicyError(
            f"a model's images must be of a grid that divides {GRID_CELLS} and of {len(CHANNELS)} channels, or as many "
            f"as the game's own observation has, got {space}: give ModelPolicy(model, config, observation)"
        )
    return ObservationConfig(grid=grid, channels=channels)
