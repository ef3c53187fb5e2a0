"""One learner against an opponent: Gymnasium faces of the environment.

`DuelEnv` and `DuelVectorEnv` are registered with Gymnasium as ``swarm_pz/Capture-v0``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config import GameConfig, resolve
from swarm_pz.duel_batch import DuelBatch, Opponents
from swarm_pz.errors import CommandError
from swarm_pz.observation import Observations
from swarm_pz.policy import Policy
from swarm_pz.render import METADATA, Screen


class DuelEnv(gymnasium.Env[Any, NDArray[np.float32]]):
    """One learner against an opponent, as a Gymnasium environment.

    Rules, observations and rewards are those of `swarm_pz.parallel_env.CaptureEnv`, seen from the
    learner's side.

    Parameters
    ----------
    config : GameConfig, optional
    opponent : str or Policy
        A name that `policies.names()` lists, or a policy.
    side : {"random", "red", "blue"}
        Where the learner sits.
    action : {"log_density", "density"}
        With ``log_density``, the action space is Box(-1, 1) and the command its softmax, which
        suits Gaussian policies; with ``density`` it is the command itself.
    action_cells : int, optional
        Cells a side of an action, interpolated to the command's; as many as these if not given.
    render_mode : str, optional
    max_cycles : int, optional
    **overrides
        Fields of `GameConfig` to replace.

    Examples
    --------
    >>> import gymnasium, swarm_pz
    >>> env = gymnasium.make("swarm_pz/Capture-v0", opponent="uniform")
    >>> observation, info = env.reset(seed=0)
    >>> observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    >>> observation.shape, info["time_s"]
    ((9, 50, 50), 1.0)
    """

    metadata = METADATA

    def __init__(
        self,
        config: GameConfig | None = None,
        *,
        opponent: str | Policy = "uniform",
        side: Literal["random", "red", "blue"] = "random",
        action: Literal["log_density", "density"] = "log_density",
        action_cells: int | None = None,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        **overrides: Any,
    ) -> None:
        config = resolve(config, overrides)
        self.duel = DuelBatch(
            config, 1, opponent=opponent, side=side, action=action, action_cells=action_cells, max_cycles=max_cycles
        )
        self.render_mode = render_mode
        self.screen = Screen(render_mode, self.duel.batch.simulator)
        self.metadata = self.screen.metadata
        self.observation_space = self.duel.observation_space
        self.action_space = self.duel.action_space
        self._seeds = np.random.SeedSequence()

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Start a game; `options` may hold a scenario."""
        super().reset(seed=seed)
        if seed is not None:
            self._seeds = np.random.SeedSequence(seed)
            game_seed = np.random.SeedSequence(seed)
        else:
            game_seed = self._seeds.spawn(1)[0]
        self.duel.reset([game_seed], np.zeros(1, np.int64), options)
        self.screen.begin()
        return _first(self.duel.observe()), self.duel.start_info(0)

    def step(self, action: ArrayLike) -> tuple[Observations, float, bool, bool, dict[str, Any]]:
        """Play one command."""
        result = self.duel.step(np.asarray(action)[None], self.screen.after_control_period)
        return (
            _first(self.duel.observe()),
            float(result.rewards[0]),
            bool(result.terminated[0]),
            bool(result.truncated[0]),
            self.duel.info(result.result, 0),
        )

    def render(self) -> Any:
        """Show or return the board as the render mode says."""
        return self.screen.render()

    def close(self) -> None:
        """Close the window and end threads."""
        self.screen.close()
        self.duel.batch.close()


class DuelVectorEnv(VectorEnv[Any, Any, Any]):
    """Many games at once, one learner in each; what ``gymnasium.make_vec`` gives.

    A game that has ended starts afresh at the next step (`AutoresetMode.NEXT_STEP`).

    Parameters
    ----------
    num_envs : int
    config, opponent, side, action, action_cells, max_cycles, **overrides
        As of `DuelEnv`; `opponent` may be a sequence, dealt to the games in turn.
    threads : int

    Examples
    --------
    >>> import gymnasium, swarm_pz
    >>> envs = gymnasium.make_vec("swarm_pz/Capture-v0", num_envs=4, opponent="ring")
    >>> observations, infos = envs.reset(seed=0)
    >>> observations, rewards, terminated, truncated, infos = envs.step(envs.action_space.sample())
    >>> observations.shape, rewards.shape
    ((4, 9, 50, 50), (4,))
    """

    metadata = METADATA | {"autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        config: GameConfig | None = None,
        *,
        opponent: Opponents = "uniform",
        side: Literal["random", "red", "blue"] = "random",
        action: Literal["log_density", "density"] = "log_density",
        action_cells: int | None = None,
        threads: int = 1,
        render_mode: str | None = None,
        max_cycles: int | None = None,
        **overrides: Any,
    ) -> None:
        config = resolve(config, overrides)
        self.num_envs = num_envs
        self.duel = DuelBatch(
            config,
            num_envs,
            opponent=opponent,
            side=side,
            action=action,
            action_cells=action_cells,
            threads=threads,
            max_cycles=max_cycles,
        )
        self.render_mode = render_mode
        self.screen = Screen(render_mode, self.duel.batch.simulator)
        self.metadata = self.screen.metadata | {"autoreset_mode": AutoresetMode.NEXT_STEP}
        self.single_observation_space = self.duel.observation_space
        self.single_action_space = self.duel.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._streams = np.random.SeedSequence().spawn(num_envs)

    def reset(
        self, *, seed: int | Sequence[int] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Start all games; one seed s gives game i the seed s + i, as Gymnasium does."""
        if seed is not None:
            seeds = [seed + i for i in range(self.num_envs)] if isinstance(seed, (int, np.integer)) else list(seed)
            if len(seeds) != self.num_envs:
                raise CommandError(f"seed must be one number or {self.num_envs}, got {len(seeds)}")
            self._streams = [np.random.SeedSequence(number) for number in seeds]
            first = [np.random.SeedSequence(number) for number in seeds]
        else:
            first = [stream.spawn(1)[0] for stream in self._streams]
        self.duel.reset(first, np.arange(self.num_envs), options)
        self.screen.begin()
        return self.duel.observe(), self._gather([self.duel.start_info(row) for row in range(self.num_envs)])

    def step(
        self, actions: ArrayLike
    ) -> tuple[Observations, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Play one command in every running game and start afresh those that had ended."""
        ended = np.flatnonzero(~self.duel.batch.running)
        if len(ended) == self.num_envs:
            nothing = np.zeros(self.num_envs)
            never = np.zeros(self.num_envs, np.bool_)
            self._restart(ended)
            infos = [self.duel.start_info(row) for row in range(self.num_envs)]
            return self.duel.observe(), nothing, never, never.copy(), self._gather(infos)
        result = self.duel.step(actions, self.screen.after_control_period)
        if len(ended):
            self._restart(ended)
        infos = [
            self.duel.start_info(row) if row in ended else self.duel.info(result.result, row)
            for row in range(self.num_envs)
        ]
        return self.duel.observe(), result.rewards, result.terminated, result.truncated, self._gather(infos)

    def _restart(self, rows: NDArray[np.int64]) -> None:
        self.duel.reset([self._streams[row].spawn(1)[0] for row in rows], rows)
        if 0 in rows:
            self.screen.begin()

    def _gather(self, infos: list[dict[str, Any]]) -> dict[str, Any]:
        gathered: dict[str, Any] = {}
        for row, info in enumerate(infos):
            gathered = self._add_info(gathered, info, row)
        return gathered

    def render(self) -> Any:
        """Show or return the first game's board as the render mode says."""
        return self.screen.render()

    def close_extras(self, **kwargs: Any) -> None:
        """Close the window and end threads."""
        self.screen.close()
        self.duel.batch.close()


def _first(observations: Observations) -> Observations:
    if isinstance(observations, dict):
        return {name: part[0] for name, part in observations.items()}
    return observations[0]
