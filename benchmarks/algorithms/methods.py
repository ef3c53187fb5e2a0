"""What is compared: how each method learns, what it sees, and how what it has learned is written down."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from sb3_contrib import RecurrentPPO
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.policies import ActorCriticPolicy

from benchmarks.algorithms.networks import DroneSets, WholeSequences
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.training.config import RECIPES
from swarm_pz.training.networks import GridPolicy
from swarm_pz.training.vec_env import SwarmVecEnv

RECIPE = RECIPES["quick"].replace(threads=1)
"""The recipe of `swarm-pz train`."""
REPLAY = 50_000
"""Commands that DQN remembers."""


@dataclass(frozen=True, kw_only=True)
class Method:
    """A method that is compared: what sets it apart, what makes it of games and seed, what it sees and how it answers.

    `actions` are options of `SwarmVecEnv`; one that meets itself has its own past as opponents instead of scripts.
    """

    about: str
    learner: Callable[[SwarmVecEnv, int], BaseAlgorithm]
    observation: ObservationConfig = RECIPE.game.observations[0]
    actions: Mapping[str, Any] = field(default_factory=lambda: {"action_cells": RECIPE.action_cells})
    meets_itself: bool = False

    @property
    def game(self) -> GameConfig:
        """The rules, and what the method sees."""
        return RECIPE.game.replace(observation=self.observation)

    def games(self, seed: int) -> SwarmVecEnv:
        """Return the games that it learns from; opponents are as of the recipe."""
        return SwarmVecEnv(self.game, RECIPE.num_envs, opponent=RECIPE.opponents, threads=1, seed=seed, **self.actions)


def _ppo(
    kind: type[OnPolicyAlgorithm], policy: str | type[ActorCriticPolicy], games: SwarmVecEnv, seed: int, **network: Any
) -> OnPolicyAlgorithm:
    def rate(left: float) -> float:
        return RECIPE.learning_rate * max(left, 0.05)

    model = kind(
        policy,
        games,
        n_steps=RECIPE.rollout,
        batch_size=RECIPE.batch_size,
        n_epochs=RECIPE.epochs,
        learning_rate=rate,
        gamma=RECIPE.gamma,
        gae_lambda=RECIPE.gae_lambda,
        clip_range=RECIPE.clip_range,
        ent_coef=RECIPE.entropy,
        seed=seed,
        device="cpu",
        policy_kwargs={"log_std_init": RECIPE.log_std, **network},
    )
    model.policy.log_std.requires_grad_(False)  # type: ignore[operator, union-attr]
    return model


def _dqn(games: SwarmVecEnv, seed: int) -> DQN:
    return DQN(
        "MlpPolicy",
        games,
        learning_rate=RECIPE.learning_rate,
        buffer_size=REPLAY,
        learning_starts=1_024,
        batch_size=RECIPE.batch_size,
        gamma=RECIPE.gamma,
        train_freq=1,
        gradient_steps=5,  # of as many games as RECIPE.num_envs: each command is learned from 16 times
        target_update_interval=2_000,
        exploration_fraction=0.3,
        seed=seed,
        device="cpu",
    )


# Slowest first, so that in the end nobody works alone.
METHODS: dict[str, Method] = {
    "ppo-selfplay": Method(
        about="as `ppo`, but its opponents are its own past versions, which explore as it does",
        learner=functools.partial(_ppo, PPO, GridPolicy, width=RECIPE.width),
        meets_itself=True,
    ),
    "ppo": Method(
        about="PPO with the recipe's network, which respects the square's symmetries",
        learner=functools.partial(_ppo, PPO, GridPolicy, width=RECIPE.width),
    ),
    "dqn": Method(
        about="DQN with two layers of 64; answers one of the 57 named commands",
        learner=_dqn,
        actions={"action": "discrete"},
    ),
    "ppo-sets": Method(
        about='PPO with deep sets over the lists of drones (`ObservationConfig(kind="entities")`)',
        learner=functools.partial(_ppo, PPO, "MultiInputPolicy", features_extractor_class=DroneSets),
        observation=ObservationConfig(kind="entities"),
    ),
    "recurrent-ppo": Method(
        about="RecurrentPPO of sb3-contrib: an LSTM of 64 before the two layers of `ppo-mlp`",
        learner=functools.partial(
            _ppo, RecurrentPPO, WholeSequences, lstm_hidden_size=64, shared_lstm=True, enable_critic_lstm=False
        ),
    ),
    "ppo-mlp": Method(
        about="PPO with two layers of 64, the default of Stable-Baselines3",
        learner=functools.partial(_ppo, PPO, "MlpPolicy"),
    ),
}
