"""Behaviour cloning in plain PyTorch: a network learns what a dataset's player did, and PPO may go on from it.

swarm-pz dataset planner uniform noise ring --out runs/data --game.observation.grid 10 --action-cells 5
python examples/behaviour_cloning.py runs/data/swarm-planner-v0/data --out runs/cloned
swarm-pz train --start-from runs/cloned --critic-steps 60000
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import matplotlib as mpl
import minari
import numpy as np
import torch
from matplotlib import pyplot as plt

from swarm_pz import GameConfig
from swarm_pz.evaluation import play_match
from swarm_pz.training.config import TrainConfig
from swarm_pz.training.networks import GridPolicy, as_policy

BATCH = 64
"""Steps of a minibatch."""
OPPONENTS = ("uniform", "noise")
"""Whom the network plays before and after."""


def read(folder: Path) -> tuple[minari.MinariDataset, GameConfig]:
    """Return a dataset and the game that it is of, if the network that PPO trains fits its spaces."""
    dataset = minari.MinariDataset(folder)
    game = dataset.recover_environment().unwrapped.duel.config
    seen, done = dataset.observation_space, dataset.action_space
    fits = seen.dtype == np.uint8 and len(seen.shape) == 3 and seen.shape[1] == seen.shape[2]
    if not fits or len(done.shape) != 2 or done.low.min() != -1.0 or seen.shape[1] % done.shape[0]:
        sys.exit(
            f"{folder}: expected images (channels, grid, grid) and actions (cells, cells) in [-1, 1], cells dividing "
            f"grid, got {seen.shape} and {done.shape}: record it with --game.observation.grid 10 --action-cells 5"
        )
    return dataset, game


def steps_of(episodes) -> tuple[torch.Tensor, torch.Tensor]:
    """Return what was seen and what was done then, of all episodes."""
    pairs = [(episode.observations[:-1], episode.actions) for episode in episodes]
    seen, done = (np.concatenate(parts) for parts in zip(*pairs, strict=True))
    return torch.from_numpy(seen), torch.from_numpy(done)


def loss_of(network: GridPolicy, seen: torch.Tensor, done: torch.Tensor) -> torch.Tensor:
    """Return the mean squared error of the network's actions."""
    return torch.nn.functional.mse_loss(network.actor(seen.float() / 255.0), done)


def clone(network: GridPolicy, dataset: minari.MinariDataset, epochs: int, seed: int) -> list[dict[str, float]]:
    """Train the network on nine tenths of the episodes; return both losses after each epoch."""
    generator = np.random.default_rng(seed)
    episodes = [dataset[place] for place in generator.permutation(dataset.total_episodes)]
    held = max(1, len(episodes) // 10)
    seen, done = steps_of(episodes[held:] or episodes)
    seen_held, done_held = steps_of(episodes[:held])
    optimizer = torch.optim.Adam(network.actor.parameters(), 1e-3)
    losses = []
    for epoch in range(epochs):
        total = 0.0
        for rows in torch.from_numpy(generator.permutation(len(seen))).split(BATCH):
            loss = loss_of(network, seen[rows], done[rows])
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
            total += float(loss.detach()) * len(rows)
        with torch.no_grad():
            losses.append({"trained": total / len(seen), "held out": float(loss_of(network, seen_held, done_held))})
        print(f"epoch {epoch + 1}: loss {losses[-1]['trained']:.4f}, held out {losses[-1]['held out']:.4f}", flush=True)
    return losses


def measure(policy, game: GameConfig, games: int) -> dict[str, dict]:
    """Play the opponents; return the figures of each match."""
    return {name: play_match(policy, name, games=games, config=game, threads=2).summary() for name in OPPONENTS}


def plot(figures: dict, path: Path) -> None:
    """Draw the losses, and what is won before and after."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
    for name in ("trained", "held out"):
        left.plot([row[name] for row in figures["losses"]], label=name)
    left.set(xlabel="epochs", ylabel="squared error of actions")
    left.legend(frameon=False)
    stages = [stage for stage in ("untrained", "cloned", "then PPO") if stage in figures]
    for place, stage in enumerate(stages):
        rows = [figures[stage][name] for name in OPPONENTS]
        rates = np.array([row["win_rate"] for row in rows])
        around = np.abs(np.array([row["win_rate_ci95"] for row in rows]).T - rates)
        at = np.arange(len(rows)) + (place - (len(stages) - 1) / 2) * 0.25
        right.bar(at, rates, 0.22, yerr=around, label=stage, capsize=3)
    right.set(xticks=range(len(OPPONENTS)), xticklabels=OPPONENTS, ylabel="share of games won", ylim=(0, 1.05))
    right.legend(frameon=False)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def main() -> None:
    """Clone, measure before and after, and write a policy that `swarm-pz train --start-from` takes."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("dataset", type=Path, help="folder of the dataset's data")
    parser.add_argument("--out", type=Path, default=Path("runs/cloned"))
    parser.add_argument("--epochs", type=int, default=40)
    parser.add_argument("--games", type=int, default=40, help="games against each opponent, even")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--after", help="a policy that PPO made of the clone, to measure beside it")
    asked = parser.parse_args()
    mpl.use("Agg")
    if asked.after is not None:
        figures = json.loads((asked.out / "figures.json").read_text())
        game = GameConfig.from_dict(figures["game"])
        figures["then PPO"] = measure(asked.after, game, asked.games)
    else:
        dataset, game = read(asked.dataset)
        cells = dataset.action_space.shape[0]
        config = TrainConfig(game=game, action_cells=cells, seed=asked.seed)
        torch.manual_seed(asked.seed)
        torch.set_num_threads(2)
        network = GridPolicy(dataset.observation_space, dataset.action_space, lambda _: 0.0, width=config.width)
        untrained = measure(as_policy(network, config, "untrained"), game, asked.games)
        began = time.perf_counter()
        losses = clone(network, dataset, asked.epochs, asked.seed)
        seconds = time.perf_counter() - began
        cloned = as_policy(network, config, asked.out.name, seconds=seconds, command=" ".join(sys.argv))
        cloned.write(asked.out)
        figures = {"game": game.to_dict(), "losses": losses, "seconds": seconds, "untrained": untrained}
        figures["cloned"] = measure(cloned, game, asked.games)
    (asked.out / "figures.json").write_text(json.dumps(figures, indent=2) + "\n")
    plot(figures, asked.out / "cloning.png")
    for stage in ("untrained", "cloned", "then PPO"):
        for name, row in figures.get(stage, {}).items():
            print(f"{stage} against {name}: won {row['wins']}, drawn {row['draws']}, lost {row['losses']}")
    print(f"policy: {asked.out}; figure: {asked.out / 'cloning.png'}")


if __name__ == "__main__":
    main()
