"""The environment for Stable-Baselines3: native VecEnvs over batches of duels."""

from __future__ import annotations

import copy
import inspect
import itertools
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np
from gymnasium import Space
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from swarm_pz.config import GameConfig, resolve
from swarm_pz.envs.batch_env import StepResult, by_game
from swarm_pz.envs.drones_batch import DronesBatch
from swarm_pz.envs.opponents import DuelBatch, Opponents
from swarm_pz.policy import Player
from swarm_pz.rendering.painter import draw
from swarm_pz.simulator.spawn import check_seed
from swarm_pz.spaces.observation import Observations, of_game

Games = TypeVar("Games", DuelBatch, DronesBatch)


class BatchVecEnv(VecEnv):
    """A VecEnv over one batch: its games have neither attributes nor methods of their own."""

    render_mode = "rgb_array"

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of this object for each of the games."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Raise an AttributeError: games of a batch have no attributes of their own."""
        name = type(self).__name__
        raise AttributeError(f"games of a {name} share their attributes: set {attr_name!r} on the {name}")

    def env_method(self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any) -> list[Any]:
        """Raise an AttributeError: games of a batch have no methods of their own."""
        raise AttributeError(f"games of a {type(self).__name__} have no method {method_name!r} of their own")

    def env_is_wrapped(self, wrapper_class: Any, indices: VecEnvIndices = None) -> list[bool]:
        """Return False for each of the games: none is wrapped on its own."""
        return [False for _ in self._get_indices(indices)]


class GamesVecEnv(BatchVecEnv):
    """A VecEnv over games that restart when they end; each has its own stream of seeds, and `rows` rows."""

    def __init__(
        self, games: DuelBatch | DronesBatch, rows: int, observation_space: Space[Any], action_space: Space[Any]
    ) -> None:
        self._games, self._rows, self.num_games = games, rows, games.batch.num_games
        super().__init__(self.num_games * rows, observation_space, action_space)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the games that `reset` starts next."""
        stream = np.random.SeedSequence() if seed is None else check_seed(seed)
        self._streams = stream.spawn(self.num_games)
        return [seed] * self.num_envs

    def reset(self) -> VecEnvObs:
        """Start all games afresh."""
        games = np.arange(self.num_games)
        self._restart(games)
        self.reset_infos = self._infos(None, games)
        return self._see(games)  # type: ignore[no-any-return]

    def _restart(self, games: NDArray[np.int64]) -> None:
        self._games.reset([self._streams[game].spawn(1)[0] for game in games], games)

    def step_async(self, actions: NDArray[Any]) -> None:
        """Take the learners' actions."""
        self._actions = actions

    def step_wait(self) -> VecEnvStepReturn:
        """Play the actions; games that end start afresh at once."""
        result = self._play(self._actions)
        over = result.terminated | result.truncated
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        ended = np.flatnonzero(over)
        if len(ended):
            last, numbers = self._see(ended), self._infos(result, ended)
            rows = (ended[:, None] * self._rows + np.arange(self._rows)).ravel().tolist()
            for place, row in enumerate(rows):
                infos[row] = numbers[place] | {
                    "terminal_observation": of_game(last, place),
                    "TimeLimit.truncated": bool(result.truncated[row // self._rows]),
                }
            self._restart(ended)
        observations, rewards = self._see(np.arange(self.num_games)), result.rewards.astype(np.float32).ravel()
        return observations, rewards, np.repeat(over, self._rows), infos

    def _see(self, games: NDArray[np.int64]) -> Observations:
        return self._games.observe(games)

    def _play(self, actions: NDArray[Any]) -> StepResult:
        raise NotImplementedError

    def _infos(self, result: StepResult | None, games: NDArray[np.int64]) -> list[dict[str, Any]]:
        raise NotImplementedError

    def close(self) -> None:
        """End the threads."""
        self._games.batch.close()

    def get_images(self) -> list[NDArray[np.uint8] | None]:
        """Draw every row's game."""
        pictures = [draw(self._games.batch.simulator, game) for game in range(self.num_games)]
        return [picture for picture in pictures for _ in range(self._rows)]


def make_games(
    kind: Callable[..., Games], wrapper: type, config: GameConfig | None, num_games: int, keywords: dict[str, Any]
) -> Games:
    """Return a batch of class `kind`; a wrapper's `keywords` are options of the batch, and rules."""
    parameters = inspect.signature(kind).parameters.values()
    names = [parameter.name for parameter in parameters if parameter.kind is parameter.KEYWORD_ONLY]
    options = {name: keywords.pop(name) for name in names if name in keywords}
    return kind(resolve(config, keywords, wrapper, names), num_games, **options)


class SwarmVecEnv(GamesVecEnv):
    """E games at once, with a learner in each; opponents act in one batch.

    Infos are empty until a game ends; then they hold ``terminal_observation``, ``TimeLimit.truncated`` and the numbers
    of the other wrappers. Wrap in SB3's `VecMonitor` for ``episode``.

    Parameters
    ----------
    num_envs : int
    seed : int, optional
    config, opponent, side, action, action_cells, threads, max_cycles, **rules
        As of `swarm_pz.envs.gymnasium_vector_env.DuelVectorEnv`.
    """

    def __init__(
        self, config: GameConfig | None = None, num_envs: int = 64, *, seed: int | None = None, **keywords: Any
    ) -> None:
        self.duel = make_games(DuelBatch, type(self), config, num_envs, keywords)
        super().__init__(self.duel, 1, self.duel.format.observation_space, self.duel.format.action_space)
        self.seed(seed)

    @property
    def opponent_names(self) -> list[str]:
        """Names of opponents, by the numbers in infos."""
        return self.duel.opponent_names

    @property
    def command_names(self) -> tuple[str, ...]:
        """Names of discrete actions; none for actions of other kinds."""
        return self.duel.format.command_names

    def deal(self, opponent: Opponents, names: Sequence[str] | None = None) -> None:
        """Give other opponents to the games that start from now on, as of `DuelBatch.deal`."""
        self.duel.deal(opponent, names)

    def _play(self, actions: NDArray[Any]) -> StepResult:
        return self.duel.step(actions)

    def _infos(self, result: StepResult | None, games: NDArray[np.int64]) -> list[dict[str, Any]]:
        return by_game(self.duel.infos(result, games))


class StackedVecEnv(BatchVecEnv):
    """One VecEnv over one or more batches of games, which may differ in rules but not in spaces."""

    def __init__(self, parts: Sequence[SwarmVecEnv]) -> None:
        self.parts = list(parts)
        bounds = np.cumsum([0, *(part.num_envs for part in self.parts)])
        self._rows = [slice(*pair) for pair in itertools.pairwise(bounds.tolist())]
        super().__init__(int(bounds[-1]), self.parts[0].observation_space, self.parts[0].action_space)

    @property
    def opponent_names(self) -> list[str]:
        """Names of opponents, by the numbers in infos; all parts are dealt the same."""
        return self.parts[0].opponent_names

    def deal(self, opponent: Sequence[Player], names: Sequence[str] | None = None) -> None:
        """Give other opponents to the games that start from now on; each part gets its own copies of the policies."""
        for part in self.parts:
            part.deal(copy.deepcopy(opponent), names)

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the games that `reset` starts next."""
        streams = np.random.SeedSequence(seed).spawn(len(self.parts))
        for part, stream in zip(self.parts, streams, strict=True):
            part.seed(int(stream.generate_state(1)[0]))
        return [seed] * self.num_envs

    def reset(self) -> VecEnvObs:
        """Start all games afresh."""
        observed = np.concatenate([part.reset() for part in self.parts])
        self.reset_infos = [info for part in self.parts for info in part.reset_infos]
        return observed

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Take the learners' actions."""
        for part, rows in zip(self.parts, self._rows, strict=True):
            part.step_async(actions[rows])

    def step_wait(self) -> VecEnvStepReturn:
        """Play the actions in every part."""
        observed, rewards, dones, infos = zip(*(part.step_wait() for part in self.parts), strict=True)
        return np.concatenate(observed), np.concatenate(rewards), np.concatenate(dones), list(itertools.chain(*infos))

    def close(self) -> None:
        """End the threads."""
        for part in self.parts:
            part.close()
