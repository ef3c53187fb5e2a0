"""PPO of TorchRL on `PettingZooWrapper`: both sides are one group, whose two agents share a network (self-play).

python examples/torchrl_selfplay.py --steps 131072

What matters: the collector. It samples actions and carries games on from one batch to the next; `rollout` of the
environments would, unless asked by `set_exploration_type`, send the actor's best action, from which nothing is learned.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
import torch
from tensordict.nn import NormalParamExtractor, TensorDictModule
from torch import nn
from torchrl.collectors import Collector
from torchrl.envs import MarlGroupMapType, PettingZooWrapper, SerialEnv
from torchrl.modules import ProbabilisticActor, TanhNormal
from torchrl.objectives import ClipPPOLoss, ValueEstimators

from swarm_pz import GameConfig, ObservationConfig, parallel_env
from swarm_pz.evaluation import play_match

GAME = GameConfig(drones_per_team=5, observation=ObservationConfig(grid=10))
FORMAT = {"action": "normalised", "action_cells": 5, "flatten_actions": True, "observation_dtype": "float32"}
NUM_ENVS, NUM_STEPS, EPOCHS, MINIBATCH = 8, 128, 4, 256
SEEN, DONE = ("agents", "observation"), ("agents", "action")


def make() -> PettingZooWrapper:
    """Return a game as TorchRL's environment, of one group named "agents"."""
    return PettingZooWrapper(parallel_env(GAME, **FORMAT), group_map=MarlGroupMapType.ALL_IN_ONE_GROUP)


def network(outputs: int) -> nn.Sequential:
    """Return a network for images (..., 9, 10, 10)."""
    made = nn.Sequential(nn.Flatten(-3), nn.Linear(900, 128), nn.Tanh(), nn.Linear(128, 128), nn.Tanh())
    made.append(nn.Linear(128, outputs))
    nn.init.orthogonal_(made[-1].weight, 0.01)  # begin close to uniform coverage
    nn.init.zeros_(made[-1].bias)
    return made


class Model:
    """The actor's best action; with its spaces and `predict` it is a model that matches play as it is."""

    def __init__(self, actor: nn.Module) -> None:
        env = parallel_env(GAME, **FORMAT)
        self.observation_space, self.action_space = env.observation_space("red_0"), env.action_space("red_0")
        self.actor = actor

    def predict(self, observation: np.ndarray, *, deterministic: bool = True) -> tuple[np.ndarray, None]:
        """Return actions (n, 25)."""
        with torch.no_grad():
            mean, _ = self.actor(torch.as_tensor(observation))
        return mean.tanh().numpy(), None


def train(steps: int, seed: int) -> tuple[nn.Module, int]:
    """Return the actor's network, and how many commands it has given, as red and as blue."""
    torch.manual_seed(seed)
    envs = SerialEnv(NUM_ENVS, make)
    envs.set_seed(seed)
    actor = nn.Sequential(network(2 * 25), NormalParamExtractor(scale_mapping="biased_softplus_0.5"))
    policy = ProbabilisticActor(
        TensorDictModule(actor, in_keys=[SEEN], out_keys=[("agents", "loc"), ("agents", "scale")]),
        spec=envs.full_action_spec_unbatched,
        in_keys=[("agents", "loc"), ("agents", "scale")],
        out_keys=[DONE],
        distribution_class=TanhNormal,
        return_log_prob=True,
    )
    critic = TensorDictModule(network(1), in_keys=[SEEN], out_keys=[("agents", "state_value")])
    loss = ClipPPOLoss(policy, critic, clip_epsilon=0.2, entropy_coeff=0.0, normalize_advantage=True)
    loss.set_keys(
        reward=("agents", "reward"),
        action=DONE,
        value=("agents", "state_value"),
        done=("agents", "done"),
        terminated=("agents", "terminated"),
        sample_log_prob=("agents", "action_log_prob"),
    )
    loss.make_value_estimator(ValueEstimators.GAE, gamma=0.98, lmbda=0.95)
    optimizer = torch.optim.Adam(loss.parameters(), 5e-4)
    frames = NUM_ENVS * NUM_STEPS
    updates = max(steps // (2 * frames), 1)  # a frame is a step of a game, of both sides
    collector = Collector(envs, policy, frames_per_batch=frames, total_frames=updates * frames)
    for update, batch in enumerate(collector):
        optimizer.param_groups[0]["lr"] = 5e-4 * (1 - update / updates)
        with torch.no_grad():
            loss.value_estimator(
                batch, params=loss.critic_network_params, target_params=loss.target_critic_network_params
            )
        flat = batch.reshape(-1)
        for _ in range(EPOCHS):
            for part in torch.randperm(len(flat)).split(MINIBATCH):
                losses = loss(flat[part])
                optimizer.zero_grad()
                (losses["loss_objective"] + losses["loss_critic"]).backward()
                nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
                optimizer.step()
    collector.shutdown()
    return actor, updates * 2 * frames


def main() -> None:
    """Train, save, and play matches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=131_072, help="commands to learn from, of both sides")
    parser.add_argument("--games", type=int, default=200, help="games against each opponent, even")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/torchrl_selfplay"))
    asked = parser.parse_args()

    torch.set_num_threads(1)  # the network is small
    actor, commands = train(asked.steps, asked.seed)
    asked.out.mkdir(parents=True, exist_ok=True)
    torch.save(actor.state_dict(), asked.out / "actor.pt")
    print(f"commands seen: {commands}")

    for opponent in ("noise", "uniform"):
        match = play_match(Model(actor), opponent, games=asked.games, seed=1, config=GAME, threads=2)
        match.write(asked.out / f"{opponent}.json")
        low, high = match.share_interval()
        print(f"against {opponent}: {match.standing()}, share {match.share():.2f} [{low:.2f}, {high:.2f}]")


if __name__ == "__main__":
    main()
