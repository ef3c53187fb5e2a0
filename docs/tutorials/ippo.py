"""IPPO: every drone is an agent, all with the same network, trained by Stable-Baselines3's PPO without a wrapper.

python docs/tutorials/ippo.py --opponent uniform --minutes 15
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import torch
from matplotlib import pyplot as plt
from numpy.typing import NDArray
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback

from swarm_pz import GameConfig, Simulator
from swarm_pz.evaluation import paired_difference, play_match
from swarm_pz.simulator import Seed
from swarm_pz.spaces import DroneView
from swarm_pz.training.drones_vec_env import DronesVecEnv, PlayingRolloutBuffer

PERIOD = 0.5
"""Seconds that an acceleration is held, in training and in matches."""
TRAINING_STEPS = 80
"""Steps of a game in training. Most captures come early; a time-out is bootstrapped with the critic's value."""


class Learned:
    """Plays the network's mean actions in matches; every drone acts on its own observation."""

    name, answers = "ippo.py", "accelerations"

    def __init__(self, model: PPO, view: DroneView) -> None:
        self.model, self.view = model, view

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games; there is nothing to remember."""

    def plan(self, simulator: Simulator, teams: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.float32]:
        """Return accelerations (n, N, 2); those of the other team's drones are ignored."""
        seen = self.view.observe(simulator, teams, rows)
        actions, _ = self.model.predict(seen.reshape(-1, seen.shape[-1]), deterministic=True)
        return actions.reshape(*seen.shape[:2], 2)


class Random:
    """Uniform random accelerations."""

    name, answers = "random", "accelerations"

    def __init__(self) -> None:
        self.generators: dict[int, np.random.Generator] = {}

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games, each with its own random stream."""
        self.generators.update(zip(rows.tolist(), map(np.random.default_rng, seeds), strict=True))

    def plan(self, simulator: Simulator, teams: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return accelerations (n, N, 2)."""
        shape = (simulator.config.num_drones, 2)
        return np.stack([self.generators[row].uniform(-1, 1, shape) for row in rows.tolist()])


class Coast:
    """No acceleration at all: drones at rest stay at rest."""

    name, answers = "coast", "accelerations"

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games; there is nothing to remember."""

    def plan(self, simulator: Simulator, teams: NDArray[np.int64], rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return accelerations (n, N, 2)."""
        return np.zeros((len(rows), simulator.config.num_drones, 2))


class Watch(BaseCallback):
    """Records how games end, and stops training when time is up."""

    def __init__(self, minutes: float) -> None:
        super().__init__()
        self.until, self.spoken = time.monotonic() + 60 * minutes, 0
        self.ends: list[tuple[int, float]] = []
        """For each ended game: steps of drones until then, and the learning side's final share of all drones."""

    def _on_step(self) -> bool:
        drones = self.training_env.get_attr("num_drones", 0)[0]
        for info in filter(None, self.locals["infos"][::drones]):
            self.ends.append((self.num_timesteps, info["size"] / drones))
        return time.monotonic() < self.until

    def _on_rollout_end(self) -> None:
        shares = [share for _, share in self.ends[-100:]]
        print(f"{self.num_timesteps:>11,} steps of drones  share {np.mean(shares or np.nan):.2f}", flush=True)


def train(game: GameConfig, options: argparse.Namespace) -> tuple[PPO, Watch]:
    """Train one network that flies every drone; return it with its `Watch`."""
    torch.set_num_threads(options.threads)
    env = DronesVecEnv(
        game,
        options.games,
        opponent=options.opponent,
        action_period=PERIOD,
        max_cycles=TRAINING_STEPS,
        seed=options.seed,
    )
    watch = Watch(options.minutes)
    model = PPO(
        "MlpPolicy",
        env,
        n_steps=options.rollout,
        batch_size=options.rollout * env.num_envs // 8,
        n_epochs=8,
        gamma=0.97,
        gae_lambda=0.95,
        rollout_buffer_class=PlayingRolloutBuffer,
        rollout_buffer_kwargs={"team": env.num_drones},
        learning_rate=5e-4,
        target_kl=0.05,
        policy_kwargs={"net_arch": [64, 64], "log_std_init": -2.0},
        seed=options.seed,
        device="cpu",
    )
    model.learn(options.steps, callback=watch)
    env.close()
    return model, watch


def draw(ends: list[tuple[int, float]], beside: dict[str, float], folder: Path) -> None:
    """Plot the final share in training games, as a mean of a hundred, and other players' share in whole games."""
    steps, shares = np.array(ends).T if ends else np.zeros((2, 0))
    window = min(100, len(steps))
    with plt.style.context("swarm_pz.rendering.plots"):
        figure, axes = plt.subplots()
        if window:
            axes.plot(steps[window - 1 :] / 1e6, np.convolve(shares, np.ones(window) / window, "valid"), label="IPPO")
        for style, (name, share) in zip(("--", ":"), beside.items(), strict=True):
            axes.axhline(share, color="0.5", linestyle=style, label=f"{name}, whole games")
        axes.set(xlabel="steps of drones, millions", title="share of drones at the end", ylim=(-0.02, 1.02))
        figure.legend(loc="outside lower center", ncols=3)
        figure.savefig(folder / "learning_curve.png")
    plt.close(figure)


def main() -> None:
    """Train, draw the learning curve, and compare with random accelerations on the same starts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--opponent", default="uniform")
    parser.add_argument("--drones", type=int, default=5, help="of each team")
    parser.add_argument("--steps", type=int, default=8_000_000, help="of drones, all games together")
    parser.add_argument("--minutes", type=float, default=15.0, help="training stops then at the latest")
    parser.add_argument("--games", type=int, default=64, help="side by side")
    parser.add_argument("--rollout", type=int, default=32, help="steps of each between two updates")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--evaluation-games", type=int, default=200)
    parser.add_argument("--time-limit", type=float, default=300.0)
    parser.add_argument("--out", type=Path, default=Path("runs/ippo"))
    options = parser.parse_args()
    mpl.use("Agg")
    options.out.mkdir(parents=True, exist_ok=True)
    game = GameConfig(drones_per_team=options.drones, time_limit=options.time_limit)
    began = time.monotonic()
    model, watch = train(game, options)
    minutes = (time.monotonic() - began) / 60
    model.save(options.out / "model.zip")
    match = game.replace(command_period=PERIOD, controllers=("direct", "ergodic"))
    learned, *others = (
        play_match(player, options.opponent, games=options.evaluation_games, seed=1, config=match)
        for player in (Learned(model, DroneView(match)), Random(), Coast())
    )
    figures: dict[str, Any] = {"steps": model.num_timesteps, "minutes": round(minutes, 1)}
    for result in (learned, *others):
        figures[result.policy] = result.summary()
        print(f"{result.policy}: {result.standing()} won-drawn-lost, share {result.summary()['mean_share']:.2f}")
    for result in others:
        gain, low, high = paired_difference(learned, result)
        figures[f"share_above_{result.policy}"] = {"mean": gain, "ci95": [low, high]}
        print(f"share above that of {result.policy}: {gain:.2f} [{low:.2f}, {high:.2f}]")
    (options.out / "figures.json").write_text(json.dumps(figures, indent=2) + "\n")
    draw(watch.ends, {result.policy: figures[result.policy]["mean_share"] for result in others}, options.out)


if __name__ == "__main__":
    main()
