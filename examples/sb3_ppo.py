"""PPO of Stable-Baselines3 with its default hyperparameters: five minutes on two cores.

python examples/sb3_ppo.py --seed 0
"""

from __future__ import annotations

import argparse
from pathlib import Path

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import VecMonitor

from swarm_pz import GameConfig, ObservationConfig
from swarm_pz.evaluation import play_match
from swarm_pz.training.vec_env import SwarmVecEnv

VIEW = ObservationConfig(grid=10, channels=("own_positions", "opposing_positions", "own_share", "time_left"))
GAME = GameConfig(observation=VIEW, command_period=3)


def main() -> None:
    """Train, save, and play matches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=300_000, help="commands to learn from")
    parser.add_argument("--games", type=int, default=100, help="games against each opponent, even")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/sb3_ppo"))
    options = parser.parse_args()

    envs = SwarmVecEnv(GAME, num_envs=4, opponent="uniform", action="modes", seed=options.seed)
    model = PPO("MlpPolicy", VecMonitor(envs), seed=options.seed, device="cpu", verbose=1)
    untrained = play_match(model, "uniform", games=options.games, seed=1, config=GAME)
    model.learn(options.steps)
    model.save(options.out / "model")
    print(f"commands seen: {model.num_timesteps}")

    print(f"untrained against uniform: {untrained.standing()}, share {untrained.share():.2f}")
    for opponent in ("noise", "uniform"):
        match = play_match(model, opponent, games=options.games, seed=1, config=GAME)
        match.write(options.out / f"{opponent}.json")
        low, high = match.share_interval()
        print(f"against {opponent}: {match.standing()}, share {match.share():.2f} [{low:.2f}, {high:.2f}]")


if __name__ == "__main__":
    main()
