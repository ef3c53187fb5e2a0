"""PPO of Stable-Baselines3, on the game as it is: no wrapper, the library's own network.

python examples/sb3_ppo.py --steps 393216
"""

from __future__ import annotations

import argparse
from pathlib import Path

import torch
from stable_baselines3 import PPO

from swarm_pz import GameConfig, ObservationConfig, play_match
from swarm_pz.training.vec_env import SwarmVecEnv

GAME = GameConfig(drones_per_team=5, observation=ObservationConfig(grid=10))


def main() -> None:
    """Train, save, and play matches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=393_216, help="commands to learn from")
    parser.add_argument("--games", type=int, default=200, help="games against each opponent, even")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/sb3_ppo"))
    asked = parser.parse_args()

    torch.set_num_threads(1)  # the network is small
    opponents = ("uniform", "noise")
    envs = SwarmVecEnv(GAME, num_envs=64, opponent=opponents, action_cells=5, threads=2, seed=asked.seed)
    model = PPO(
        "MlpPolicy",
        envs,
        n_steps=64,
        batch_size=1024,
        n_epochs=4,
        learning_rate=lambda left: 5e-4 * left,
        gamma=0.98,
        policy_kwargs={"log_std_init": -0.7, "net_arch": [128, 128]},
        seed=asked.seed,
        device="cpu",
    )
    model.learn(asked.steps)
    model.save(asked.out / "model")
    print(f"commands seen: {model.num_timesteps}")

    for opponent in ("noise", "uniform"):
        match = play_match(model, opponent, games=asked.games, seed=1, config=GAME, threads=2)
        match.write(asked.out / f"{opponent}.json")
        low, high = match.share_interval()
        print(f"against {opponent}: {match.standing()}, share {match.share():.2f} [{low:.2f}, {high:.2f}]")


if __name__ == "__main__":
    main()
