"""A player's observations and actions: the same options in every wrapper.

Actions are commands to the control system that flies the player's team, in one of these forms:

- `action="command"`: the command itself.
- `"normalised"`: numbers from -1 to 1, for Gaussian policies; for a density they are logarithms, put through a softmax.
- `"modes"`: 5 numbers (3 with 2 x 2 cells) from -2 to 2, for PPO with its default settings: twice the weights of the
  coarsest cosines in a density's logarithm; zeros mean uniform.
- `"discrete"`: the index of a named command, for DQN.

`action_cells` is the number of cells a side of a coarser density, which is interpolated.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.config.system import ControlSystem
from swarm_pz.spaces.actions import ActionKind, make_actions
from swarm_pz.spaces.observation import observation_space


class Format:
    """One player's spaces, and how its actions become commands.

    `system` flies the player's team, by default the first of `config.controllers`. `action_cells` is the number of
    cells a side of a density, by default that of the command. `command_names` has the names of discrete actions.
    Raises a ConfigError if an option is unknown or does not fit the others.
    """

    def __init__(
        self,
        config: GameConfig,
        observation: ObservationConfig,
        system: ControlSystem | None = None,
        *,
        action: ActionKind = "normalised",
        action_cells: int | None = None,
    ) -> None:
        self.observation = observation
        system = config.team_systems[0] if system is None else system
        self._actions = make_actions(config, system, action, action_cells)
        self.action_space, self.command_names = self._actions.space, self._actions.names
        self.observation_space: spaces.Space[Any] = observation_space(config, observation)

    def read(self, actions: ArrayLike, count: int, name: str = "actions") -> NDArray[np.float64]:
        """Turn n = `count` actions into commands (n, ...); raise a CommandError that calls them `name`."""
        return self._actions.read(actions, count, name)

    def read_one(self, action: ArrayLike, name: str) -> NDArray[np.float64]:
        """Turn one action into a command; raises as `read`."""
        return np.asarray(self._actions.read_one(action, name))
