"""PPO in one file, in the style of CleanRL, on `gymnasium.make_vec`.

python examples/cleanrl_ppo.py --steps 393216
"""

from __future__ import annotations

import argparse
from pathlib import Path

import gymnasium
import numpy as np
import torch
from gymnasium.vector import AutoresetMode
from torch import nn
from torch.distributions import Normal

from swarm_pz import GameConfig, ObservationConfig
from swarm_pz.evaluation import play_match

GAME = GameConfig(drones_per_team=5, observation=ObservationConfig(grid=10))
NUM_ENVS, NUM_STEPS, EPOCHS, MINIBATCHES = 64, 64, 4, 4
GAMMA, GAE_LAMBDA, CLIP, LEARNING_RATE = 0.98, 0.95, 0.2, 5e-4


def layer(inputs: int, outputs: int, gain: float = np.sqrt(2)) -> nn.Linear:
    """Return a layer with orthogonal weights."""
    made = nn.Linear(inputs, outputs)
    nn.init.orthogonal_(made.weight, gain)
    nn.init.zeros_(made.bias)
    return made


class Agent(nn.Module):
    """Actor and critic; its spaces and `predict` make it a model that matches can play."""

    def __init__(self, envs: gymnasium.vector.VectorEnv) -> None:
        super().__init__()
        self.observation_space, self.action_space = envs.single_observation_space, envs.single_action_space
        inputs, outputs = int(np.prod(self.observation_space.shape)), int(np.prod(self.action_space.shape))
        self.critic = nn.Sequential(layer(inputs, 128), nn.Tanh(), layer(128, 128), nn.Tanh(), layer(128, 1, gain=1.0))
        self.actor = nn.Sequential(
            layer(inputs, 128), nn.Tanh(), layer(128, 128), nn.Tanh(), layer(128, outputs, gain=0.01)
        )
        self.log_std = nn.Parameter(torch.full((outputs,), -0.7))

    def value(self, inputs: torch.Tensor) -> torch.Tensor:
        """Return values (n,) of observations (n, inputs)."""
        return self.critic(inputs)[:, 0]

    def policy(self, inputs: torch.Tensor) -> Normal:
        """Return the distribution of actions (n, outputs)."""
        return Normal(self.actor(inputs), self.log_std.exp())

    def predict(self, observation: np.ndarray, *, deterministic: bool = True) -> tuple[np.ndarray, None]:
        """Return actions (n, 5, 5), as a match asks for them."""
        with torch.no_grad():
            policy = self.policy(inputs_of(observation))
        actions = policy.mean if deterministic else policy.sample()
        return actions.clamp(-1, 1).numpy().reshape(-1, *self.action_space.shape), None


def inputs_of(observation: np.ndarray) -> torch.Tensor:
    """Return images as rows of numbers from 0 to 1."""
    return torch.as_tensor(observation).flatten(1).float() / 255


def advantages(rewards, values, following, ended, over):
    """Return generalised advantage estimates; arguments are (steps, games), `ended` where a team has won."""
    estimates, running = torch.zeros_like(rewards), torch.zeros_like(rewards[0])
    for t in reversed(range(len(rewards))):
        error = rewards[t] + GAMMA * following[t] * ~ended[t] - values[t]
        running = error + GAMMA * GAE_LAMBDA * ~over[t] * running
        estimates[t] = running
    return estimates


def train(steps: int, seed: int) -> tuple[Agent, int]:
    """Train an agent; return it and the number of its commands."""
    torch.manual_seed(seed)
    envs = gymnasium.make_vec(
        "swarm_pz/Capture-v0",
        num_envs=NUM_ENVS,
        config=GAME,
        opponent=("uniform", "noise"),
        action_cells=5,
        threads=2,
        autoreset_mode=AutoresetMode.SAME_STEP,
    )
    agent = Agent(envs)
    optimizer = torch.optim.Adam(agent.parameters(), LEARNING_RATE, eps=1e-5)
    observation, _ = envs.reset(seed=seed)
    updates = max(steps // (NUM_ENVS * NUM_STEPS), 1)
    for update in range(updates):
        optimizer.param_groups[0]["lr"] = LEARNING_RATE * (1 - update / updates)
        kept = {
            name: [] for name in ("seen", "actions", "log_probs", "values", "following", "rewards", "ended", "over")
        }
        for _ in range(NUM_STEPS):
            inputs = inputs_of(observation)
            with torch.no_grad():
                policy, value = agent.policy(inputs), agent.value(inputs)
            action = policy.sample()
            commands = action.clamp(-1, 1).numpy().reshape(NUM_ENVS, *envs.single_action_space.shape)
            observation, reward, terminated, truncated, infos = envs.step(commands)
            over, last = terminated | truncated, observation
            if over.any():  # what followed is the old game's last observation, not the new game's first
                last = observation.copy()
                last[over] = np.stack(list(infos["final_obs"][over]))
            with torch.no_grad():
                following = agent.value(inputs_of(last))
            step = {"seen": inputs, "actions": action, "log_probs": policy.log_prob(action).sum(1), "values": value}
            step |= {"following": following, "rewards": torch.as_tensor(reward, dtype=torch.float32)}
            step |= {"ended": torch.as_tensor(terminated), "over": torch.as_tensor(over)}
            for name, values in step.items():
                kept[name].append(values)
        batch = {name: torch.stack(values) for name, values in kept.items()}
        estimates = advantages(*(batch[name] for name in ("rewards", "values", "following", "ended", "over")))
        batch |= {"advantages": estimates, "returns": estimates + batch["values"]}
        learn(agent, optimizer, {name: values.flatten(0, 1) for name, values in batch.items()})
    envs.close()
    return agent, updates * NUM_ENVS * NUM_STEPS


def learn(agent: Agent, optimizer: torch.optim.Optimizer, batch: dict[str, torch.Tensor]) -> None:
    """Improve the agent by the clipped objective."""
    for _ in range(EPOCHS):
        for part in torch.randperm(len(batch["seen"])).chunk(MINIBATCHES):
            inputs, estimates = batch["seen"][part], batch["advantages"][part]
            estimates = (estimates - estimates.mean()) / (estimates.std() + 1e-8)
            log_probs = agent.policy(inputs).log_prob(batch["actions"][part]).sum(1)
            ratio = (log_probs - batch["log_probs"][part]).exp()
            gain = torch.min(estimates * ratio, estimates * ratio.clamp(1 - CLIP, 1 + CLIP)).mean()
            error = (agent.value(inputs) - batch["returns"][part]).square().mean()
            optimizer.zero_grad()
            (0.5 * error - gain).backward()
            nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
            optimizer.step()


def main() -> None:
    """Train, save, and play matches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=393_216, help="commands to learn from")
    parser.add_argument("--games", type=int, default=200, help="games against each opponent, even")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/cleanrl_ppo"))
    options = parser.parse_args()

    torch.set_num_threads(1)  # the network is small
    agent, commands = train(options.steps, options.seed)
    options.out.mkdir(parents=True, exist_ok=True)
    torch.save(agent.state_dict(), options.out / "agent.pt")
    print(f"commands seen: {commands}")

    for opponent in ("noise", "uniform"):
        match = play_match(agent, opponent, games=options.games, seed=1, config=GAME, threads=2)
        match.write(options.out / f"{opponent}.json")
        low, high = match.share_interval()
        print(f"against {opponent}: {match.standing()}, share {match.share():.2f} [{low:.2f}, {high:.2f}]")


if __name__ == "__main__":
    main()
