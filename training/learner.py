"""SB3's PPO, with a state that can be stored between two rollouts."""

from __future__ import annotations

from collections import deque
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecEnv

from swarm_pz.training.checkpoint import Arrays, Story, of, under


class Learner(PPO):
    """PPO that goes on after a stop as if there had been none: weights, optimizer and counters are stored."""

    @staticmethod
    def _wrap_env(env: Any, verbose: int = 0, monitor_wrapper: bool = True) -> VecEnv:  # noqa: ARG004
        """Leave the games as they are: SB3 would take the channels of an image for its columns if they are many."""
        assert isinstance(env, VecEnv)  # noqa: S101  (as `Training` makes it)
        return env

    def state(self) -> tuple[Story, Arrays]:
        """Return what decides the future, games and random streams apart; between two rollouts only."""
        story: Story = {
            "steps": self.num_timesteps,
            "updates": self._n_updates,
            "episodes": [{key: float(value) for key, value in info.items()} for info in self.ep_info_buffer or ()],
        }
        arrays = under("policy", {name: values.numpy() for name, values in self.policy.state_dict().items()})
        for number, held in self.policy.optimizer.state_dict()["state"].items():
            arrays |= under(f"optimizer.{number}", {name: values.numpy() for name, values in held.items()})
        return story, arrays

    def take_up(self, story: Story, arrays: Arrays) -> None:
        """Become what `state` told of; games follow by `see`."""
        held: dict[int, dict[str, torch.Tensor]] = {}
        for name, values in of("optimizer", arrays).items():
            number, entry = name.split(".")
            held.setdefault(int(number), {})[entry] = torch.from_numpy(values.copy())
        weights = {name: torch.from_numpy(values.copy()) for name, values in of("policy", arrays).items()}
        self.policy.load_state_dict(weights)
        groups = self.policy.optimizer.state_dict()["param_groups"]
        self.policy.optimizer.load_state_dict({"state": held, "param_groups": groups})
        self.num_timesteps = int(story["steps"])
        self._n_updates = int(story["updates"])
        self.ep_info_buffer = deque(story["episodes"], maxlen=self._stats_window_size)
        self.ep_success_buffer = deque(maxlen=self._stats_window_size)

    def see(self, observations: NDArray[Any], episode_starts: NDArray[np.bool_]) -> None:
        """Begin the next rollout in games that are under way, instead of starting all afresh."""
        self._last_obs = observations
        self._last_episode_starts = episode_starts
