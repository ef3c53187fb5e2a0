"""What users of RLlib do."""

from __future__ import annotations

from typing import Any

from benchmarks.compatibility.rows import SMALL, row

FILTERS = [[16, 4, 2], [32, 4, 2]]
"""Channels, size and stride of each layer."""


@row(flatten_actions=True, observation_dtype="float32", channels_last=True)
def two_policies(**keywords: Any) -> None:
    """PPO, two policies, one a side, two iterations, on `ParallelPettingZooEnv`."""
    from ray.rllib.algorithms.ppo import PPOConfig
    from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig
    from ray.rllib.env.wrappers.pettingzoo_env import ParallelPettingZooEnv
    from ray.tune.registry import register_env

    from swarm_pz import parallel_env

    register_env("capture", lambda _: ParallelPettingZooEnv(parallel_env(**SMALL, **keywords)))
    config = (
        PPOConfig()
        .environment("capture")
        .env_runners(num_env_runners=0)
        .multi_agent(policies={"red", "blue"}, policy_mapping_fn=lambda agent, *_, **__: agent.removesuffix("_0"))
        .rl_module(model_config=DefaultModelConfig(conv_filters=FILTERS))
        .training(train_batch_size_per_learner=40, minibatch_size=20, num_epochs=1)
    )
    algorithm = config.build_algo()
    for _ in range(2):
        learnt = algorithm.train()["learners"]
    assert {"red", "blue"} <= set(learnt)
    algorithm.stop()


@row(flatten_actions=True, observation_dtype="float32", channels_last=True)
def one_learner(**keywords: Any) -> None:
    """PPO, one policy against `uniform`, two iterations, on `swarm_pz/Capture-v0`."""
    from ray.rllib.algorithms.ppo import PPOConfig
    from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig

    import swarm_pz

    config = (
        PPOConfig()
        .environment("swarm_pz/Capture-v0", env_config={**SMALL, **keywords})
        .env_runners(num_env_runners=0)
        .rl_module(model_config=DefaultModelConfig(conv_filters=FILTERS))
        .training(train_batch_size_per_learner=40, minibatch_size=20, num_epochs=1)
    )
    algorithm = config.build_algo()
    for _ in range(2):
        algorithm.train()
    algorithm.stop()


@row(action="discrete", observation_dtype="float32", channels_last=True)
def named_commands(**keywords: Any) -> None:
    """DQN against `uniform`, two iterations, on `swarm_pz/Capture-v0`."""
    from ray.rllib.algorithms.dqn import DQNConfig
    from ray.rllib.core.rl_module.default_model_config import DefaultModelConfig

    import swarm_pz

    config = (
        DQNConfig()
        .environment("swarm_pz/Capture-v0", env_config={**SMALL, **keywords})
        .env_runners(num_env_runners=0)
        .rl_module(model_config=DefaultModelConfig(conv_filters=FILTERS))
        .training(train_batch_size_per_learner=8, num_steps_sampled_before_learning_starts=8)
        .reporting(min_sample_timesteps_per_iteration=20)
    )
    algorithm = config.build_algo()
    for _ in range(2):
        algorithm.train()
    algorithm.stop()
