"""The game with the interfaces of JaxMARL (for sides) and Gymnax (for one side); it needs neither library.

Classes are subclasses of those of JaxMARL and Gymnax if these are installed.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from contextlib import suppress
from importlib import import_module
from typing import Any, Literal

import jax
from jax import numpy as jnp

from swarm_pz.config import AGENTS, CHANNELS, MOTION_CHANNELS, GameConfig, ObservationConfig
from swarm_pz.config.base import check, check_choice
from swarm_pz.jax.game import reset, see, step_once
from swarm_pz.jax.params import Array, Params, State, make_params
from swarm_pz.jax.players import Player
from swarm_pz.spaces.actions import LARGEST_MODE, mode_waves
from swarm_pz.spaces.densities import named_commands

_CELLS = GameConfig().command_cells
_RED, _BLUE = AGENTS


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


def make_actions(kind: str) -> tuple[Any, Callable[[Array], Array]]:
    """Return the space of a kind of actions of `TwoSides`, and how an action becomes a density (10, 10)."""
    if kind == "command":
        return Box(0.0, 1.0, (_CELLS, _CELLS), jnp.float32), lambda action: action
    if kind == "modes":
        waves = jnp.asarray(mode_waves(_CELLS), jnp.float32)

        def of_modes(action: Array) -> Array:
            weights = jnp.clip(action, -LARGEST_MODE, LARGEST_MODE) / LARGEST_MODE
            logs = (weights[:, None, None] * waves).sum(axis=0)
            return jnp.exp(logs - logs.max())

        return Box(-LARGEST_MODE, LARGEST_MODE, (len(waves),), jnp.float32), of_modes
    check(kind == "discrete", "action", kind, "'command', 'modes' or 'discrete'")
    named = jnp.asarray(named_commands(_CELLS), jnp.float32)
    # Trainers of JaxMARL pass arrays (1,).
    return Discrete(len(named)), lambda action: named[jnp.reshape(action, ())]


def default_params() -> Params:
    """Return the parameters of ten drones against ten, observed on a grid of 10."""
    return make_params(GameConfig(observation=ObservationConfig(grid=10)))


class TwoSides(*library_classes("multi_agent_env", "MultiAgentEnv", ("jaxmarl",))):  # type: ignore[misc]
    """A `MultiAgentEnv` of JaxMARL, with the agents `red_0` and `blue_0`, or `red_0` alone against an opponent.

    Parameters
    ----------
    params : Params, optional
        By default, ten drones against ten, observed on a grid of 10.
    action : {"command", "modes", "discrete"}
        Densities (10, 10), weights (5,) of cosines, or the number of one of 57 named densities.
    observation : {"images", "vector"}
        uint8 images, or the same as float32 vectors in [0, 1]. With vectors, observations also have `world_state`: each
        agent's vector and the other side's, for a critic that sees both.
    opponent : Player, optional
        The player of blue; see `swarm_pz.jax.players.load`.
    final_observation : bool
        Whether `infos` of `step` have `final_observation`, each agent's last observation, for values after a
        truncation. Most trainers of JaxMARL reshape `infos` to one number an agent, and fail with it.
    """

    name = "swarm_pz"

    def __init__(
        self,
        params: Params | None = None,
        *,
        action: Literal["command", "modes", "discrete"] = "command",
        observation: Literal["images", "vector"] = "images",
        opponent: Player | None = None,
        final_observation: bool = False,
    ) -> None:
        check_choice(observation, "observation", ("images", "vector"))
        self.params = params = default_params() if params is None else params
        check(params.grid > 0, "observation.kind", "entities", "'grids' here, an image of one shape")
        self._opponent, self._is_vector, self._has_final = opponent, observation == "vector", final_observation
        self.agents = list(AGENTS if opponent is None else AGENTS[:1])
        self.num_agents = len(self.agents)
        space, self._read = make_actions(action)
        self.action_spaces = dict.fromkeys(self.agents, space)
        shape = (len(CHANNELS) + params.motion * len(MOTION_CHANNELS), params.grid, params.grid)
        images, vectors = Box(0.0, 255.0, shape, jnp.uint8), Box(0.0, 1.0, (math.prod(shape),), jnp.float32)
        self.observation_spaces = dict.fromkeys(self.agents, vectors if self._is_vector else images)

    @property
    def agent_classes(self) -> dict[str, list[str]]:
        """Agents by their kind, of which there is one."""
        return {"side": self.agents}

    def observation_space(self, agent: str) -> Box:
        """Return the space of an agent's observations."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Any:
        """Return the space of an agent's actions."""
        return self.action_spaces[agent]

    def world_state_size(self) -> int:
        """Return the length of an agent's row of `world_state`."""
        return len(AGENTS) * self.observation_spaces[_RED].shape[0]

    def get_avail_actions(self, state: State) -> dict[str, Array]:
        """Return masks (57,) of the discrete actions, all of which are always available."""
        del state
        return {agent: jnp.ones(space.n, bool) for agent, space in self.action_spaces.items()}

    def reset(self, key: Array) -> tuple[dict[str, Any], State]:
        """Begin a game."""
        observations, state = reset(key, self.params)
        return self._show(observations), state

    def step(self, key: Array, state: State, actions: dict[str, Array], reset_state: State | None = None) -> Any:
        """As `step_env`; if the game ends, return observations and state of `reset_state`, or of a new game."""
        to_opponent, to_next = jax.random.split(key)
        observations, after, rewards, dones, infos = self.step_env(to_opponent, state, actions)
        if self._has_final:
            infos["final_observation"] = jnp.stack([observations[agent] for agent in self.agents])
        begun = self.reset(to_next) if reset_state is None else (self.get_obs(reset_state), reset_state)
        done = dones["__all__"]
        observations, after = jax.tree.map(lambda new, old: jnp.where(done, new, old), begun, (observations, after))
        return observations, after, rewards, dones, infos

    def step_env(self, key: Array, state: State, actions: dict[str, Array]) -> Any:
        """As `swarm_pz.jax.step_once`, for this environment's agents."""
        densities = {agent: self._read(action) for agent, action in actions.items()}
        if self._opponent is not None:
            player = self._opponent
            shown = see(state, dataclasses.replace(self.params, grid=player.grid, motion=player.motion))[_BLUE]
            densities[_BLUE] = player.act(key, shown)
        observations, after, rewards, dones, infos = step_once(state, densities, self.params)
        rewards = {agent: rewards[agent] for agent in self.agents}
        dones = {agent: dones[agent] for agent in (*self.agents, "__all__")}
        infos = {name: values[: self.num_agents] for name, values in infos.items()}
        return self._show(observations), after, rewards, dones, infos

    def get_obs(self, state: State) -> dict[str, Any]:
        """Return the observations of all agents."""
        return self._show(see(state, self.params))

    def _show(self, observations: dict[str, Any]) -> dict[str, Any]:
        if not self._is_vector:
            return {agent: observations[agent] for agent in self.agents}
        red, blue = (observations[agent].reshape(-1) / jnp.float32(255) for agent in AGENTS)
        world = jnp.stack([jnp.concatenate([red, blue]), jnp.concatenate([blue, red])])
        return dict(zip(self.agents, (red, blue), strict=False)) | {"world_state": world[: self.num_agents]}


class OneSide:
    """One learner, red, against a player of `swarm_pz.jax.players.load`: an `Environment` of Gymnax 1.0."""

    name = "swarm_pz"

    def __init__(self, opponent: Player) -> None:
        self.opponent = opponent
        self.default_params = default_params()

    def observation_space(self, params: Params | None = None) -> Box:
        """Return the space of the learner's images."""
        return self._env(params).observation_space(_RED)

    def action_space(self, params: Params | None = None) -> Box:
        """Return the space of the learner's densities."""
        return self._env(params).action_space(_RED)

    def reset(self, key: Array, params: Params | None = None) -> tuple[Any, State]:
        """Begin a game."""
        observations, state = self._env(params).reset(key)
        return observations[_RED], state

    def step(
        self, key: Array, state: State, action: Array, params: Params | None = None
    ) -> tuple[Any, State, Array, Array, Array, dict[str, Array]]:
        """Hold the learner's density (10, 10) for a command period.

        Returns observation, state, reward, terminated, truncated and info. If the game ends, the first two belong to
        the next game, and `info["final_observation"]` to the one that ended.
        """
        observations, state, rewards, dones, infos = self._env(params).step(key, state, {_RED: action})
        info = {name: values[0] for name, values in infos.items()}
        truncated = info["truncated"]
        return observations[_RED], state, rewards[_RED], dones[_RED] & ~truncated, truncated, info

    def _env(self, params: Params | None) -> TwoSides:
        return TwoSides(params or self.default_params, opponent=self.opponent, final_observation=True)
