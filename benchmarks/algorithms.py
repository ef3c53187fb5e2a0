"""Six learning methods with the same games and number of commands: games won, with intervals over seeds.

    python -m benchmarks.algorithms                                          # docs/tables/algorithms.csv
    python -m benchmarks.algorithms --commands 20480 --games 10 --seeds 1 --table runs/try.csv

Finished runs are not repeated. A run's folder, METHOD-SEED, is a policy.
"""

from __future__ import annotations

import argparse
import functools
import json
import math
import time
from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
import torch
from numpy.typing import NDArray
from sb3_contrib import RecurrentPPO
from stable_baselines3 import DQN, PPO
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import Tensor, nn

from benchmarks.csv_table import write_csv
from swarm_pz import policies
from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.evaluation.intervals import over_runs
from swarm_pz.evaluation.match import play_match
from swarm_pz.evaluation.workers import open_pool, share
from swarm_pz.policies.exporting import export_model
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.training.config import RECIPES
from swarm_pz.training.networks import GridPolicy, as_policy
from swarm_pz.training.vec_env import SwarmVecEnv

RECIPE = RECIPES["quick"].replace(threads=1, batch_size=1024, epochs=3)
SCRIPTS = ("noise", "ring", "halo", "wavefront", "corners")
"""Opponents of all methods, besides `uniform`, when they are evaluated."""
EVALUATION_SEED = 1_000
SELVES, PAST = 30, 8
"""Snapshots that self-play takes in a run; the number of the latest ones that are its opponents."""

Line = dict[str, Any]


class DroneSets(BaseFeaturesExtractor):
    """Deep sets (Zaheer et al., NeurIPS 2017): shared layers for a side's drones, then mean and maximum."""

    def __init__(self, observation_space: Any, width: int = 64) -> None:
        super().__init__(observation_space, 4 * width + 2)
        self.own, self.opposing = (
            nn.Sequential(nn.Linear(4, width), nn.ReLU(), nn.Linear(width, width), nn.ReLU()) for _ in range(2)
        )

    def forward(self, observations: dict[str, Tensor]) -> Tensor:
        """Return features (n, 4 width + 2) of n observations."""
        sides = [self._summary(side, observations) for side in ("own", "opposing")]
        return torch.cat([*sides, observations["own_share"], observations["time_left"]], dim=1)

    def _summary(self, side: str, observations: dict[str, Tensor]) -> Tensor:
        place, speed, mask = (observations[f"{side}_{name}"] for name in ("positions", "velocities", "mask"))
        there = mask.reshape(*place.shape[:2], 1).to(place.dtype)
        features = getattr(self, side)(torch.cat([2.0 * place - 1.0, 4.0 * speed], dim=2)) * there  # ReLU: minimum is 0
        mean = features.sum(dim=1) / there.sum(dim=1).clamp(min=1.0)
        return torch.cat([mean, features.amax(dim=1)], dim=1)


def make_ppo(
    kind: type[OnPolicyAlgorithm], policy: Any, games: SwarmVecEnv, seed: int, **network: Any
) -> BaseAlgorithm:
    """Return a PPO with the recipe's settings; `ExploringLess` sets its standard deviation."""
    model = kind(
        policy, games, n_steps=RECIPE.rollout, batch_size=RECIPE.batch_size, n_epochs=RECIPE.epochs,
        learning_rate=lambda left: RECIPE.learning_rate * max(left, 0.05), gamma=RECIPE.gamma,
        gae_lambda=RECIPE.gae_lambda, clip_range=RECIPE.clip_range, ent_coef=RECIPE.entropy, seed=seed, device="cpu",
        policy_kwargs={"log_std_init": RECIPE.log_std, **network},
    )  # fmt: skip
    model.policy.log_std.requires_grad_(False)  # type: ignore[operator, union-attr]
    return model


def make_dqn(games: SwarmVecEnv, seed: int) -> BaseAlgorithm:
    """Return a DQN that learns from each command 16 times."""
    return DQN(
        "MlpPolicy", games, learning_rate=RECIPE.learning_rate, buffer_size=50_000, learning_starts=1_024,
        batch_size=RECIPE.batch_size, gamma=RECIPE.gamma, train_freq=1, gradient_steps=5,
        target_update_interval=2_000, exploration_fraction=0.3, seed=seed, device="cpu",
    )  # fmt: skip


class Method(NamedTuple):
    """A method: a maker of the learner from games and a seed, observations, and action options of `SwarmVecEnv`."""

    learner: Callable[[SwarmVecEnv, int], BaseAlgorithm]
    observation: ObservationConfig = RECIPE.game.observations[0]
    actions: tuple[tuple[str, Any], ...] = (("action_cells", RECIPE.action_cells),)
    meets_itself: bool = False

    @property
    def game(self) -> GameConfig:
        """The rules, with the method's observations."""
        return RECIPE.game.replace(observation=self.observation)


GRID_PPO = functools.partial(make_ppo, PPO, GridPolicy, width=RECIPE.width)
METHODS = {
    "ppo-selfplay": Method(GRID_PPO, meets_itself=True),
    "ppo": Method(GRID_PPO),
    "dqn": Method(make_dqn, actions=(("action", "discrete"),)),
    "ppo-sets": Method(
        functools.partial(make_ppo, PPO, "MultiInputPolicy", features_extractor_class=DroneSets),
        ObservationConfig(kind="entities"),
    ),
    "recurrent-ppo": Method(
        functools.partial(
            make_ppo, RecurrentPPO, "MlpLstmPolicy", lstm_hidden_size=64, shared_lstm=True, enable_critic_lstm=False
        )
    ),
    "ppo-mlp": Method(functools.partial(make_ppo, PPO, "MlpPolicy")),
}


def learned(model: BaseAlgorithm, name: str, seed: int, commands: int) -> LearnedPolicy:
    """Return the model's present network as a policy."""
    config = RECIPE.replace(seed=seed, total_steps=commands)
    network = cast("GridPolicy", model.policy)
    return as_policy(
        network, config, name, steps=model.num_timesteps, seconds=0.0, command="python -m benchmarks.algorithms"
    )


class ExploringLess(BaseCallback):
    """Lowers PPO's standard deviation as the recipe does, and gives self-play its own snapshots as opponents."""

    def __init__(self, games: SwarmVecEnv, seed: int, commands: int, meets_itself: bool) -> None:
        super().__init__()
        self.games, self.seed, self.commands, self.meets_itself = games, seed, commands, meets_itself
        self.past: deque[LearnedPolicy] = deque(maxlen=PAST)
        self.dealt = 0

    def _on_step(self) -> bool:
        return True

    def _on_rollout_start(self) -> None:
        done = self.model.num_timesteps / self.commands
        log_std = RECIPE.log_std + done * (RECIPE.final_log_std - RECIPE.log_std)
        with torch.no_grad():
            self.model.policy.log_std.fill_(log_std)  # type: ignore[operator, union-attr]
        if self.meets_itself and done * SELVES >= self.dealt:
            self.dealt += 1
            self.past.append(learned(self.model, f"self-{self.dealt}", self.seed, self.commands))
            self.games.deal(list(self.past), [one.name for one in self.past])
        for one in self.past:
            one.noise = math.exp(log_std)


def evaluate(player: Path, games: int) -> dict[str, dict[str, float]]:
    """Play `games` games of a policy's folder against `uniform`, and a fifth as many against each script.

    A score is the share of games won; `ms` are milliseconds per command.
    """
    results = {}
    for opponent in ("uniform", *SCRIPTS):
        count = games if opponent == "uniform" else games // len(SCRIPTS)
        match = play_match(policies.load(str(player), GameConfig()), opponent, games=count, seed=EVALUATION_SEED)
        figures = match.summary()
        results[opponent] = {"score": figures["win_rate"], "ms": figures["thinking_ms"][0]}
    return results


def run(name: str, seed: int, commands: int, games: int, out: Path) -> Line:
    """Train a method from a seed, write and evaluate its policy, and return the figures, or those of a finished run."""
    folder, line = out / f"{name}-{seed}", out / f"{name}-{seed}.json"
    wanted = {"method": name, "seed": seed, "commands": commands, "games": games}
    if line.exists() and (finished := json.loads(line.read_text())).items() >= wanted.items():
        return dict(finished)
    torch.set_num_threads(1)
    method = METHODS[name]
    env = SwarmVecEnv(
        method.game, RECIPE.num_envs, opponent=RECIPE.opponents, threads=1, seed=seed, **dict(method.actions)
    )
    model = method.learner(env, seed)
    less = ExploringLess(env, seed, commands, method.meets_itself) if isinstance(model, OnPolicyAlgorithm) else None
    began, busy = time.perf_counter(), time.process_time()
    model.learn(commands, callback=less)
    costs = {"seconds": time.perf_counter() - began, "processor_seconds": time.process_time() - busy}
    if isinstance(model.policy, GridPolicy):
        learned(model, folder.name, seed, commands).write(folder)
    else:
        export_model(model.policy, method.game, method.game.team_systems[0], folder, folder.name)
    network = getattr(model.policy, "q_net", model.policy)  # without DQN's target network, which is a copy
    weights = sum(values.numel() for values in network.parameters())
    line.write_text(json.dumps(wanted | costs | {"weights": weights, "final": evaluate(folder, games)}))
    return dict(json.loads(line.read_text()))


def estimate(scores: NDArray[np.float64]) -> tuple[float, float, float]:
    """Return the mean of scores (seeds, opponents), and the ends of its 95 % interval over seeds."""
    runs = scores.mean(axis=1)
    return (float(runs.mean()), *over_runs(runs))


def table(lines: Sequence[Line]) -> list[tuple[str, ...]]:
    """Return the rows of the table, the best method first."""
    rows = []
    for name in dict.fromkeys(line["method"] for line in lines):
        own = sorted((line for line in lines if line["method"] == name), key=lambda line: int(line["seed"]))
        scores = np.array([[line["final"][one]["score"] for one in ("uniform", *SCRIPTS)] for line in own])
        parts = [estimate(part) for part in (scores, scores[:, :1], scores[:, 1:])]
        wall, busy = (float(np.mean([line[key] for line in own])) for key in ("seconds", "processor_seconds"))
        ms = float(np.median([one["ms"] for line in own for one in line["final"].values()]))
        shown = [f"{value:.2f} ({low:.2f} to {high:.2f})" for value, low, high in parts]
        costs = (f"{wall:.0f}", f"{busy:.0f}", f"{own[0]['commands'] / busy:.0f}", str(own[0]["weights"]), f"{ms:.2f}")
        rows.append((parts[0][0], (name, *shown, *costs)))
    head = ("method", "all", "uniform", "scripts", "wall s", "processor s", "commands a second", "weights",
            "ms a command")  # fmt: skip
    return [head, *(row for _, row in sorted(rows, key=lambda row: -row[0]))]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--commands", type=int, default=819_200, help="commands that each run learns from")
    parser.add_argument("--seeds", type=int, default=3, help="runs of each method")
    parser.add_argument("--games", type=int, default=200, help="games against `uniform`; 10, 20, ...")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("runs/algorithms"), help="folder of policies")
    parser.add_argument("--table", type=Path, default=Path("docs/tables/algorithms.csv"))
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    lines: list[Line] = []
    tasks = [(name, seed, args.commands, args.games, args.out) for name in METHODS for seed in range(args.seeds)]
    with open_pool(args.processes) as pool:
        share(
            pool,
            run,
            tasks,
            lambda _, line: lines.append(line),
            name=lambda task: f"{task[0]}-{task[1]}",
            verb="trained",
        )
    write_csv(args.table, table(lines))
