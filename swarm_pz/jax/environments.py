"""The game with the faces of two libraries, neither of which it needs: JaxMARL's for both sides, Gymnax's for one."""

from __future__ import annotations

import dataclasses
from typing import Any, NamedTuple

import jax
from jax import numpy as jnp

from swarm_pz.config import AGENTS, CHANNELS, GameConfig, ObservationConfig
from swarm_pz.config.base import check
from swarm_pz.jax.game import reset, see, step_once
from swarm_pz.jax.params import Array, Params, make_params
from swarm_pz.jax.players import Player
from swarm_pz.jax.state import State

_CELLS = GameConfig().command_cells
_RED, _BLUE = AGENTS


class Box(NamedTuple):
    """Arrays of a shape, with values from low to high: a space of JaxMARL and of Gymnax."""

    low: float
    high: float
    shape: tuple[int, ...]
    dtype: Any

    def sample(self, key: Array) -> Array:
        """Draw an array."""
        drawn = jax.random.uniform(key, self.shape, minval=self.low, maxval=self.high + (self.dtype == jnp.uint8))
        return drawn.astype(self.dtype)

    def contains(self, values: Array) -> Array:
        """Tell whether an array belongs to it."""
        return jnp.all((values >= self.low) & (values <= self.high))


ACTIONS = Box(0.0, 1.0, (_CELLS, _CELLS), jnp.float32)


def default_params() -> Params:
    """Return ten drones against ten, seen on a grid of 10."""
    return make_params(GameConfig(observation=ObservationConfig(grid=10)))


def observation_box(params: Params) -> Box:
    """Return the space of a side's images.

    Raises
    ------
    ConfigError
        If it sees lists of drones: spaces of these libraries have one shape.
    """
    check(params.grid > 0, "observation.kind", "entities", "'grids' here, an image of one shape")
    return Box(0.0, 255.0, (len(CHANNELS), params.grid, params.grid), jnp.uint8)


class TwoSides:
    """Both sides learn: what JaxMARL calls a `MultiAgentEnv`, with the agents `red_0` and `blue_0`.

    Parameters
    ----------
    params : Params, optional
        Ten drones against ten, seen on a grid of 10, if not given.
    """

    name = "swarm_pz"

    def __init__(self, params: Params | None = None) -> None:
        self.params = default_params() if params is None else params
        self.agents, self.num_agents = list(AGENTS), len(AGENTS)
        self.agent_classes = {"side": self.agents}
        self.observation_spaces = dict.fromkeys(AGENTS, observation_box(self.params))
        self.action_spaces = dict.fromkeys(AGENTS, ACTIONS)

    def observation_space(self, agent: str) -> Box:
        """Return the space of what an agent sees."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Box:
        """Return the space of an agent's densities."""
        return self.action_spaces[agent]

    def reset(self, key: Array) -> tuple[dict[str, Any], State]:
        """Begin a game."""
        return reset(key, self.params)

    def step(self, key: Array, state: State, actions: dict[str, Array], reset_state: State | None = None) -> Any:
        """As `swarm_pz.jax.step`; `reset_state` follows a game that ends, if given."""
        seen, after, rewards, dones, infos = step_once(state, actions, self.params)
        first, begun = self.reset(key) if reset_state is None else (self.get_obs(reset_state), reset_state)
        seen, after = _select(dones["__all__"], (first, begun), (seen, after))
        return seen, after, rewards, dones, infos

    def step_env(self, key: Array, state: State, actions: dict[str, Array]) -> Any:
        """As `swarm_pz.jax.step_once`."""
        del key
        return step_once(state, actions, self.params)

    def get_obs(self, state: State) -> dict[str, Any]:
        """Return the observations of both sides."""
        return see(state, self.params)


class OneSide:
    """One learner, red, against a player: an `Environment` of Gymnax 1.0.

    Parameters
    ----------
    opponent : Player
        See `swarm_pz.jax.players.load`.
    """

    name = "swarm_pz"

    def __init__(self, opponent: Player) -> None:
        self.opponent = opponent
        self.default_params = default_params()

    def observation_space(self, params: Params | None = None) -> Box:
        """Return the space of what the learner sees."""
        return observation_box(params or self.default_params)

    def action_space(self, params: Params | None = None) -> Box:
        """Return the space of its densities."""
        del params
        return ACTIONS

    def reset(self, key: Array, params: Params | None = None) -> tuple[Any, State]:
        """Begin a game."""
        seen, state = reset(key, params or self.default_params)
        return seen[_RED], state

    def step(
        self, key: Array, state: State, action: Array, params: Params | None = None
    ) -> tuple[Any, State, Array, Array, Array, dict[str, Array]]:
        """Hold the learner's density (10, 10) for a command period.

        Returns
        -------
        observation, state, reward, terminated, truncated, info
            After an end the first two are of the next game, and `info["final_observation"]` of the one that ended.
        """
        numbers = params or self.default_params
        to_opponent, to_next = jax.random.split(key)
        shown = see(state, dataclasses.replace(numbers, grid=self.opponent.grid))[_BLUE]
        actions = {_RED: action, _BLUE: self.opponent.act(to_opponent, shown)}
        seen, after, rewards, dones, infos = step_once(state, actions, numbers)
        info = {name: values[0] for name, values in infos.items()} | {"final_observation": seen[_RED]}
        first, begun = self.reset(to_next, numbers)
        ended, truncated = dones[_RED], info["truncated"]
        observation, state = _select(ended, (first, begun), (seen[_RED], after))
        return observation, state, rewards[_RED], ended & ~truncated, truncated, info


def _select(chooses: Array, one: Any, other: Any) -> Any:
    return jax.tree.map(lambda first, second: jnp.where(chooses, first, second), one, other)
