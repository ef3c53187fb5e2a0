"""RLlib, new API stack: PPO with two policies, one a side, that learn against each other (self-play).

python examples/rllib_selfplay.py --steps 40960
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch
from ray.rllib.algorithms.ppo import PPOConfig
from ray.rllib.core.columns import Columns
from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
from ray.tune.registry import register_env

from swarm_pz import GameConfig, ObservationConfig, parallel_env
from swarm_pz.evaluation import play_match

GAME = GameConfig(drones_per_team=5, observation=ObservationConfig(grid=10))
FORMAT = {
    "action": "normalised",
    "action_cells": 5,
    "flatten_actions": True,
    "observation_dtype": "float32",
    "channels_last": True,
}


class Model:
    """A policy's best action; with its spaces and `predict` it is a model that matches play as it is."""

    def __init__(self, module: torch.nn.Module) -> None:
        env = parallel_env(GAME, **FORMAT)
        self.observation_space, self.action_space = env.observation_space("red_0"), env.action_space("red_0")
        self.module = module

    def predict(self, observation: np.ndarray, *, deterministic: bool = True) -> tuple[np.ndarray, None]:
        """Return actions (n, 25)."""
        with torch.no_grad():
            answer = self.module.forward_inference({Columns.OBS: torch.as_tensor(observation)})
        mean, _ = answer[Columns.ACTION_DIST_INPUTS].chunk(2, dim=1)
        return mean.clamp(-1, 1).numpy(), None


def main() -> None:
    """Train, save, and play matches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=40_960, help="commands to learn from, of both sides")
    parser.add_argument("--games", type=int, default=200, help="games against each opponent, even")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/rllib_selfplay"))
    asked = parser.parse_args()

    register_env("capture", lambda _: ParallelPettingZooEnv(parallel_env(GAME, **FORMAT)))
    config = (
        PPOConfig()
        .environment("capture")
        .env_runners(num_env_runners=0, num_envs_per_env_runner=8)
        .multi_agent(policies={"red", "blue"}, policy_mapping_fn=lambda agent, *_, **__: agent.removesuffix("_0"))
        .rl_module(model_config=DefaultModelConfig(conv_filters=[[16, 4, 2], [32, 4, 2]]))
        .training(
            train_batch_size_per_learner=2048,
            minibatch_size=256,
            num_epochs=4,
            lr=5e-4,
            gamma=0.98,
            lambda_=0.95,
            clip_param=0.2,
            grad_clip=0.5,
        )
        .debugging(seed=asked.seed)
    )
    algorithm = config.build_algo()
    commands = 0
    while commands < asked.steps:
        algorithm.train()
        commands = 2 * algorithm.metrics.peek(("env_runners", "num_env_steps_sampled_lifetime"))
    algorithm.save_to_path(str((asked.out / "checkpoint").resolve()))
    print(f"commands seen: {int(commands)}")

    model = Model(algorithm.get_module("red"))
    for opponent in ("noise", "uniform"):
        match = play_match(model, opponent, games=asked.games, seed=1, config=GAME, threads=2)
        match.write(asked.out / f"{opponent}.json")
        low, high = match.share_interval()
        print(f"against {opponent}: {match.standing()}, share {match.share():.2f} [{low:.2f}, {high:.2f}]")
    algorithm.stop()


if __name__ == "__main__":
    main()
