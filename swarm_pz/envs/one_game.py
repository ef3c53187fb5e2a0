"""The common base of the PettingZoo wrappers: one game of a batch, its seeds, board and pictures."""

from __future__ import annotations

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
        self._np_random: np.random.Generator | None = None

    @property
    def np_random(self) -> np.random.Generator:
        """The generator from which games without a seed come; may be assigned."""
        if self._np_random is None:
            self._np_random = seeding.np_random()[0]
        return self._np_random

    @np_random.setter
    def np_random(self, generator: np.random.Generator) -> None:
        self._np_random = generator

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

    def _asked(
        self, seed: int | None, options: Mapping[str, Any] | None
    ) -> tuple[np.random.SeedSequence, dict[str, NDArray[Any]]]:
        """Return the seed of the next game, and its scenario; if one is refused, nothing has changed."""
        scenario = check_scenario(options or {}, self.batch.config)
        return check_seed(seed) if seed is not None else next_seed(self.np_random), scenario

    def _began(self, seed: int | None, agents: list[str]) -> None:
        """Note that a game has begun."""
        if seed is not None:
            self._np_random = seeding.np_random(int(seed))[0]
        self.agents = list(agents)
        self.screen.begin()

    @property
    def max_cycles(self) -> int:
        """Steps until a draw; may be assigned."""
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
