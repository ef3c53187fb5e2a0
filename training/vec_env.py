"""Stable-Baselines3's view of the environment: a native VecEnv over a batch of duels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from swarm_pz.config import GameConfig
from swarm_pz.duel_batch import DuelBatch, Opponents
from swarm_pz.observation import Observations
from swarm_pz.render import draw


class SwarmVecEnv(VecEnv):
    """E games at once, a learner in each, opponents answered in one batch.

    Infos are empty but for games that have just ended, which carry ``terminal_observation``,
    ``TimeLimit.truncated`` and the entries of the other faces; wrap in SB3's `VecMonitor` for
    ``episode``.

    Parameters
    ----------
    config : GameConfig, optional
        `observation` is what the learner sees; opponents say for themselves what they see.
    num_envs : int
    opponent : str, Policy or sequence of these
        Dealt to the games in turn.
    side : {"random", "red", "blue"}
        Where the learner sits; drawn anew for every game if random.
    action : {"log_density", "density"}
    action_cells : int, optional
        Cells a side of an action, interpolated to the command's.
    threads : int
    seed : int, optional
    """

    def __init__(
        self,
        config: GameConfig | None = None,
        num_envs: int = 64,
        *,
        opponent: Opponents = "uniform",
        side: Literal["random", "red", "blue"] = "random",
        action: Literal["log_density", "density"] = "log_density",
        action_cells: int | None = None,
        threads: int = 1,
        seed: int | None = None,
    ) -> None:
        # The base class asks for attributes while it initialises, so ours come first.
        self.duel = DuelBatch(
            config if config is not None else GameConfig(),
            num_envs,
            opponent=opponent,
            side=side,
            action=action,
            action_cells=action_cells,
            threads=threads,
        )
        self.render_mode = "rgb_array"
        self._streams = np.random.SeedSequence(seed).spawn(num_envs)
        self._actions: NDArray[np.float32] = np.zeros(0, np.float32)
        super().__init__(num_envs, self.duel.observation_space, self.duel.action_space)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the games that `reset` starts next; each has a stream of its own."""
        self._streams = np.random.SeedSequence(seed).spawn(self.num_envs)
        return [seed] * self.num_envs

    def deal(self, opponent: Opponents, names: Sequence[str] | None = None) -> None:
        """Give other opponents to the games that start from now on, as of `DuelBatch.deal`."""
        self.duel.deal(opponent, names)

    def _restart(self, rows: NDArray[np.int64]) -> None:
        self.duel.reset([self._streams[row].spawn(1)[0] for row in rows], rows)

    def reset(self) -> VecEnvObs:
        """Start all games afresh."""
        self._restart(np.arange(self.num_envs))
        self.reset_infos = [self.duel.start_info(row) for row in range(self.num_envs)]
        return self.duel.observe()  # type: ignore[no-any-return]

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Take the learners' actions."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Play the actions; games that end start afresh at once."""
        duel = self.duel
        result = duel.step(self._actions)
        dones = result.terminated | result.truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        ended = np.flatnonzero(dones)
        if len(ended):
            last = duel.observe(ended)
            for place, row in enumerate(ended.tolist()):
                infos[row] = duel.info(result.result, row) | {
                    "terminal_observation": _entry(last, place),
                    "TimeLimit.truncated": bool(result.truncated[row]),
                }
            self._restart(ended)
        return duel.observe(), result.rewards.astype(np.float32), dones, infos

    def close(self) -> None:
        """End the threads."""
        self.duel.batch.close()

    def get_images(self) -> list[NDArray[np.uint8] | None]:
        """Draw every game."""
        return [draw(self.duel.batch.simulator, row) for row in range(self.num_envs)]

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of this object for each of the games."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Refuse: games of a batch have no attributes of their own."""
        raise AttributeError(f"games of a SwarmVecEnv share their attributes: set {attr_name!r} on the SwarmVecEnv")

    def env_method(self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any) -> list[Any]:
        """Refuse: games of a batch have no methods of their own."""
        raise AttributeError(f"games of a SwarmVecEnv have no method {method_name!r} of their own")

    def env_is_wrapped(self, wrapper_class: Any, indices: VecEnvIndices = None) -> list[bool]:
        """Return False for each of the games: none is wrapped on its own."""
        return [False for _ in self._get_indices(indices)]


def _entry(observations: Observations, place: int) -> Any:
    if isinstance(observations, dict):
        return {name: part[place] for name, part in observations.items()}
    return observations[place]
