"""RecurrentPPO of sb3-contrib: a tactic with a memory for each game, exported as ONNX.

python examples/sb3_contrib_recurrent_ppo.py --steps 262144
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

import torch
from sb3_contrib import RecurrentPPO

from swarm_pz import GameConfig, ObservationConfig
from swarm_pz.evaluation import play_match
from swarm_pz.policies.exporting import export_model
from swarm_pz.training.vec_env import SwarmVecEnv

GAME = GameConfig(drones_per_team=5, observation=ObservationConfig(grid=10))


def main() -> None:
    """Train, export, and play matches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=262_144, help="commands to learn from")
    parser.add_argument("--games", type=int, default=200, help="games against each opponent, even")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--out", type=Path, default=Path("runs/sb3_contrib_recurrent_ppo"))
    options = parser.parse_args()

    torch.set_num_threads(1)  # the network is small
    opponents = ("uniform", "noise")
    envs = SwarmVecEnv(GAME, num_envs=64, opponent=opponents, action_cells=5, threads=2, seed=options.seed)
    model = RecurrentPPO(
        "MlpLstmPolicy",
        envs,
        n_steps=64,
        batch_size=1024,
        n_epochs=4,
        learning_rate=lambda left: 5e-4 * left,
        gamma=0.98,
        policy_kwargs={
            "log_std_init": -0.7,
            "net_arch": [64],
            "lstm_hidden_size": 64,
            "shared_lstm": True,
            "enable_critic_lstm": False,
        },
        seed=options.seed,
        device="cpu",
    )
    model.learn(options.steps)
    options.out.mkdir(parents=True, exist_ok=True)
    model.save(options.out / "model")
    print(f"commands seen: {model.num_timesteps}")

    policy = options.out / "onnx"  # `swarm-pz export runs/.../model.zip FOLDER --trust` does the same
    shutil.rmtree(policy, ignore_errors=True)
    export_model(model.policy, GAME, GAME.team_systems[0], policy, "recurrent")
    for opponent in ("noise", "uniform"):
        match = play_match(str(policy), opponent, games=options.games, seed=1, config=GAME, threads=2)
        match.write(options.out / f"{opponent}.json")
        low, high = match.share_interval()
        print(f"against {opponent}: {match.standing()}, share {match.share():.2f} [{low:.2f}, {high:.2f}]")


if __name__ == "__main__":
    main()
