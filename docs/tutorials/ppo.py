"""PPO in one file, on the Gymnasium vector env: a tactic from scratch, against one opponent.

python docs/tutorials/ppo.py --opponent uniform --steps 400000
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from pathlib import Path

import gymnasium
import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.distributions import Normal

import swarm_pz
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.evaluation import play_match
from swarm_pz.simulator import Seed
from swarm_pz.spaces import command_from_action

GRID, CELLS, CHANNELS = 10, 5, len(swarm_pz.config.CHANNELS)
GAMMA, LAMBDA, CLIP, EPOCHS, MINIBATCHES = 0.98, 0.95, 0.2, 4, 8
FIRST_LOG_STD, LAST_LOG_STD = -0.7, -2.0


class Agent(nn.Module):
    """An actor that maps an image to an image, and a critic.

    Observations are (n, C, 10, 10), log-densities (n, 5, 5): each 2 x 2 cells become one.
    """

    def __init__(self) -> None:
        super().__init__()
        self.actor = nn.Sequential(
            nn.Conv2d(CHANNELS, 32, 3, padding=1), nn.ReLU(),
            nn.Conv2d(32, 32, 2, stride=2), nn.ReLU(),
            nn.Conv2d(32, 32, 3, padding=1), nn.ReLU(),
            nn.Conv2d(32, 1, 3, padding=1),
        )  # fmt: skip
        self.critic = nn.Sequential(
            nn.Conv2d(CHANNELS, 16, 2, stride=2),
            nn.ReLU(),
            nn.Flatten(),
            nn.LazyLinear(64),
            nn.Tanh(),
            nn.Linear(64, 1),
        )
        self.log_std = FIRST_LOG_STD
        self.critic(torch.zeros(1, CHANNELS, GRID, GRID))  # gives the lazy layer its size
        nn.init.orthogonal_(self.actor[-1].weight, gain=0.01)  # begin close to uniform coverage

    def value(self, seen: Tensor) -> Tensor:
        """Return the critic's values (n,)."""
        values: Tensor = self.critic(seen.float() / 255)
        return values[:, 0]

    def policy(self, seen: Tensor) -> Normal:
        """Return the distribution of log-densities, with mean (n, 25)."""
        mean = self.actor(seen.float() / 255).flatten(1)
        return Normal(mean, np.exp(self.log_std))


class Learned:
    """A policy that plays the agent's mean action, in matches or against other learners."""

    name = "ppo.py"
    observation = ObservationConfig(grid=GRID)

    def __init__(self, agent: Agent) -> None:
        self.agent = agent

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games; there is nothing to remember."""

    def act(self, observations: NDArray[np.uint8], rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return densities (n, 10, 10) for observations (n, C, 10, 10)."""
        with torch.no_grad():
            actions = self.agent.policy(torch.as_tensor(observations)).mean.clamp(-1, 1)
        return command_from_action(actions.double().numpy().reshape(-1, CELLS, CELLS), GRID, is_log=True)


def advantages(rewards: Tensor, values: Tensor, after: Tensor, ended: Tensor, over: Tensor) -> Tensor:
    """Return generalised advantage estimates; all arguments are (steps, games).

    `after` has the value of the observation after each step, `over` is true where the game ended, `ended`
    where it ended with a loser. A time-out is bootstrapped with `after`.
    """
    estimates, running = torch.zeros_like(rewards), torch.zeros_like(rewards[0])
    for t in reversed(range(len(rewards))):
        error = rewards[t] + GAMMA * after[t] * ~ended[t] - values[t]
        running = error + GAMMA * LAMBDA * running * ~over[t]
        estimates[t] = running
    return estimates


def update(agent: Agent, optimizer: torch.optim.Optimizer, batch: dict[str, Tensor]) -> float:
    """Improve the agent by the clipped objective; return the mean loss of the critic."""
    losses = []
    for _ in range(EPOCHS):
        for part in torch.randperm(len(batch["seen"])).chunk(MINIBATCHES):
            seen, estimates = batch["seen"][part], batch["advantages"][part]
            ratio = (agent.policy(seen).log_prob(batch["actions"][part]).sum(1) - batch["log_probs"][part]).exp()
            estimates = (estimates - estimates.mean()) / (estimates.std() + 1e-8)
            gain = torch.min(ratio * estimates, ratio.clamp(1 - CLIP, 1 + CLIP) * estimates).mean()
            error = ((agent.value(seen) - batch["returns"][part]) ** 2).mean()
            optimizer.zero_grad()
            (0.5 * error - gain).backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            optimizer.step()
            losses.append(error.item())
    return float(np.mean(losses))


def train(opponent: str, steps: int, games: int, rollout: int, seed: int, threads: int) -> Agent:
    """Train an agent against one opponent for about `steps` commands, and print its progress."""
    torch.manual_seed(seed)
    config = GameConfig(observation=ObservationConfig(grid=GRID))
    envs = gymnasium.make_vec(
        "swarm_pz/Capture-v0", num_envs=games, config=config, opponent=opponent, action_cells=CELLS, threads=threads
    )
    agent = Agent()
    optimizer = torch.optim.Adam(agent.parameters(), lr=5e-4, eps=1e-5)
    seen, over, shares, began = torch.as_tensor(envs.reset(seed=seed)[0]), torch.zeros(games, dtype=torch.bool), [], 0.0
    updates = -(-steps // (games * rollout))
    for number in range(1, updates + 1):
        began = began or time.monotonic()
        done = (number - 1) / updates
        optimizer.param_groups[0]["lr"] = 5e-4 * max(1 - done, 0.05)
        # At the end the policy plays its mean action, which it learns best when exploration fades.
        agent.log_std = FIRST_LOG_STD + done * (LAST_LOG_STD - FIRST_LOG_STD)
        kept: dict[str, list[Tensor]] = {name: [] for name in ("seen", "actions", "log_probs", "values", "after")}
        told: dict[str, list[Tensor]] = {name: [] for name in ("rewards", "ended", "over", "counts")}
        for _ in range(rollout):
            with torch.no_grad():
                policy, value = agent.policy(seen), agent.value(seen)
                action = policy.sample()
            images = action.clamp(-1, 1).numpy().reshape(games, CELLS, CELLS)
            following, rewards, terminated, truncated, infos = envs.step(images)
            # A game that was over restarts in this step, which took no command and does not count.
            told["counts"].append(~over)
            over = torch.as_tensor(terminated | truncated)
            told["rewards"].append(torch.as_tensor(rewards, dtype=torch.float32))
            told["ended"].append(torch.as_tensor(terminated))
            told["over"].append(over)
            following = torch.as_tensor(following)
            with torch.no_grad():
                kept["after"].append(agent.value(following))
            for name, value_of in (("seen", seen), ("actions", action), ("values", value)):
                kept[name].append(value_of)
            kept["log_probs"].append(policy.log_prob(action).sum(1))
            shares += infos["share"][over.numpy()].tolist() if over.any() else []
            seen = following
        tensors = {name: torch.stack(values) for name, values in (kept | told).items()}
        estimates = advantages(
            tensors["rewards"], tensors["values"], tensors["after"], tensors["ended"], tensors["over"]
        )
        counts = tensors["counts"]
        batch = {name: tensors[name][counts] for name in ("seen", "actions", "log_probs")}
        batch |= {"advantages": estimates[counts], "returns": (estimates + tensors["values"])[counts]}
        loss = update(agent, optimizer, batch)
        speed = number * games * rollout / (time.monotonic() - began)
        share = f"{np.mean(shares[-100:]):.2f}" if shares else "-"
        print(
            f"{number * games * rollout:>9,} steps  share {share}  critic {loss:.4f}  {speed:,.0f} a second", flush=True
        )
    envs.close()
    return agent


def main() -> None:
    """Train, evaluate against the opponent, and save the weights."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--opponent", default="uniform")
    parser.add_argument("--steps", type=int, default=400_000)
    parser.add_argument("--games", type=int, default=64, help="games side by side")
    parser.add_argument("--rollout", type=int, default=64, help="commands of each between two updates")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--evaluation-games", type=int, default=40)
    parser.add_argument("--out", type=Path, default=Path("runs/ppo.pt"))
    options = parser.parse_args()
    agent = train(options.opponent, options.steps, options.games, options.rollout, options.seed, options.threads)
    options.out.parent.mkdir(parents=True, exist_ok=True)
    torch.save(agent.state_dict(), options.out)
    figures = play_match(Learned(agent), options.opponent, games=options.evaluation_games, seed=1).summary()
    print(
        f"against {options.opponent}: {figures['wins']} won, {figures['draws']} drawn, {figures['losses']} lost; "
        f"weights in {options.out}"
    )


if __name__ == "__main__":
    main()
