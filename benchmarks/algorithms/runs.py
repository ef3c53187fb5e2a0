"""One run: a method learns from a seed, plays at fixed points of its budget, and what it has learned is written."""

from __future__ import annotations

import hashlib
import importlib.metadata
import math
import shutil
import time
from collections import deque
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.callbacks import BaseCallback, CallbackList
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from benchmarks.algorithms.methods import METHODS, RECIPE
from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.config.base import Config, check, check_count
from swarm_pz.evaluation.match import play_match
from swarm_pz.evaluation.provenance import versions
from swarm_pz.kernels.cache import processor
from swarm_pz.policies.exporting import export_model
from swarm_pz.policies.learned import LearnedPolicy
from swarm_pz.training.checkpoint import random_streams_kept
from swarm_pz.training.networks import GridPolicy, as_policy

COMMAND = "python -m benchmarks.algorithms"
UPDATE = RECIPE.num_envs * RECIPE.rollout
"""Commands between two updates of PPO."""
SCRIPTS = ("noise", "ring", "halo", "wavefront", "corners")
"""Whom all methods play, besides `uniform`."""
SEED = 1_000
"""Of all games that are evaluated: common to all."""
_FEWER = 5
"""Times fewer games in an evaluation on the way."""
_SELVES, _PAST = 30, 8
"""Selves that self-play deals in the course of a run; the latest of them, which it meets."""


@dataclass(frozen=True, kw_only=True)
class Budget(Config):
    """What every run gets: commands to learn from, evaluations on the way, the end's included, and games in the end.

    There are as many games against `uniform` as against the scripts together.
    """

    commands: int = 122_880
    points: int = 6
    games: int = 200

    def __post_init__(self) -> None:
        super().__post_init__()
        check_count(self.commands, "commands", UPDATE, 10**9)
        check(self.commands % UPDATE == 0, "commands", self.commands, f"a multiple of {UPDATE}, an update of PPO")
        check_count(self.points, "points", 1, self.commands // UPDATE)
        step = 2 * len(SCRIPTS) * _FEWER
        check_count(self.games, "games", step, 10**6)
        expected = f"a multiple of {step}: both sides, every script, on the way"
        check(self.games % step == 0, "games", self.games, expected)

    @property
    def games_on_the_way(self) -> int:
        """Games of an evaluation on the way, as `games` in the end."""
        return self.games // _FEWER

    def stops(self) -> list[int]:
        """Return the commands after which there is an evaluation."""
        updates = self.commands // UPDATE
        return [UPDATE * (updates * point // self.points) for point in range(1, self.points + 1)]


def evaluate(player: Path, games: int) -> dict[str, dict[str, float]]:
    """Play a written policy against `uniform`, and a fifth as many games against each script; return the figures."""
    rules, found = GameConfig(), {}
    for opponent in ("uniform", *SCRIPTS):
        count = games if opponent == "uniform" else games // len(SCRIPTS)
        match = play_match(policies.load(str(player), rules), opponent, games=count, seed=SEED, config=rules)
        figures = match.summary()
        found[opponent] = {key: figures[key] for key in ("games", "wins", "draws", "losses")}
        found[opponent] |= {"score": match.score(), "ms": figures["thinking_ms"][0]}
    return found


class _FadingExploration(BaseCallback):
    """Lowers the standard deviation that PPO explores with, as the recipe does."""

    def __init__(self, run: Run) -> None:
        super().__init__()
        self.run = run

    def log_std(self) -> float:
        done = min(self.num_timesteps / self.run.budget.commands, 1.0)
        return RECIPE.log_std + done * (RECIPE.final_log_std - RECIPE.log_std)

    def _on_rollout_start(self) -> None:
        with torch.no_grad():
            self.model.policy.log_std.fill_(self.log_std())  # type: ignore[operator]

    def _on_step(self) -> bool:
        return True


class _SelfPlay(_FadingExploration):
    """Deals a learner's latest selves as its opponents, a new one every so often."""

    def __init__(self, run: Run) -> None:
        super().__init__(run)
        self.past: deque[LearnedPolicy] = deque(maxlen=_PAST)
        self.every = run.budget.commands / _SELVES
        self.dealt = 0
        self.deal()  # before the first games begin

    def deal(self) -> None:
        latest = self.run.learned(f"self-{self.dealt}")
        latest.noise = math.exp(self.log_std())
        self.past.append(latest)
        self.run.env.deal(list(self.past), [one.name for one in self.past])
        self.dealt += 1

    def _on_rollout_start(self) -> None:
        super()._on_rollout_start()
        if self.num_timesteps >= self.every * self.dealt:
            self.deal()
        for one in self.past:
            one.noise = math.exp(self.log_std())


class _Curve(BaseCallback):
    """Evaluates at the stops of a run."""

    def __init__(self, run: Run) -> None:
        super().__init__()
        self.run, self.left = run, deque(run.budget.stops())

    def _on_rollout_start(self) -> None:
        if self.left and self.num_timesteps >= self.left[0]:
            self.left.popleft()
            self.run.look()

    def _on_step(self) -> bool:
        return True

    def _on_training_end(self) -> None:
        self._on_rollout_start()


class Run:
    """A method of `METHODS` that learns from a seed, and is written into a folder in place of an earlier attempt."""

    def __init__(self, method: str, seed: int, budget: Budget, folder: Path) -> None:
        torch.set_num_threads(1)
        self.method, self.seed, self.budget, self.folder = METHODS[method], seed, budget, folder
        self.name = f"{method}-{seed}"
        self.curve: list[dict[str, Any]] = []
        self.env = self.method.games(seed)
        self.model = self.method.learner(self.env, seed)
        self._began, self._apart = _clocks(), np.zeros(2)

    @property
    def seconds(self) -> tuple[float, float]:
        """Seconds for which it has learned, without evaluations: by the wall's clock, and of a processor's time."""
        wall, busy = _clocks() - self._began - self._apart
        return float(wall), float(busy)

    def learned(self, name: str) -> LearnedPolicy:
        """Return the tactic of the recipe's network, as it stands."""
        network, steps = self.model.policy, self.model.num_timesteps
        if not isinstance(network, GridPolicy):
            raise TypeError(f"only the recipe's network is a tactic of our own, got {type(network).__name__}")
        config = RECIPE.replace(seed=self.seed, total_steps=self.budget.commands)
        return as_policy(network, config, name, steps=steps, seconds=self.seconds[0], command=COMMAND)

    def write(self) -> None:
        """Write what it has learned, in our own format or as an ONNX file; both are players everywhere."""
        shutil.rmtree(self.folder, ignore_errors=True)
        if isinstance(self.model.policy, GridPolicy):
            self.learned(self.name).write(self.folder)
        else:
            game = self.method.game
            export_model(self.model.policy, game, game.team_systems[0], self.folder, self.name)

    def look(self) -> None:
        """Write the policy, and evaluate what was written; learning goes on as if nobody had looked."""
        began, commands = _clocks(), self.model.num_timesteps
        rate = commands / self.seconds[0]
        with random_streams_kept():
            self.write()
            found = evaluate(self.folder, self.budget.games_on_the_way)
        scores = {name: figures["score"] for name, figures in found.items()}
        self.curve.append({"commands": commands, "scores": scores})
        mean = float(np.mean([scores[name] for name in SCRIPTS]))
        print(
            f"{self.name:<16} {commands / self.budget.commands:4.0%} {commands:>9,} commands {rate:6,.0f}/s  "
            f"points {scores['uniform']:.2f} against uniform, {mean:.2f} against scripts",
            flush=True,
        )
        self._apart += _clocks() - began

    def learn(self) -> dict[str, Any]:
        """Learn to the end, and return the run's line."""
        stages: list[BaseCallback] = [_Curve(self)]
        if self.method.meets_itself:
            stages.append(_SelfPlay(self))
        elif isinstance(self.model, OnPolicyAlgorithm):
            stages.append(_FadingExploration(self))
        self._began = _clocks()
        self.model.learn(self.budget.commands, callback=CallbackList(stages))
        wall, busy = self.seconds
        self.env.close()
        final = evaluate(self.folder, self.budget.games)
        network = getattr(self.model.policy, "q_net", self.model.policy)  # and not its target, a copy
        return {
            "method": self.name.rsplit("-", 1)[0],
            "seed": self.seed,
            "commands": self.model.num_timesteps,
            "curve": self.curve,
            "final": final,
            "seconds": round(wall, 1),
            "processor_seconds": round(busy, 1),
            "weights": sum(values.numel() for values in network.parameters()),
            "processor": processor(),
            "versions": versions() | {"sb3-contrib": importlib.metadata.version("sb3-contrib")},
            "sha256": digests(self.folder),
        }


def _clocks() -> NDArray[np.float64]:
    return np.array([time.perf_counter(), time.process_time()])


def digests(folder: Path) -> dict[str, str]:
    """Return the SHA-256 of each file of a policy's folder."""
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.glob("policy.*"))}


def run(method: str, seed: int, budget: Budget, folder: Path) -> dict[str, Any]:
    """Train a method from a seed; as `Run` and its `learn`."""
    return Run(method, seed, budget, folder).learn()
