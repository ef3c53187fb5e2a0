"""The common base of the PettingZoo wrappers: one game of a batch, its seeds, board and pictures."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from swarm_pz.config import BLUE, CHANNELS, GRID_CELLS, RED, ObservationConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.errors import CommandError, nearest
from swarm_pz.rendering.painter import METADATA, Screen
from swarm_pz.simulator.spawn import check_scenario, check_seed, next_seed, seeds_of

STATE_CHANNELS = (
    "red_positions",
    "blue_positions",
    "red_trail_age",
    "blue_trail_age",
    "red_capture_field",
    "blue_capture_field",
    "red_target",
    "blue_target",
    "red_share",
    "time_left",
)

Step = tuple[dict[str, Any], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]
"""Observations, rewards, terminations, truncations and infos, each by agent."""


class OneGameEnv(ParallelEnv[str, Any, Any]):  # type: ignore[misc]  # untyped base
    """A PettingZoo environment over a batch of one game."""

    metadata = METADATA

    def __init__(self, batch: BatchEnv, render_mode: str | None) -> None:
        self.batch = batch
        self.render_mode = render_mode
        self.screen = Screen(render_mode, batch.simulator)
        self.metadata = self.screen.metadata
        self.agents: list[str] = []
        self.state_space = spaces.Box(0, 255, (len(STATE_CHANNELS), GRID_CELLS, GRID_CELLS), np.uint8)
        self.np_random = seeding.np_random()[0]
        """The generator that seeds games without a seed; may be assigned."""

    @property
    def np_random_seed(self) -> Any:
        """The seed of `np_random`."""
        return seeds_of(self.np_random).entropy

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """Return an agent's observation space, the same object at every call."""
        return self._of(agent, self.observation_spaces)

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """Return an agent's action space, the same object at every call."""
        return self._of(agent, self.action_spaces)

    def _of(self, agent: str, entries: dict[str, spaces.Space[Any]]) -> spaces.Space[Any]:
        if agent not in entries:
            raise CommandError(f"there is no agent {agent!r}; {nearest(str(agent), entries)}")
        return entries[agent]

    def reset(
        self, seed: int | None = None, options: Mapping[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Start a game: without a seed, the next of the last seed's sequence. `options` may hold a scenario.

        Raises
        ------
        CommandError
            If seed or options do not fit; nothing is changed.
        """
        scenario = check_scenario(options or {}, self.batch.config)
        self._start(check_seed(seed) if seed is not None else next_seed(self.np_random), scenario)
        if seed is not None:
            self.np_random = seeding.np_random(int(seed))[0]
        self.agents = list(self.possible_agents)
        self.screen.begin()
        return self._observations(), self._infos(None)

    def _stepped(self, result: Any, rewards: NDArray[np.float64]) -> Step:
        """Return a step's results; rewards (A,) are the agents', in their order."""
        agents = self.possible_agents
        if not self.batch.running[0]:
            self.agents = []
        return (
            self._observations(),
            dict(zip(agents, rewards.tolist(), strict=True)),
            dict.fromkeys(agents, bool(result.terminated[0])),
            dict.fromkeys(agents, bool(result.truncated[0])),
            self._infos(result),
        )

    @abstractmethod
    def _start(self, seed: np.random.SeedSequence, scenario: Mapping[str, NDArray[Any]]) -> None: ...

    @abstractmethod
    def _observations(self) -> dict[str, Any]: ...

    @abstractmethod
    def _infos(self, result: Any) -> dict[str, dict[str, Any]]: ...

    @property
    def max_cycles(self) -> int:
        """Steps until a draw; PettingZoo's tests assign it."""
        return self.batch.max_cycles

    @max_cycles.setter
    def max_cycles(self, cycles: int) -> None:
        self.batch.max_cycles = cycles

    def state(self) -> NDArray[np.uint8]:
        """Return the whole board, channels in the order of `STATE_CHANNELS`."""
        observation = ObservationConfig(grid=GRID_CELLS)
        red, blue = (self.batch.observe(observation, team)[0] for team in (RED, BLUE))
        target = CHANNELS.index("own_target")
        return np.concatenate([red[: target + 1], blue[target : target + 1], red[target + 1 :]])

    def render(self) -> Any:
        """Show or return the board as the render mode says."""
        return self.screen.render()

    def close(self) -> None:
        """Close the window and end threads."""
        self.screen.close()
        self.batch.close()
