"""How a face writes what a player sees, and reads what it answers: the same options in every face.

The game itself knows images of bytes, channel first, and densities. Libraries want other things; each
option answers one of them, and all combine:

| option              | of                                           | for                                   |
|---------------------|----------------------------------------------|---------------------------------------|
| `action`            | `"density"`, `"log_density"`, `"discrete"`   | exact commands; Gaussians; DQN        |
| `action_cells`      | cells a side of an action, interpolated      | shorter actions                       |
| `flatten_actions`   | actions (a * a,) in place of (a, a)          | RLlib, and others that take vectors   |
| `observation_dtype` | `"uint8"`, 0 to 255, or `"float32"`, 0 to 1  | networks that do not scale            |
| `channels_last`     | images (G', G', C) in place of (C, G', G')   | SuperSuit, RLlib's and JAX's networks |
"""

from __future__ import annotations

from typing import Any, Literal, TypedDict, get_args

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.config.base import check, check_choice, check_count
from swarm_pz.errors import CommandError, ConfigError
from swarm_pz.simulator.commands import check_values, interpolation_matrix
from swarm_pz.spaces.densities import COMMAND_NAMES, named_commands
from swarm_pz.spaces.observation import Observations, observation_space

LOG_DENSITY_RANGE = 4.0
"""Natural logarithm of the ratio between a command's value at action 1 and at action 0."""

ActionKind = Literal["density", "log_density", "discrete"]
Dtype = Literal["uint8", "float32"]


class FormatOptions(TypedDict, total=False):
    """The options of `Format` by name."""

    action: ActionKind
    action_cells: int | None
    flatten_actions: bool
    observation_dtype: Dtype
    channels_last: bool


def command_from_action(actions: NDArray[np.float64], cells: int, *, is_log: bool) -> NDArray[np.float64]:
    """Turn actions into commands: interpolate them, and take the softmax of log-densities.

    Parameters
    ----------
    actions : float64 array (n, a, a)
        Densities in [0, 1], or log-densities in [-1, 1] whose unit is `LOG_DENSITY_RANGE`.
    cells : int
        Cells A a side of a command.
    is_log : bool

    Returns
    -------
    float64 array (n, A, A), in [0, 1]; of log-densities the largest value is 1
    """
    fine = interpolation_matrix(cells, actions.shape[-1])
    values = actions if actions.shape[-1] == cells else fine @ actions @ fine.T
    if not is_log:
        return values
    return np.asarray(np.exp(LOG_DENSITY_RANGE * (values - values.max(axis=(1, 2), keepdims=True))))


class Format:
    """One player's spaces, and the ways between them and the game.

    Parameters
    ----------
    config : GameConfig
    observation : ObservationConfig
        What the player sees.
    action : {"log_density", "density", "discrete"}
        A Box(-1, 1) that goes through a softmax, which suits Gaussian policies; the density itself, a
        Box(0, 1); or the number of a density of `swarm_pz.spaces.densities.COMMAND_NAMES`.
    action_cells : int, optional
        Cells a side of an action, interpolated to the command's; as many as these if not given.
    flatten_actions : bool
        Actions are vectors, row after row.
    observation_dtype : {"uint8", "float32"}
        Brightness of images: whole numbers to 255, or fractions of 1.
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
        *,
        action: ActionKind = "log_density",
        action_cells: int | None = None,
        flatten_actions: bool = False,
        observation_dtype: Dtype = "uint8",
        channels_last: bool = False,
    ) -> None:
        check_choice(action, "action", get_args(ActionKind))
        check_choice(observation_dtype, "observation_dtype", get_args(Dtype))
        for name, value in (("flatten_actions", flatten_actions), ("channels_last", channels_last)):
            check(isinstance(value, bool), name, value, "True or False")
        self.observation = observation
        self._cells = config.command_cells
        self._kind = action
        self._low = -1.0 if action == "log_density" else 0.0
        self._side = self._cells if action_cells is None else action_cells
        check_count(self._side, "action_cells", 2, self._cells)
        if action == "discrete" and (flatten_actions or action_cells is not None):
            raise ConfigError("action='discrete' is a number: flatten_actions and action_cells have no meaning with it")
        self.action_space = self._make_action_space(flatten_actions)
        self._is_float, self._channels_last = observation_dtype == "float32", channels_last
        self.is_plain = not (self._is_float or channels_last)
        """Whether observations are given as the game paints them."""
        if observation.kind != "grids" and not self.is_plain:
            raise ConfigError(
                f"observation_dtype and channels_last are for images: leave them out, or give "
                f"ObservationConfig(kind='grids'), got kind {observation.kind!r}"
            )
        self.observation_space = self._make_observation_space(config)

    @property
    def command_names(self) -> tuple[str, ...]:
        """What each discrete action asks for; nothing for actions of other kinds."""
        return COMMAND_NAMES if self._kind == "discrete" else ()

    def _make_action_space(self, flat: bool) -> spaces.Space[Any]:
        if self._kind == "discrete":
            return spaces.Discrete(len(COMMAND_NAMES))
        shape = (self._side**2,) if flat else (self._side, self._side)
        return spaces.Box(self._low, 1.0, shape, np.float32)

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
        """Turn a batch of actions into densities.

        Parameters
        ----------
        actions : array_like (n, ...)
        count : int
            Number n that there must be.
        name : str
            What to call them in an error.

        Returns
        -------
        float64 array (n, A, A)

        Raises
        ------
        CommandError
            If an action is not in the space.
        """
        if self._kind == "discrete":
            return self._look_up(actions, count, name)
        values = check_values(actions, (count, *self.action_space.shape), self._low, 1.0, name)  # type: ignore[misc]
        return self._spread(values)

    def read_one(self, action: ArrayLike, name: str) -> NDArray[np.float64]:
        """As `read` for one action; returns (A, A)."""
        if self._kind == "discrete":
            return np.asarray(self._look_up([action], 1, name)[0])
        values = check_values(action, self.action_space.shape, self._low, 1.0, name)  # type: ignore[arg-type]
        return np.asarray(self._spread(values[None])[0])

    def _spread(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        squares = values.reshape(-1, self._side, self._side)
        return command_from_action(squares, self._cells, is_log=self._kind == "log_density")

    def _look_up(self, actions: Any, count: int, name: str) -> NDArray[np.float64]:
        densities = named_commands(self._cells)
        expected = f"{name} must be whole numbers in [0, {len(densities)}), one for each of {count} games"
        try:
            numbers = np.array(actions)
        except (TypeError, ValueError) as error:
            raise CommandError(f"{expected}, got {actions!r}") from error
        if numbers.shape != (count,) or not np.issubdtype(numbers.dtype, np.integer):
            raise CommandError(f"{expected}, got {actions!r}")
        if count and not (numbers.min() >= 0 and numbers.max() < len(densities)):
            raise CommandError(f"{expected}, got {actions!r}")
        return np.asarray(densities[numbers])
