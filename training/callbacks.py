"""Callbacks of a run: schedules, progress, evaluation without exploration, checkpoints.

Curves have Stable-Baselines3's names; `share` is the learner's final share of the drones.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import torch
from stable_baselines3.common.callbacks import BaseCallback

from swarm_pz.errors import Stopped
from swarm_pz.evaluation.match import MatchResult, play_match
from swarm_pz.kernels.step import red_reward
from swarm_pz.policy import Player
from swarm_pz.training.checkpoint import random_streams_kept
from swarm_pz.training.config import TrainConfig

EVALUATION_SEEDS = 1_000_000
"""Offset that keeps the seeds of evaluations during a run apart from those of the matches after it."""
_RECENT = 256
"""Number of latest finished games in `RunState.recent`."""


@dataclass
class RunState:
    """The history of a run, which its callbacks share."""

    config: TrainConfig
    records: list[dict[str, float]] = field(default_factory=list)
    """One dict for each evaluation against the first opponent: step, seconds, win_rate, its interval, loss_rate, share,
    and training_share, the mean share in the latest training games."""
    seconds: float = 0.0
    """Training time, including the time before a resume."""
    recent: deque[tuple[bool, float]] = field(default_factory=lambda: deque(maxlen=_RECENT))
    """(won, final share of drones) of the latest training games, which are played with exploration."""

    def exploration(self, steps: int) -> float:
        """Return the standard deviation of the exploration after `steps` steps."""
        done = min(steps / self.config.total_steps, 1.0)
        return math.exp(self.config.log_std + done * (self.config.final_log_std - self.config.log_std))

    def training_means(self) -> tuple[float, float]:
        """Return the fraction of the latest training games won, and the mean final share of drones in them."""
        won, share = np.mean(self.recent or [(0.0, 0.0)], axis=0).tolist()
        return won, share


class RunCallback(BaseCallback):
    """A callback that shares the run's state; its `_on_step` never stops the training."""

    def __init__(self, state: RunState) -> None:
        super().__init__()
        self.state = state

    def _on_step(self) -> bool:
        return True


class Account(RunCallback):
    """Records finished games and training time."""

    def _on_training_start(self) -> None:
        self._began, self._before = time.monotonic(), self.state.seconds

    def _on_step(self) -> bool:
        self.state.seconds = self._before + time.monotonic() - self._began
        for info in self.locals["infos"]:
            if "outcome" in info:
                self.state.recent.append((bool(info["outcome"] > 0), float(info["share"])))
        return True

    def _on_rollout_end(self) -> None:
        for name, mean in zip(("success_rate", "share"), self.state.training_means(), strict=True):
            self.logger.record(f"rollout/{name}", mean)


class Schedules(RunCallback):
    """Lowers the exploration as the run goes on, and freezes the actor while only the critic learns."""

    def _on_rollout_start(self) -> None:
        with torch.no_grad():
            self.model.policy.log_std.fill_(math.log(self.state.exploration(self.num_timesteps)))  # type: ignore[operator]
        learns = self.num_timesteps >= self.state.config.critic_steps
        for parameter in self.model.policy.actor.parameters():  # type: ignore[union-attr]
            parameter.requires_grad_(learns)


class PeriodicEvaluation(RunCallback):
    """Evaluates the tactic that `policy` returns, without exploration: first at the start, then regularly."""

    def __init__(self, state: RunState, policy: Callable[[], Player]) -> None:
        super().__init__(state)
        self._policy = policy

    def _on_rollout_start(self) -> None:
        records = self.state.records
        if not records or self.num_timesteps >= records[-1]["step"] + self.state.config.evaluate_every:
            self.evaluate()

    def evaluate(self) -> None:
        """Play the tactic and record the result."""
        config = self.state.config
        with random_streams_kept():  # so an extra evaluation changes nothing in the run
            match = play_match(
                self._policy(),
                config.opponents[0],
                games=config.evaluation_games,
                seed=EVALUATION_SEEDS + config.seed,
                config=config.game,
                threads=config.threads,
            )
        summary = match.summary()
        record = {
            "step": self.num_timesteps,
            "seconds": round(self.state.seconds, 1),
            "win_rate": summary["win_rate"],
            "win_rate_low": summary["win_rate_ci95"][0],
            "win_rate_high": summary["win_rate_ci95"][1],
            "loss_rate": summary["losses"] / summary["games"],
            "share": summary["mean_share"],
            "training_share": self.state.training_means()[1],
        }
        self.state.records.append(record)
        self.logger.record("eval/mean_reward", _mean_reward(match))
        for name, key in (("success_rate", "win_rate"), ("loss_rate", "loss_rate"), ("share", "share")):
            self.logger.record(f"eval/{name}", record[key])
        self.logger.dump(self.num_timesteps)


def _mean_reward(match: MatchResult) -> float:
    """Return the games' mean undiscounted return: a game's rewards sum to the reward of one step from start to end."""
    config, outcomes = match.config, np.array([game.outcome for game in match.games])
    owned = np.array([[game.share * config.num_drones, config.team_sizes[game.side == "blue"]] for game in match.games])
    gained = (owned[:, 0] - owned[:, 1]).round().astype(np.int64)
    weights = config.reward.size_change, config.num_drones / 2, config.reward.outcome
    return float(red_reward(gained, outcomes != "draw", outcomes == "win", *weights).mean())  # as if always red


class Checkpoint(RunCallback):
    """Saves a run regularly, and before it raises Stopped with the sentence of `standing`."""

    def __init__(
        self, state: RunState, save: Callable[[], None], should_stop: Callable[[], bool], standing: Callable[[], str]
    ) -> None:
        super().__init__(state)
        self._save, self._should_stop, self._standing = save, should_stop, standing

    def _on_training_start(self) -> None:
        self._next = self.num_timesteps + self.state.config.checkpoint_every

    def _on_rollout_start(self) -> None:
        stops = self._should_stop()
        if stops or self.num_timesteps >= self._next:
            self._next = self.num_timesteps + self.state.config.checkpoint_every
            self._save()
        if stops:
            raise Stopped(self._standing())


class Progress(RunCallback):
    """Reports the progress in one line at every 5 % of a run."""

    def __init__(self, state: RunState, say: Callable[[str], None]) -> None:
        super().__init__(state)
        self._say = say
        self._printed = -1

    def _on_training_start(self) -> None:
        self._first_step, self._began = self.num_timesteps, time.monotonic()

    def _on_rollout_end(self) -> None:
        total = self.state.config.total_steps
        rate = (self.num_timesteps - self._first_step) / (time.monotonic() - self._began)
        done = min(self.num_timesteps / total, 1.0)
        seconds, last = int(max(total - self.num_timesteps, 0) / rate), self.state.records[-1]
        won, share = self.state.training_means()
        line = (
            f"{done:4.0%} {self.num_timesteps:>9,} steps  {rate:6,.0f}/s  {seconds // 60}:{seconds % 60:02d} left  "
            f"exploring: won {won:3.0%}, share {share:.2f}  "
            f"evaluated at {last['step']:,}: won {last['win_rate']:3.0%}, share {last['share']:.2f}"
        )
        if int(20 * done) > self._printed:
            self._printed = int(20 * done)
            self._say(line)
