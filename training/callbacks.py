"""What happens beside PPO: progress, evaluation without exploration, checkpoints."""

from __future__ import annotations

import math
import sys
import time
from collections.abc import Callable

import torch
from stable_baselines3.common.callbacks import BaseCallback

from swarm_pz.errors import Stopped
from swarm_pz.evaluation.match import play_match
from swarm_pz.policy import Player, load
from swarm_pz.training.randomness import kept
from swarm_pz.training.run_state import RunState

EVALUATION_SEEDS = 1_000_000
"""Sets the seeds of evaluations during a run apart from those of the matches after it."""


class Account(BaseCallback):
    """Keeps the run's account: the latest finished games, and the time spent."""

    def __init__(self, state: RunState) -> None:
        super().__init__()
        self.state = state

    def _on_training_start(self) -> None:
        self._began, self._before = time.monotonic(), self.state.history.seconds

    def _on_step(self) -> bool:
        self.state.history.seconds = self._before + time.monotonic() - self._began
        for info in self.locals["infos"]:
            if "outcome" in info:
                self.state.recent.append((bool(info["outcome"] > 0), float(info["share"])))
        return True


class FadingExploration(BaseCallback):
    """Lowers the exploration's standard deviation as the run goes on."""

    def __init__(self, state: RunState) -> None:
        super().__init__()
        self.state = state

    def _on_rollout_start(self) -> None:
        with torch.no_grad():
            self.model.policy.log_std.fill_(math.log(self.state.exploration(self.num_timesteps)))  # type: ignore[operator]

    def _on_step(self) -> bool:
        return True


class CriticFirst(BaseCallback):
    """Holds the actor still at the start, until the critic knows what the taken-over tactic is worth."""

    def __init__(self, state: RunState) -> None:
        super().__init__()
        self.state = state

    def _on_rollout_start(self) -> None:
        learns = self.num_timesteps >= self.state.config.critic_steps
        for parameter in self.model.policy.actor.parameters():  # type: ignore[union-attr]
            parameter.requires_grad_(learns)

    def _on_step(self) -> bool:
        return True


class PeriodicEvaluation(BaseCallback):
    """Plays the tactic without exploration every so often, from the start on.

    Parameters
    ----------
    state : RunState
    policy : callable
        Gives the tactic as it stands.
    """

    def __init__(self, state: RunState, policy: Callable[[], Player]) -> None:
        super().__init__()
        self.state = state
        self._policy = policy

    # At the start of a rollout, since at its end the update that it is for is still to come.
    def _on_rollout_start(self) -> None:
        records = self.state.history.records
        if not records or self.num_timesteps >= records[-1]["step"] + self.state.config.evaluate_every:
            self.evaluate()

    def _on_step(self) -> bool:
        return True

    def evaluate(self) -> None:
        """Play the tactic as it stands and write it down."""
        config = self.state.config
        with kept():  # an evaluation more or less changes nothing in the run
            match = play_match(
                self._policy(),
                load(config.opponents[0], config.game, config.game.team_systems[1]),
                games=config.evaluation_games,
                seed=EVALUATION_SEEDS + config.seed,
                config=config.game,
                threads=config.threads,
            )
        summary = match.summary()
        record = {
            "step": self.num_timesteps,
            "seconds": round(self.state.history.seconds, 1),
            "win_rate": summary["win_rate"],
            "win_rate_low": summary["win_rate_ci95"][0],
            "win_rate_high": summary["win_rate_ci95"][1],
            "loss_rate": summary["losses"] / summary["games"],
            "share": summary["mean_share"],
            "training_share": self.state.training_share(),
        }
        self.state.history.records.append(record)
        for name in ("win_rate", "loss_rate", "share"):
            self.logger.record(f"evaluation/{name}", record[name])
        self.logger.record("train/win_rate", self.state.training_win_rate())
        self.logger.record("train/share", record["training_share"])
        self.logger.dump(self.num_timesteps)


class Checkpoint(BaseCallback):
    """Saves a run every so often; and where it is asked to stop, which ends it.

    Parameters
    ----------
    state : RunState
    save : callable
        Writes all that is needed to go on.
    should_stop : callable
        Says whether to stop.
    standing : callable
        Says how far the run is.
    """

    def __init__(
        self, state: RunState, save: Callable[[], None], should_stop: Callable[[], bool], standing: Callable[[], str]
    ) -> None:
        super().__init__()
        self.state = state
        self._save = save
        self._should_stop = should_stop
        self._standing = standing

    def _on_training_start(self) -> None:
        self._next = self.num_timesteps + self.state.config.checkpoint_every

    # Between two rollouts nothing is half done; what is saved then changes nothing in the run.
    def _on_rollout_start(self) -> None:
        stops = self._should_stop()
        if stops or self.num_timesteps >= self._next:
            self._next = self.num_timesteps + self.state.config.checkpoint_every
            self._save()
        if stops:
            raise Stopped(self._standing())

    def _on_step(self) -> bool:
        return True


class Progress(BaseCallback):
    """Says how far the run is: a line in place on a terminal, a line every tenth elsewhere."""

    def __init__(self, state: RunState, say: Callable[[str], None]) -> None:
        super().__init__()
        self.state = state
        self._say = say
        self._tenth = -1

    def _on_training_start(self) -> None:
        self._first_step = self.num_timesteps
        self._began = time.monotonic()

    def _on_step(self) -> bool:
        return True

    def _on_rollout_end(self) -> None:
        total = self.state.config.total_steps
        spent = time.monotonic() - self._began
        rate = (self.num_timesteps - self._first_step) / spent
        done = min(self.num_timesteps / total, 1.0)
        records = self.state.history.records
        line = (
            f"{done:4.0%} {self.num_timesteps:>9,} steps  {rate:6,.0f}/s  "
            f"{_clock(max(total - self.num_timesteps, 0) / rate)} left  "
            f"exploring: won {self.state.training_win_rate():3.0%}, share {self.state.training_share():.2f}  "
            f"evaluated at {records[-1]['step']:,}: won {records[-1]['win_rate']:3.0%}, "
            f"share {records[-1]['share']:.2f}"
        )
        if sys.stdout.isatty():
            filled = round(20 * done)
            print(f"\r[{'#' * filled}{'.' * (20 - filled)}] {line}", end="\n" if done >= 1.0 else "", flush=True)
        elif int(10 * done) > self._tenth:
            self._tenth = int(10 * done)
            self._say(line)


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"
