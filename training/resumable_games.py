"""Unfinished games of a run: stored as seeds and actions, and restored by playing them again.

Seeds and commands decide a game, the opponent's memory and random stream included, whatever kind of policy that is.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnvWrapper
from stable_baselines3.common.vec_env.base_vec_env import VecEnvObs, VecEnvStepReturn

from swarm_pz.config import GameConfig
from swarm_pz.policy import Player
from swarm_pz.training.checkpoint import Arrays, Story
from swarm_pz.training.vec_env import StackedVecEnv, SwarmVecEnv


class Opponent(NamedTuple):
    """What an opponent is loaded by: its name, and the noise on its actions."""

    name: str
    noise: float


class ResumableGames(VecEnvWrapper):
    """Games that can be stored before they end; `opponents` are the names that `venv` was made with."""

    venv: SwarmVecEnv | StackedVecEnv

    def __init__(self, venv: SwarmVecEnv | StackedVecEnv, opponents: Sequence[str]) -> None:
        super().__init__(venv)
        self._batches = venv.parts if isinstance(venv, StackedVecEnv) else [venv]
        bounds = np.cumsum([0, *(batch.num_envs for batch in self._batches)]).tolist()
        self._rows = [slice(*pair) for pair in itertools.pairwise(bounds)]
        self._dealt = [Opponent(name, 0.0) for name in opponents]
        self._playing = self._next_opponents()
        self._seed: int | None = None
        self._begun = np.zeros(self.num_envs, np.int64)
        """(E,) games that each row has begun since it was seeded."""
        self.ages = np.zeros(self.num_envs, np.int64)
        """(E,) steps that each unfinished game has had."""
        self._actions: list[NDArray[np.float32]] = []
        """(E, a, a) each, of the latest steps, as many as the oldest unfinished game has."""

    def _next_opponents(self) -> list[Opponent]:
        """Return who plays in each row from its next start on: opponents are dealt in turn, batch by batch."""
        rows = itertools.chain.from_iterable(range(batch.num_envs) for batch in self._batches)
        return [self._dealt[row % len(self._dealt)] for row in rows]

    def deal(self, opponents: Sequence[Player], names: Sequence[str]) -> None:
        """Give other opponents to the games that start from now on."""
        self.venv.deal(opponents, names)
        self._dealt = [
            Opponent(name, float(getattr(player, "noise", 0.0))) for name, player in zip(names, opponents, strict=True)
        ]

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """Seed the games that `reset` starts next."""
        self._seed = seed
        self._begun[:] = 0
        return self.venv.seed(seed)

    def reset(self) -> VecEnvObs:
        """Start all games afresh."""
        observations = self.venv.reset()
        self._begin(np.ones(self.num_envs, np.bool_))
        return observations

    def _begin(self, started: NDArray[np.bool_]) -> None:
        self._begun[started] += 1
        self.ages[started] = 0
        following = self._next_opponents()
        for row in np.flatnonzero(started).tolist():
            self._playing[row] = following[row]

    def step_async(self, actions: NDArray[np.float32]) -> None:
        """Take the learners' actions."""
        self._actions.append(np.array(actions, np.float32))
        self.venv.step_async(actions)

    def step_wait(self) -> VecEnvStepReturn:
        """Play the actions; games that end start afresh at once."""
        observations, rewards, dones, infos = self.venv.step_wait()
        self.ages += 1
        if dones.any():
            self._begin(dones)
        del self._actions[: len(self._actions) - int(self.ages.max())]
        return observations, rewards, dones, infos

    # --- store and restore ----------------------------------------------------------------------

    def state(self) -> tuple[Story, Arrays]:
        """Return what `restore` needs."""
        opponents = list(dict.fromkeys([*self._dealt, *self._playing]))
        story: Story = {
            "seed": self._seed,
            "opponents": opponents,
            "dealt": [opponents.index(one) for one in self._dealt],
            "digest": self._digest(),
        }
        arrays: Arrays = {
            "begun": self._begun.copy(),
            "ages": self.ages.copy(),
            "playing": np.array([opponents.index(one) for one in self._playing], np.int64),
            "actions": np.array(self._actions, np.float32).reshape(-1, self.num_envs, *(self.action_space.shape or ())),
        }
        return story, arrays

    def restore(
        self, story: Story, arrays: Arrays, load: Callable[[Opponent, GameConfig], Player]
    ) -> tuple[NDArray[Any], bool]:
        """Play stored games up to where they were; return what the learners see, and whether all are the same bits."""
        self.seed(story["seed"])
        opponents = [Opponent(name, noise) for name, noise in story["opponents"]]
        self._dealt = [opponents[place] for place in story["dealt"]]
        self._playing = [opponents[place] for place in arrays["playing"].tolist()]
        self._begun, self.ages = arrays["begun"].copy(), arrays["ages"].copy()
        self._actions = list(arrays["actions"])
        for batch, rows in zip(self._batches, self._rows, strict=True):
            players = {one: load(one, batch.duel.config) for one in opponents}
            for dealt in (opponents, self._playing[rows]):  # first all, so that each batch numbers them alike
                batch.deal([players[one] for one in dealt], [one.name for one in dealt])
            self._replay(batch, rows)
            batch.deal([players[one] for one in self._dealt], [one.name for one in self._dealt])
        ended = np.concatenate([~batch.duel.batch.running for batch in self._batches])
        if ended.any():  # games that came out differently, and sooner
            for batch, rows in zip(self._batches, self._rows, strict=True):
                batch.restart(np.flatnonzero(ended[rows]))
            self._begin(ended)
        observations = np.concatenate([batch.duel.observe() for batch in self._batches])
        return observations, self._digest() == story["digest"]

    def _replay(self, batch: SwarmVecEnv, rows: slice) -> None:
        """Play the unfinished games of one batch again; the oldest begins first."""
        ages = self.ages[rows]
        batch.skip(self._begun[rows] - 1)
        for left, actions in zip(range(len(self._actions), 0, -1), self._actions, strict=True):
            batch.restart(np.flatnonzero(ages == left))
            if batch.duel.batch.running.any():
                batch.duel.step(actions[rows])
        batch.restart(np.flatnonzero(ages == 0))

    def _digest(self) -> str:
        """Return a hash of the games as they stand."""
        content = hashlib.sha256()
        for batch in self._batches:
            for array in (*batch.duel.batch.simulator.games, batch.duel.sides):
                content.update(np.ascontiguousarray(array).tobytes())
        return content.hexdigest()
