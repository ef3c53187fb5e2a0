"""How wrappers write observations and read actions: the same options in every wrapper.

The game itself knows images of bytes, channel first, and densities. Libraries want other things; each
option answers one of them, and all combine. Commands are those of the control system that flies the player's team.
Of one that takes densities a normalised command is the logarithm of a density, which goes through a softmax.
With `"modes"` each number is the weight, in halves, of one of the coarsest cosines in a density's logarithm; zeros
mean uniform.

| option              | of                                           | for                                   |
|---------------------|----------------------------------------------|---------------------------------------|
| `action`            | `"command"`, `"normalised"`, `"discrete"`    | exact commands; Gaussians; DQN        |
|                     | `"modes"`: 5 numbers, -2 to 2                | PPO as it is by default               |
| `action_cells`      | cells a side of an action, interpolated      | shorter actions                       |
| `flatten_actions`   | actions (a * a,) in place of (a, a)          | RLlib, and others that take vectors   |
| `observation_dtype` | `"uint8"`, 0 to 255, or `"float32"`, 0 to 1  | networks that do not scale            |
| `channels_last`     | images (G', G', C) in place of (C, G', G')   | SuperSuit, RLlib's and JAX's networks |
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, TypedDict, cast, get_args

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import (
    CaptureConfig,
    ControllerConfig,
    DynamicsConfig,
    FlockingConfig,
    GameConfig,
    MemoryConfig,
    ObservationConfig,
    RewardConfig,
    SpawnConfig,
    resolve,
)
from swarm_pz.config.base import check, check_choice
from swarm_pz.config.game import Controller
from swarm_pz.config.system import ControlSystem
from swarm_pz.errors import ConfigError
from swarm_pz.spaces.actions import ActionKind, make_actions
from swarm_pz.spaces.observation import Observations, observation_space

Dtype = Literal["uint8", "float32"]


class FormatOptions(TypedDict, total=False):
    """The options of `Format` by name."""

    action: ActionKind
    action_cells: int | None
    flatten_actions: bool
    observation_dtype: Dtype
    channels_last: bool


class WrapperOptions(FormatOptions, total=False):
    """Keywords of a wrapper: the options of its format, a preset's name, and fields of `GameConfig` to replace."""

    preset: str
    drones_per_team: int | tuple[int, int]
    time_limit: float
    command_period: float
    command_cells: int
    spawn: SpawnConfig
    memory: MemoryConfig
    capture: CaptureConfig
    controller: ControllerConfig
    observation: ObservationConfig | tuple[ObservationConfig, ObservationConfig]
    reward: RewardConfig
    controllers: Controller | tuple[Controller, Controller]
    flocking: FlockingConfig
    dynamics: DynamicsConfig


def read_options(
    config: GameConfig | Mapping[str, Any] | None, options: WrapperOptions, wrapper: type
) -> tuple[GameConfig, FormatOptions]:
    """Return the rules and the format that a wrapper's keywords ask for; errors as of `swarm_pz.config.resolve`."""
    names = FormatOptions.__annotations__
    rules = {name: value for name, value in options.items() if name not in names}
    written = {name: value for name, value in options.items() if name in names}
    return resolve(config, rules, wrapper, names), cast("FormatOptions", written)


class Format:
    """One player's spaces, and the ways between them and the game.

    Parameters
    ----------
    config : GameConfig
    observation : ObservationConfig
        What the player sees.
    system : ControlSystem, optional
        What flies the player's team; the first of `config.controllers` if not given.
    action : {"normalised", "command", "modes", "discrete"}
        A Box(-1, 1), which suits Gaussian policies; the command itself, as the system's space says; of a density's
        logarithm the weights of the coarsest cosines, in halves; or the number of a command that has a name. Of a
        system that takes densities the first goes through a softmax.
    action_cells : int, optional
        Cells a side of a density, interpolated to the command's; as many as these if not given.
    flatten_actions : bool
        Actions are vectors, row after row.
    observation_dtype : {"uint8", "float32"}
        Brightness of images: whole numbers to 255, or fractions of 1. Lists of drones are float32 anyway.
    channels_last : bool
        Images are (G', G', C).

    Attributes
    ----------
    observation_space, action_space : gymnasium.spaces.Space

    Raises
    ------
    ConfigError
        If an option is unknown or does not fit the others.
    """

    def __init__(
        self,
        config: GameConfig,
        observation: ObservationConfig,
        system: ControlSystem | None = None,
        *,
        action: ActionKind = "normalised",
        action_cells: int | None = None,
        flatten_actions: bool = False,
        observation_dtype: Dtype = "uint8",
        channels_last: bool = False,
    ) -> None:
        check_choice(observation_dtype, "observation_dtype", get_args(Dtype))
        for name, value in (("flatten_actions", flatten_actions), ("channels_last", channels_last)):
            check(isinstance(value, (bool, np.bool_)), name, value, "True or False")
        self.observation = observation
        system = config.team_systems[0] if system is None else system
        self._actions = make_actions(config, system, action, action_cells, flat=flatten_actions)
        self.action_space = self._actions.space
        shows_images = observation.kind == "grids"
        self._is_float, self._channels_last = observation_dtype == "float32" and shows_images, channels_last
        self.is_plain = not (self._is_float or channels_last)
        """Whether observations are given as the game paints them."""
        if channels_last and not shows_images:
            raise ConfigError(
                f"channels_last is for images: leave it out, or give ObservationConfig(kind='grids'), got kind "
                f"{observation.kind!r}"
            )
        self.observation_space = self._make_observation_space(config)

    @property
    def command_names(self) -> tuple[str, ...]:
        """What each discrete action asks for; nothing for actions of other kinds."""
        return self._actions.names

    def _make_observation_space(self, config: GameConfig) -> spaces.Space[Any]:
        if self.is_plain:
            return observation_space(config, self.observation)
        channels, grid = len(self.observation.channels), self.observation.grid
        shape = (grid, grid, channels) if self._channels_last else (channels, grid, grid)
        if self._is_float:
            return spaces.Box(0.0, 1.0, shape, np.float32)
        return spaces.Box(0, 255, shape, np.uint8)

    def show(self, observations: Observations) -> Observations:
        """Return observations, of one game or of several along a first axis, as the player wants them."""
        if self.is_plain:
            return observations
        images = np.ascontiguousarray(np.moveaxis(observations, -3, -1)) if self._channels_last else observations
        return np.divide(images, np.float32(255.0), dtype=np.float32) if self._is_float else images

    def read(self, actions: ArrayLike, count: int, name: str = "actions") -> NDArray[np.float64]:
        """Turn a batch of actions into commands.

        Parameters
        ----------
        actions : array_like (n, ...)
        count : int
            Number n that there must be.
        name : str
            What to call them in an error.

        Returns
        -------
        float64 array (n, ...), of the shape of the system's space: (n, A, A) for densities

        Raises
        ------
        CommandError
            If an action is not in the space.
        """
        return self._actions.read(actions, count, name)

    def read_one(self, action: ArrayLike, name: str) -> NDArray[np.float64]:
        """As `read` for one action; returns one command."""
        return np.asarray(self._actions.read_one(action, name))

    def write(self, commands: NDArray[np.float64]) -> NDArray[Any]:
        """Turn commands (n, ...), of the shape of the system's space, into the actions (n, ...) nearest to them.

        Where a format can say a command, `read` gives it again to rounding; of densities but for their scale, in
        logarithms but for what is fainter than e^-8 of the largest value. Coarser actions fit its values, or their
        logarithms, by least squares; numbers name the nearest of the commands that have names.
        """
        return self._actions.write(commands)
