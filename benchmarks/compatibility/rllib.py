"""What users of RLlib do."""

from __future__ import annotations

from typing import Any

import swarm_pz
from benchmarks.compatibility.rows import SMALL, row

IMAGES = {"observation_dtype": "float32", "channels_last": True}
PPO = {"train_batch_size_per_learner": 40, "minibatch_size": 20, "num_epochs": 1}


def train(config: Any, **training: Any) -> dict[str, Any]:
    """Train for two iterations; return what the learners say."""
    from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig

    filters = [[16, 4, 2], [32, 4, 2]]  # channels, size and stride of each layer
    config = config.env_runners(num_env_runners=0).training(**training)
    algorithm = config.rl_module(model_config=DefaultModelConfig(conv_filters=filters)).build_algo()
    for _ in range(2):
        learnt = algorithm.train()["learners"]
    algorithm.stop()
    return dict(learnt)


@row("PPO, two policies, one a side, two iterations, on `ParallelPettingZooEnv`", flatten_actions=True, **IMAGES)
def two_policies(**keywords: Any) -> None:
    from ray.rllib.algorithms.ppo import PPOConfig
    from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
    from ray.tune.registry import register_env

    register_env("capture", lambda _: ParallelPettingZooEnv(swarm_pz.parallel_env(**SMALL, **keywords)))
    sides = {"policies": {"red", "blue"}, "policy_mapping_fn": lambda agent, *_, **__: agent.removesuffix("_0")}
    assert {"red", "blue"} <= set(train(PPOConfig().environment("capture").multi_agent(**sides), **PPO))


@row("PPO, one policy against `uniform`, two iterations, on `swarm_pz/Capture-v0`", flatten_actions=True, **IMAGES)
def one_learner(**keywords: Any) -> None:
    from ray.rllib.algorithms.ppo import PPOConfig

    train(PPOConfig().environment("swarm_pz/Capture-v0", env_config={**SMALL, **keywords}), **PPO)


@row("DQN against `uniform`, two iterations, on `swarm_pz/Capture-v0`", action="discrete", **IMAGES)
def named_commands(**keywords: Any) -> None:
    from ray.rllib.algorithms.dqn import DQNConfig

    config = DQNConfig().environment("swarm_pz/Capture-v0", env_config={**SMALL, **keywords})
    config = config.reporting(min_sample_timesteps_per_iteration=20)
    train(config, train_batch_size_per_learner=8, num_steps_sampled_before_learning_starts=8)
