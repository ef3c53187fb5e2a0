"""Drones as agents for Stable-Baselines3: shared parameters, one row for each drone of each game."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.buffers import RolloutBuffer
from stable_baselines3.common.type_aliases import RolloutBufferSamples
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from swarm_pz.config import GameConfig, resolve
from swarm_pz.envs.drones_batch import DronesBatch, Side
from swarm_pz.envs.opponents import Opponents
from swarm_pz.kernels.sight import SITS_OUT
from swarm_pz.rendering.painter import draw
from swarm_pz.spaces.drones import DroneAction
from swarm_pz.training.vec_env import BatchVecEnv


class DronesVecEnv(BatchVecEnv):
    """E games at once of N drones each, whose E·N agents are the rows: row e·N + i is drone i of game e.

    To a learner of Stable-Baselines3 every row is an environment, and all share its parameters: its PPO is IPPO. Rules,
    spaces and rewards are those of `swarm_pz.envs.drones_env.DronesEnv`. Rows of inactive drones go on: the first
    number that they see is -1 in place of 1, the others are 0, and their action means nothing. All rows of a game end
    together. Infos are empty until a game ends; then they hold ``terminal_observation``, ``TimeLimit.truncated`` and
    the numbers of `DronesEnv`.

    Parameters
    ----------
    config : GameConfig, optional
    num_games : int
    side, action, action_period, neighbours, grid, patch, max_cycles, **overrides
        As of `DronesEnv`.
    opponent : str, Policy or sequence of these, optional
        As of `DronesEnv`; several are dealt to the games in turn.
    threads : int
    seed : int, optional
    """

    def __init__(
        self,
        config: GameConfig | None = None,
        num_games: int = 16,
        *,
        side: Side = "random",
        opponent: Opponents | None = None,
        action: DroneAction = "acceleration",
        action_period: float = 0.2,
        neighbours: int = 5,
        grid: int = 10,
        patch: int = 5,
        threads: int = 1,
        seed: int | None = None,
        max_cycles: int | None = None,
        **overrides: Any,
    ) -> None:
        # The base class asks for attributes while it initialises, so ours come first.
        self.drones = DronesBatch(
            resolve(config, overrides, type(self)),
            num_games,
            side=side,
            opponent=opponent,
            action=action,
            action_period=action_period,
            neighbours=neighbours,
            grid=grid,
            patch=patch,
            threads=threads,
            max_cycles=max_cycles,
        )
        self.view = self.drones.view
        self.num_games, self.num_drones = num_games, self.drones.config.num_drones
        self.render_mode = "rgb_array"
        self._streams = np.random.SeedSequence(seed).spawn(num_games)
        self._actions: NDArray[Any] = np.zeros(0, np.float32)
        super().__init__(num_games * self.num_drones, self.view.space, self.drones.actions.space)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the games that `reset` starts next; each has a stream of its own."""
        self._streams = np.random.SeedSequence(seed).spawn(self.num_games)
        return [seed] * self.num_envs

    def reset(self) -> VecEnvObs:
        """Start all games afresh."""
        self._restart(np.arange(self.num_games))
        self.reset_infos = [info for game in range(self.num_games) for info in self.drones.infos(None, game)]
        return self._rows(self.drones.observe())

    def step_async(self, actions: NDArray[Any]) -> None:
        """Take the agents' actions."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Play the actions; games that end start afresh at once."""
        drones = self.drones
        accelerations = drones.actions.read(self._actions, (self.num_envs,), "actions")
        result = drones.step(accelerations.reshape(self.num_games, self.num_drones, 2))
        over = result.terminated | result.truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        ended = np.flatnonzero(over)
        if len(ended):
            last = drones.observe(ended)
            for place, game in enumerate(ended.tolist()):
                for drone, numbers in enumerate(drones.infos(result, game)):
                    infos[game * self.num_drones + drone] = numbers | {
                        "terminal_observation": last[place, drone],
                        "TimeLimit.truncated": bool(result.truncated[game]),
                    }
            self._restart(ended)
        return (
            self._rows(drones.observe()),
            result.rewards.astype(np.float32).ravel(),
            np.repeat(over, self.num_drones),
            infos,
        )

    def _rows(self, seen: NDArray[np.float32]) -> NDArray[np.float32]:
        return seen.reshape(self.num_envs, -1)

    def _restart(self, games: NDArray[np.int64]) -> None:
        self.drones.reset([self._streams[game].spawn(1)[0] for game in games], games)

    def close(self) -> None:
        """End the threads."""
        self.drones.batch.close()

    def get_images(self) -> list[NDArray[np.uint8] | None]:
        """Draw every row's game."""
        pictures = [draw(self.drones.batch.simulator, game) for game in range(self.num_games)]
        return [picture for picture in pictures for _ in range(self.num_drones)]


class PlayingRolloutBuffer(RolloutBuffer):
    """A `rollout_buffer_class` for PPO on `DronesVecEnv` that leaves out inactive drones.

    Every minibatch leaves out their rows, since their actions mean nothing. The critic sees nothing of an inactive
    drone, so its value is set to the mean value of the active drones of its game, which share the reward.

    Parameters
    ----------
    *args, **kwargs
        As of the base class.
    team : int
        Drones of a game: `DronesVecEnv.num_drones`.
    """

    def __init__(self, *args: Any, team: int, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._team = team

    def compute_returns_and_advantage(self, last_values: torch.Tensor, dones: NDArray[np.bool_]) -> None:
        """Estimate advantages, as the base class does."""
        sits_out = self.observations[:, :, 0] == SITS_OUT
        self.values = self._worth(self.values, sits_out)
        # Which drones are inactive after the last step is not known: those before it are taken.
        last = self._worth(last_values.cpu().numpy().reshape(1, -1), sits_out[-1:])
        super().compute_returns_and_advantage(torch.from_numpy(last), dones)

    def _worth(self, values: NDArray[np.float32], sits_out: NDArray[np.bool_]) -> NDArray[np.float32]:
        """Return values (n, E * N) with those of rows that sit out replaced."""
        by_game = (len(values), -1, self._team)
        plays = ~sits_out.reshape(by_game)
        sums = (values.reshape(by_game) * plays).sum(axis=2)
        instead = np.repeat(sums / np.maximum(plays.sum(axis=2), 1), self._team, axis=1)
        return np.where(sits_out, instead, values).astype(np.float32)

    def get(self, batch_size: int | None = None) -> Iterator[RolloutBufferSamples]:  # type: ignore[override]
        """Yield minibatches without the rows of inactive drones."""
        for samples in super().get(batch_size):
            plays = samples.observations[:, 0] != SITS_OUT
            if plays.sum() > 1:  # advantages of one alone cannot be normalised
                yield RolloutBufferSamples(*(part[plays] for part in samples))
