from __future__ import annotations

import itertools

import numpy as np
from stable_baselines3.common.callbacks import BaseCallback

from swarm_pz.training.ppo import Training
from tests.training.test_ppo import TINY, quiet


class Weights(BaseCallback):
    """Keeps the weights of the actor and of the critic as each rollout begins."""

    def __init__(self):
        super().__init__()
        self.steps, self.actor, self.critic = [], [], []

    def _on_rollout_start(self):
        policy = self.model.policy
        self.steps.append(self.num_timesteps)
        for seen, network in ((self.actor, policy.actor), (self.critic, policy.mlp_extractor.critic)):
            seen.append(np.concatenate([values.detach().numpy().ravel() for values in network.parameters()]))

    def _on_step(self):
        return True


def moves(seen):
    return [not np.array_equal(before, after) for before, after in itertools.pairwise(seen)]


def test_while_the_critic_learns_first_the_actor_is_held_and_then_it_learns_too(tmp_path):
    run = Training(TINY.replace(critic_steps=64, total_steps=160), tmp_path, say=quiet)
    weights = Weights()
    run.learn(160, weights)
    assert weights.steps == [0, 32, 64, 96, 128]
    assert moves(weights.actor) == [False, False, True, True]
    assert moves(weights.critic) == [True] * 4
