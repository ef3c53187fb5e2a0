"""The environment for Stable-Baselines3: native VecEnvs over batches of duels."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs, VecEnvStepReturn

from swarm_pz.config import GameConfig, resolve
from swarm_pz.envs.batch_env import by_game
from swarm_pz.envs.opponents import DuelBatch, Opponents
from swarm_pz.policy import Player
from swarm_pz.rendering.painter import draw
from swarm_pz.simulator.spawn import check_seed
from swarm_pz.spaces.actions import ActionKind
from swarm_pz.spaces.observation import of_game


class BatchVecEnv(VecEnv):
    """A VecEnv over one batch: its games have neither attributes nor methods of their own."""

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of this object for each of the games."""
        return [getattr(self, attr_name) for _ in self._get_indices(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Refuse: games of a batch have no attributes of their own."""
        name = type(self).__name__
        raise AttributeError(f"games of a {name} share their attributes: set {attr_name!r} on the {name}")

    def env_method(self, method_name: str, *args: Any, indices: VecEnvIndices = None, **kwargs: Any) -> list[Any]:
        """Refuse: games of a batch have no methods of their own."""
        raise AttributeError(f"games of a {type(self).__name__} have no method {method_name!r} of their own")

    def env_is_wrapped(self, wrapper_class: Any, indices: VecEnvIndices = None) -> list[bool]:
        """Return False for each of the games: none is wrapped on its own."""
        return [False for _ in self._get_indices(indices)]


class SwarmVecEnv(BatchVecEnv):
    """E games at once, a learner in each, opponents answered in one batch.

    Infos are empty until a game ends; then they hold ``terminal_observation``, ``TimeLimit.truncated`` and the numbers
    of the other faces. Wrap in SB3's `VecMonitor` for ``episode``.

    Parameters
    ----------
    num_envs : int
    config, opponent, side, action, action_cells, max_cycles, **rules
        As of `swarm_pz.envs.gymnasium_env.DuelEnv`; `opponent` may be a sequence, dealt to the games in turn.
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
        action: ActionKind = "normalised",
        action_cells: int | None = None,
        threads: int = 1,
        seed: int | None = None,
        max_cycles: int | None = None,
        **rules: Any,
    ) -> None:
        # The base class asks for attributes while it initialises, so ours come first.
        self.duel = DuelBatch(
            resolve(config, rules, type(self)),
            num_envs,
            opponent=opponent,
            side=side,
            action=action,
            action_cells=action_cells,
            threads=threads,
            max_cycles=max_cycles,
        )
        self.render_mode = "rgb_array"
        self.num_envs = num_envs
        self.seed(seed)
        self._actions: NDArray[np.float32] = np.zeros(0, np.float32)
        super().__init__(num_envs, self.duel.format.observation_space, self.duel.format.action_space)

    @property
    def opponent_names(self) -> list[str]:
        """Names of opponents, by the numbers in infos."""
        return self.duel.opponent_names

    @property
    def command_names(self) -> tuple[str, ...]:
        """Names of discrete actions; none for actions of other kinds."""
        return self.duel.format.command_names

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the games that `reset` starts next; each has a stream of its own."""
        stream = np.random.SeedSequence() if seed is None else check_seed(seed)
        self._streams = stream.spawn(self.num_envs)
        return [seed] * self.num_envs

    def deal(self, opponent: Opponents, names: Sequence[str] | None = None) -> None:
        """Give other opponents to the games that start from now on, as of `DuelBatch.deal`."""
        self.duel.deal(opponent, names)

    def _restart(self, rows: NDArray[np.int64]) -> None:
        """Start some games afresh, each with the next seed of its stream."""
        self.duel.reset([self._streams[row].spawn(1)[0] for row in rows], rows)

    def reset(self) -> VecEnvObs:
        """Start all games afresh."""
        self._restart(np.arange(self.num_envs))
        self.reset_infos = by_game(self.duel.infos())
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
            last, numbers = duel.observe(ended), by_game(duel.infos(result, ended))
            for place, row in enumerate(ended.tolist()):
                infos[row] = numbers[place] | {
                    "terminal_observation": of_game(last, place),
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


class StackedVecEnv(BatchVecEnv):
    """Batches of games of different rules, seen and answered as one.

    Parameters
    ----------
    parts : sequence of SwarmVecEnv
        At least one, all with the same spaces.
    """

    def __init__(self, parts: Sequence[SwarmVecEnv]) -> None:
        self.parts = list(parts)
        self.render_mode = "rgb_array"
        bounds = np.cumsum([0, *(part.num_envs for part in self.parts)])
        self._rows = [slice(*pair) for pair in itertools.pairwise(bounds.tolist())]
        super().__init__(int(bounds[-1]), self.parts[0].observation_space, self.parts[0].action_space)

    @property
    def opponent_names(self) -> list[str]:
        """Names of opponents, by the numbers in infos; all parts are dealt the same."""
        return self.parts[0].opponent_names

    def deal(self, opponent: Sequence[Player], names: Sequence[str] | None = None) -> None:
        """Give other opponents to the games that start from now on; each part gets policies of its own."""
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
        seen = np.concatenate([part.reset() for part in self.parts])
        self.reset_infos = [info for part in self.parts for info in part.reset_infos]
        return seen

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Take the learners' actions."""
        for part, rows in zip(self.parts, self._rows, strict=True):
            part.step_async(actions[rows])

    def step_wait(self) -> VecEnvStepReturn:
        """Play the actions in every part."""
        seen, rewards, dones, infos = zip(*(part.step_wait() for part in self.parts), strict=True)
        return np.concatenate(seen), np.concatenate(rewards), np.concatenate(dones), list(itertools.chain(*infos))

    def close(self) -> None:
        """End the threads."""
        for part in self.parts:
            part.close()

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of each game's part."""
        every = [getattr(part, attr_name) for part in self.parts for _ in range(part.num_envs)]
        return [every[index] for index in self._get_indices(indices)]
