"""One run: a method learns from a seed in stages, after each of which it plays, and can be stopped and taken up."""

from __future__ import annotations

import importlib.metadata
import json
import math
import shutil
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from benchmarks.algorithms.methods import METHODS, RECIPE
from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.config.base import Config, check, check_count
from swarm_pz.evaluation.match import play_match
from swarm_pz.evaluation.provenance import versions
from swarm_pz.files import draft_of
from swarm_pz.kernels.cache import processor
from swarm_pz.policies.exporting import export_model
from swarm_pz.policies.learned import LearnedPolicy
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
WORK, LINE, PAST = "work", "run.json", "past"
_SECONDS = "seconds", "processor_seconds"

Line = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Budget(Config):
    """What every run gets: commands to learn from, evaluations on the way, the end's included, and games in the end.

    There are as many games against `uniform` as against the scripts together.
    """

    commands: int = 819_200
    points: int = 8
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
    """Play a written policy against `uniform`, and a fifth as many games against each script; return the figures.

    A score is the share of games that it won.
    """
    rules, found = GameConfig(), {}
    for opponent in ("uniform", *SCRIPTS):
        count = games if opponent == "uniform" else games // len(SCRIPTS)
        match = play_match(policies.load(str(player), rules), opponent, games=count, seed=SEED, config=rules)
        figures = match.summary()
        found[opponent] = {key: figures[key] for key in ("games", "wins", "draws", "losses")}
        found[opponent] |= {"score": figures["win_rate"], "ms": figures["thinking_ms"][0]}
    return found


class _StageEnd(Exception):  # noqa: N818  (no error)
    """Ends learning between two updates, since a callback alone would end it before the last."""


class Stage(BaseCallback):
    """A run between two stops: a fresh learner, or what the stage before has saved, in games that begin anew."""

    def __init__(self, run: Run, number: int) -> None:
        super().__init__()
        self.run, self.stop = run, run.budget.stops()[number]
        seed = int(np.random.SeedSequence([run.seed, number]).generate_state(1)[0])
        self.env = run.method.games(seed)
        self.model = run.method.learner(self.env, seed)
        if number:
            self._read(run.saved(number))
        self._newest: int | None = None
        self._past: list[LearnedPolicy] = []
        self._prepare()  # before the first games begin

    def _read(self, path: Path) -> None:
        state = torch.load(path, weights_only=True)
        self.model.set_parameters(state["parameters"])
        self.model.num_timesteps = state["commands"]
        for name, value in state["memory"].items():
            setattr(self.model.replay_buffer, name, value.numpy() if torch.is_tensor(value) else value)

    def write(self, path: Path) -> None:
        """Save what the next stage goes on from."""
        memory = vars(self.model.replay_buffer) if isinstance(self.model, OffPolicyAlgorithm) else {}
        kept = {name: torch.from_numpy(one) for name, one in memory.items() if isinstance(one, np.ndarray)}
        kept |= {name: memory[name] for name in ("pos", "full") if memory}
        parameters, commands = self.model.get_parameters(), self.model.num_timesteps
        with draft_of(path) as draft:
            torch.save({"commands": commands, "parameters": parameters, "memory": kept}, draft)

    def learn(self) -> None:
        """Learn up to the stop, and add the seconds that it took, by the wall's clock and of a processor's time."""
        began = _clocks()
        left = self.run.budget.commands - self.model.num_timesteps
        with suppress(_StageEnd):
            self.model.learn(left, callback=self, reset_num_timesteps=False)
        self.env.close()
        for name, spent in zip(_SECONDS, (_clocks() - began).tolist(), strict=True):
            self.run.line[name] += spent

    def _on_rollout_start(self) -> None:
        if self.model.num_timesteps >= self.stop:
            raise _StageEnd
        self._prepare()

    def _on_step(self) -> bool:
        return True

    def _prepare(self) -> None:
        """Lower the standard deviation that PPO explores with, as the recipe does, and see to self-play's opponents."""
        if not isinstance(self.model, OnPolicyAlgorithm):
            return
        done = self.model.num_timesteps / self.run.budget.commands
        log_std = RECIPE.log_std + done * (RECIPE.final_log_std - RECIPE.log_std)
        with torch.no_grad():
            self.model.policy.log_std.fill_(log_std)  # type: ignore[operator, union-attr]
        if self.run.method.meets_itself:
            self._deal()
        for one in self._past:
            one.noise = math.exp(log_std)

    def _deal(self) -> None:
        """Deal a learner's latest selves as its opponents, a new one every few updates."""
        updates, every = self.model.num_timesteps // UPDATE, max(1, self.run.budget.commands // UPDATE // _SELVES)
        newest = updates // every
        if newest == self._newest:
            return
        self._newest, past = newest, self.run.work / PAST
        if updates % every == 0:
            self.learned(f"self-{newest}").write(past / f"self-{newest}")
        latest = [past / f"self-{one}" for one in range(max(0, newest - _PAST + 1), newest + 1)]
        self._past = [LearnedPolicy.read(one, self.run.method.game) for one in latest]
        self.env.deal(self._past, [one.name for one in self._past])

    def learned(self, name: str) -> LearnedPolicy:
        """Return the tactic of the recipe's network, as it stands."""
        network, run = self.model.policy, self.run
        if not isinstance(network, GridPolicy):
            raise TypeError(f"only the recipe's network is a tactic of our own, got {type(network).__name__}")
        config = RECIPE.replace(seed=run.seed, total_steps=run.budget.commands)
        told = {"steps": self.model.num_timesteps, "seconds": run.line["seconds"], "command": COMMAND}
        return as_policy(network, config, name, **told)

    def write_policy(self) -> None:
        """Write what it has learned, in our own format or as an ONNX file; both are players everywhere."""
        folder, game = self.run.policy, self.run.method.game
        shutil.rmtree(folder, ignore_errors=True)
        if isinstance(self.model.policy, GridPolicy):
            self.learned(folder.name).write(folder)
        else:
            export_model(self.model.policy, game, game.team_systems[0], folder, folder.name)


class Run:
    """A method of `METHODS` that learns from a seed. Its policy is `policy`; what goes on if it is stopped, `work`.

    A stage that was stopped begins anew, and is then the one that was not.
    """

    def __init__(self, method: str, seed: int, budget: Budget, out: Path) -> None:
        torch.set_num_threads(1)
        self.method, self.seed, self.budget = METHODS[method], seed, budget
        self.policy, self.work = (folder / f"{method}-{seed}" for folder in (out, out / WORK))
        self.work.mkdir(parents=True, exist_ok=True)
        self.line: Line = {"method": method, "seed": seed, "curve": [], **dict.fromkeys(_SECONDS, 0.0)}
        if (self.work / LINE).exists():
            self.line = json.loads((self.work / LINE).read_text())

    def saved(self, number: int) -> Path:
        """Return where the learner is saved after so many stages."""
        return self.work / f"stage-{number}.pt"

    def learn(self) -> Line:
        """Do what is left, and return the run's line."""
        for number in range(len(self.line["curve"]), self.budget.points):
            self._go_on(number)
        if "final" not in self.line:
            self._keep(final=evaluate(self.policy, self.budget.games))
        for left in self.work.glob("*.pt"):
            left.unlink()
        shutil.rmtree(self.work / PAST, ignore_errors=True)
        return self.line

    def _keep(self, **more: Any) -> None:
        self.line |= more
        with draft_of(self.work / LINE) as draft:
            draft.write_text(json.dumps(self.line) + "\n")

    def _go_on(self, number: int) -> None:
        """Learn up to the next stop, write the policy, and evaluate what was written."""
        stage = Stage(self, number)
        stage.learn()
        stage.write_policy()
        found = evaluate(self.policy, self.budget.games_on_the_way)
        scores = {name: figures["score"] for name, figures in found.items()}
        network = getattr(stage.model.policy, "q_net", stage.model.policy)  # and not its target, a copy
        stage.write(self.saved(number + 1))
        self._keep(
            curve=[*self.line["curve"], {"commands": stage.stop, "scores": scores}],
            weights=sum(values.numel() for values in network.parameters()),
            processor=processor(),
            versions=versions() | {"sb3-contrib": importlib.metadata.version("sb3-contrib")},
        )
        self.saved(number).unlink(missing_ok=True)
        mean = float(np.mean([scores[name] for name in SCRIPTS]))
        told = f"{stage.stop:>9,} commands {stage.stop / self.line['seconds']:6,.0f}/s  won {scores['uniform']:4.0%}"
        print(f"{self.policy.name:<16} {told} against uniform, {mean:4.0%} against scripts", flush=True)


def _clocks() -> NDArray[np.float64]:
    return np.array([time.perf_counter(), time.process_time()])


def run(method: str, seed: int, budget: Budget, out: Path) -> Line:
    """Train a method from a seed, or go on with that; as `Run` and its `learn`."""
    return Run(method, seed, budget, out).learn()
