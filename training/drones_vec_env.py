"""Drones as agents for Stable-Baselines3: shared parameters, one row for each drone of each game."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.type_aliases import RolloutBufferSamples

from swarm_pz.config import GameConfig
from swarm_pz.envs.batch_env import StepResult
from swarm_pz.envs.drones_batch import DronesBatch
from swarm_pz.kernels.sight import SITS_OUT
from swarm_pz.training.vec_env import GamesVecEnv, make_games


class DronesVecEnv(GamesVecEnv):
    """E games at once of N drones each, whose E·N agents are the rows: row e·N + i is drone i of game e.

    To Stable-Baselines3 every row is an environment, and all share the learner's parameters: its PPO is IPPO. Rules,
    spaces and rewards are those of `swarm_pz.envs.drones_env.DronesEnv`. Inactive drones keep their rows: the first
    number of their observations is -1 in place of 1, the others are 0, and their actions have no effect. All rows of a
    game end together. Infos are empty until a game ends; then they hold ``terminal_observation``,
    ``TimeLimit.truncated`` and the numbers of `DronesEnv`.

    Parameters
    ----------
    num_games : int
    threads, seed : int, optional
    config, side, opponent, action, action_period, neighbours, grid, patch, max_cycles, **rules
        As of `DronesEnv`; several opponents are dealt to the games in turn.
    """

    def __init__(
        self, config: GameConfig | None = None, num_games: int = 16, *, seed: int | None = None, **keywords: Any
    ) -> None:
        self.drones = make_games(DronesBatch, type(self), config, num_games, keywords)
        self.view, self.num_drones = self.drones.view, self.drones.config.num_drones
        super().__init__(self.drones, self.num_drones, self.view.space, self.drones.actions.space)
        self.seed(seed)

    def _see(self, games: NDArray[np.int64]) -> NDArray[np.float32]:
        return self.drones.observe(games).reshape(len(games) * self.num_drones, -1)

    def _play(self, actions: NDArray[Any]) -> StepResult:
        accelerations = self.drones.actions.read(actions, (self.num_envs,), "actions")
        return self.drones.step(accelerations.reshape(self.num_games, self.num_drones, 2))

    def _infos(self, result: StepResult | None, games: NDArray[np.int64]) -> list[dict[str, Any]]:
        return [info for game in games.tolist() for info in self.drones.infos(result, game)]


class PlayingRolloutBuffer(RolloutBuffer):
    """A `rollout_buffer_class` for PPO on `DronesVecEnv` that leaves out inactive drones.

    Every minibatch leaves out their rows, since their actions mean nothing. The critic sees nothing of an inactive
    drone, so its value is set to the mean value of the active drones of its game, which share the reward. `team` is
    the number of a game's drones, `DronesVecEnv.num_drones`.
    """

    def __init__(self, *args: Any, team: int, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._team = team

    def compute_returns_and_advantage(self, last_values: torch.Tensor, dones: NDArray[np.bool_]) -> None:
        """Estimate advantages, as the base class does."""
        sits_out = self.observations[:, :, 0] == SITS_OUT
        self.values = self._worth(self.values, sits_out)
        # The buffer has no observation after the last step, so it takes the drones that were inactive before it.
        last = self._worth(last_values.cpu().numpy().reshape(1, -1), sits_out[-1:])
        super().compute_returns_and_advantage(torch.from_numpy(last), dones)

    def _worth(self, values: NDArray[np.float32], sits_out: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Return values (n, E * N), those of inactive drones replaced."""
        by_game = (len(values), -1, self._team)
        plays = ~sits_out.reshape(by_game)
        sums = (values.reshape(by_game) * plays).sum(axis=2)
        instead = np.repeat(sums / np.maximum(plays.sum(axis=2), 1), self._team, axis=1)
        return np.where(sits_out, instead, values).astype(np.float32)

    def get(self, batch_size: int | None = None) -> Iterator[RolloutBufferSamples]:  # type: ignore[override]
        """Yield minibatches without the rows of inactive drones."""
        for samples in super().get(batch_size):
            plays = samples.observations[:, 0] != SITS_OUT
            if plays.sum() > 1:  # a single advantage cannot be normalised
                yield RolloutBufferSamples(*(part[plays] for part in samples))
