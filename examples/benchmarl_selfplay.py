"""IPPO of BenchMARL: each side is a group with a network of its own, and they learn against each other (self-play).

python examples/benchmarl_selfplay.py --steps 131072
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
import torch
from benchmarl.algorithms import IppoConfig
from benchmarl.environments.pettingzoo.common import PettingZooClass
from benchmarl.experiment import Experiment, ExperimentConfig
from benchmarl.models.mlp import MlpConfig
from tensordict import TensorDict
from torchrl.envs import EnvBase, ExplorationType, PettingZooWrapper, set_exploration_type

from swarm_pz import GameConfig, ObservationConfig, parallel_env
from swarm_pz.evaluation import play_match

GAME = GameConfig(drones_per_team=5, observation=ObservationConfig(grid=10))
FORMAT = {"action": "normalised", "action_cells": 5, "flatten_actions": True, "observation_dtype": "float32"}
GROUPS = {"red": ["red_0"], "blue": ["blue_0"]}
BATCH = 1024


class Capture(PettingZooClass):
    """BenchMARL's task of PettingZoo, which knows only games that come with PettingZoo, for this one."""

    def get_env_fun(
        self, num_envs: int, continuous_actions: bool, seed: int | None, device: str
    ) -> Callable[[], EnvBase]:
        """Return what makes a game, each with a seed of its own."""
        seeds = count(seed or 0)
        return lambda: PettingZooWrapper(
            parallel_env(GAME, **FORMAT, **self.config), group_map=GROUPS, seed=next(seeds), device=device
        )

    def supports_continuous_actions(self) -> bool:
        """Commands are boxes."""
        return True


class Model:
    """A side's best action; with its spaces and `predict` it is a model that matches play as it is."""

    def __init__(self, policy: torch.nn.Module, side: str) -> None:
        env = parallel_env(GAME, **FORMAT)
        self.observation_space, self.action_space = env.observation_space("red_0"), env.action_space("red_0")
        self.policy, self.side = policy, side

    def predict(self, observation: np.ndarray, *, deterministic: bool = True) -> tuple[np.ndarray, None]:
        """Return actions (n, 25)."""
        seen = torch.as_tensor(observation)[:, None]  # a group of one
        with torch.no_grad(), set_exploration_type(ExplorationType.DETERMINISTIC):
            answer = self.policy(TensorDict({self.side: {"observation": seen}}, len(seen)))
        return answer[self.side, "action"][:, 0].numpy(), None


def main() -> None:
    """Train, save, and play matches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=131_072, help="commands to learn from, of both sides")
    parser.add_argument("--games", type=int, default=200, help="games against each opponent, even")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/benchmarl_selfplay"))
    asked = parser.parse_args()

    torch.set_num_threads(1)  # the networks are small
    asked.out.mkdir(parents=True, exist_ok=True)
    experiment = Experiment(
        task=Capture("capture", {"max_cycles": 300}),
        algorithm_config=replace(IppoConfig.get_from_yaml(), lmbda=0.95, scale_mapping="biased_softplus_0.5"),
        model_config=replace(MlpConfig.get_from_yaml(), num_cells=[128, 128], num_feature_dims=3),  # images
        seed=asked.seed,
        config=replace(
            ExperimentConfig.get_from_yaml(),
            gamma=0.98,
            lr=5e-4,
            clip_grad_val=0.5,
            max_n_iters=max(asked.steps // (2 * BATCH), 1),
            max_n_frames=None,
            on_policy_collected_frames_per_batch=BATCH,
            on_policy_n_envs_per_worker=8,
            on_policy_n_minibatch_iters=4,
            on_policy_minibatch_size=256,
            evaluation=False,
            loggers=[],
            create_json=False,
            save_folder=str(asked.out),
            checkpoint_at_end=True,
        ),
    )
    experiment.run()
    print(f"commands seen: {2 * experiment.total_frames}")

    model = Model(experiment.group_policies["red"], "red")
    for opponent in ("noise", "uniform"):
        match = play_match(model, opponent, games=asked.games, seed=1, config=GAME, threads=2)
        match.write(asked.out / f"{opponent}.json")
        low, high = match.share_interval()
        print(f"against {opponent}: {match.standing()}, share {match.share():.2f} [{low:.2f}, {high:.2f}]")


if __name__ == "__main__":
    main()
