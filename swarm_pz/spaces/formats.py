"""A player's observations and actions: the same options in every wrapper.

Actions are commands to the control system that flies the player's team, in one of these forms:

- `action="command"`: the command itself.
- `"normalised"`: numbers from -1 to 1, for Gaussian policies; of a density the logarithms, which go through a softmax.
- `"modes"`: 5 numbers from -2 to 2, for PPO with its default settings: the weights, in halves, of the coarsest cosines
  in a density's logarithm; zeros mean uniform.
- `"discrete"`: the number of a command that has a name, for DQN.

`action_cells` are the cells a side of a shorter density, which is interpolated.
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

    `system` flies the player's team: the first of `config.controllers` if not given. `action_cells` are the cells a
    side of a density, as many as the command has if not given. `command_names` has the names of discrete actions.
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
        """Turn n = `count` actions into commands (n, ...); raise a CommandError, which calls them `name`."""
        return self._actions.read(actions, count, name)

    def read_one(self, action: ArrayLike, name: str) -> NDArray[np.float64]:
        """Turn one action into a command; raises as `read`."""
        return np.asarray(self._actions.read_one(action, name))
