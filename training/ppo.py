"""Train a tactic with Stable-Baselines3's PPO, show how it went, and write what plays."""

from __future__ import annotations

import json
import math
import pickle
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback, CallbackList
from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat
from stable_baselines3.common.vec_env import VecMonitor

from swarm_pz import policies
from swarm_pz.config import GameConfig
from swarm_pz.errors import CheckpointError
from swarm_pz.policies.learned import CARD, FORMAT, WEIGHTS, LearnedPolicy, write_atomically
from swarm_pz.policy import Player
from swarm_pz.provenance import provenance
from swarm_pz.training.callbacks import (
    Checkpoint,
    CriticFirst,
    FadingExploration,
    History,
    PeriodicEvaluation,
    Progress,
)
from swarm_pz.training.config import TrainConfig
from swarm_pz.training.networks import GridPolicy
from swarm_pz.training.vec_env import StackedVecEnv, SwarmVecEnv

CHECKPOINT, HISTORY = "checkpoint.pt", "history.json"


class Training:
    """One training run in a folder, begun afresh or taken up from its last checkpoint.

    The folder holds ``config.json``, ``checkpoint.pt``, ``history.json``, TensorBoard's events and,
    in the end, ``policy.safetensors`` with ``policy.json``.

    Parameters
    ----------
    config : TrainConfig
    folder : Path
    resume : bool
        Go on from the folder's checkpoint, if there is one.
    say : callable, optional
        Where lines of progress go.
    command : str
        What was called to begin the run; it stands on the card of the policy.

    Raises
    ------
    CheckpointError
        If the folder's checkpoint is corrupt or of another configuration.
    """

    def __init__(
        self,
        config: TrainConfig,
        folder: Path,
        *,
        resume: bool = False,
        say: Callable[[str], None] = print,
        command: str = "",
    ) -> None:
        self.config = config
        self.command = command
        self.folder = folder
        self.history = History()
        self._say = say
        self._logs = False
        self._identity = _Identity(config, load_all(config.opponents, config.game))
        self.env = _make_env(config)
        torch.set_num_threads(config.threads)
        self.model = PPO(
            GridPolicy,
            VecMonitor(self.env),
            n_steps=config.rollout,
            batch_size=min(config.batch_size, config.rollout * config.num_envs),
            n_epochs=config.epochs,
            learning_rate=lambda _: self._learning_rate(),
            gamma=config.gamma,
            gae_lambda=config.gae_lambda,
            clip_range=config.clip_range,
            ent_coef=config.entropy,
            seed=config.seed,
            device="cpu",
            policy_kwargs={"log_std_init": config.log_std, "width": config.width},
        )
        self.model.policy.log_std.requires_grad_(False)
        if config.start_from is not None:
            self._take_over(config.start_from)
        folder.mkdir(parents=True, exist_ok=True)
        if resume and (folder / CHECKPOINT).exists():
            self._load_checkpoint()
        else:  # nothing of an earlier run may be taken for this one's
            for name in (CHECKPOINT, HISTORY, WEIGHTS, CARD):
                (folder / name).unlink(missing_ok=True)
        write_atomically(
            folder / "config.json", lambda path: path.write_text(json.dumps(config.to_dict(), indent=2) + "\n")
        )

    def _learning_rate(self) -> float:
        done = self.model.num_timesteps / self.config.total_steps if hasattr(self, "model") else 0.0
        return self.config.learning_rate * max(1.0 - done, 0.05)

    def exploration(self) -> float:
        """Return the standard deviation that the learner explores with at this point of the run."""
        done = min(self.model.num_timesteps / self.config.total_steps, 1.0)
        return math.exp(self.config.log_std + done * (self.config.final_log_std - self.config.log_std))

    def _take_over(self, name: str) -> None:
        given = policies.load(name, self.config.game)
        if not isinstance(given, LearnedPolicy):
            raise CheckpointError(f"start_from must name a learned policy, got {name!r}")
        try:
            self.model.policy.actor.load_state_dict(given.weights())  # type: ignore[union-attr]
        except RuntimeError as error:
            raise CheckpointError(f"{name!r} has another network than this run trains: {_first_line(error)}") from error

    def untrained(self) -> LearnedPolicy:
        """Return the tactic of a network that has learned nothing yet, of this seed."""
        torch.manual_seed(self.config.seed)
        fresh = GridPolicy(
            self.model.observation_space,
            self.model.action_space,
            lambda _: 0.0,
            width=self.config.width,
        )
        return self._policy(fresh, "untrained")

    def policy(self) -> LearnedPolicy:
        """Return the tactic as it stands, playing its mean action."""
        return self._policy(self.model.policy, self.folder.name)  # type: ignore[arg-type]

    def _policy(self, network: GridPolicy, name: str) -> LearnedPolicy:
        card = {
            "format": FORMAT,
            "channels": list(self.config.game.observations[0].channels),
            "grid": self.config.game.observations[0].grid,
            "action_cells": self.config.action_cells,
            "width": self.config.width,
            "config_hash": self.config.game.hash,
            **provenance(self.config.game, self.command),
            "training": self.config.to_dict(),
            "steps": self.model.num_timesteps,
            "seconds": round(self.history.seconds, 1),
        }
        weights = {key: value.detach().clone().numpy() for key, value in network.actor.state_dict().items()}
        return LearnedPolicy(card, weights, self.config.game, name)

    def run(self) -> LearnedPolicy:
        """Train to the end, write the policy and return it."""
        if self.model.num_timesteps < self.config.total_steps:
            evaluation = PeriodicEvaluation(self)
            self.learn(self.config.total_steps, evaluation, Checkpoint(self), Progress(self, self._say))
            evaluation.evaluate()
            self.model.logger.close()
            self.save_checkpoint()
        policy = self.policy()
        policy.write(self.folder)
        self.env.close()
        return policy

    def learn(self, until: int, *callbacks: BaseCallback) -> None:
        """Train up to a number of steps, counted from the run's start."""
        if not self._logs:
            self.model.set_logger(Logger(None, [TensorBoardOutputFormat(str(self.folder / "tensorboard"))]))
            self._logs = True
        schedules: list[BaseCallback] = [FadingExploration(self), CriticFirst(self)]
        self.model.learn(
            until - self.model.num_timesteps,
            callback=CallbackList(schedules + list(callbacks)),
            reset_num_timesteps=self.model.num_timesteps == 0,
        )

    def save_checkpoint(self) -> None:
        """Write all that `resume` needs, atomically."""
        state = {
            "config_hash": str(self._identity),
            "steps": self.model.num_timesteps,
            "policy": self.model.policy.state_dict(),
            "optimizer": self.model.policy.optimizer.state_dict(),
            "history": self.history.to_json(),
        }
        write_atomically(self.folder / CHECKPOINT, lambda path: torch.save(state, path))
        report = json.loads(self.history.to_json()) | provenance(self.config.game, self.command)
        write_atomically(self.folder / HISTORY, lambda path: path.write_text(json.dumps(report) + "\n"))

    def _load_checkpoint(self) -> None:
        path = self.folder / CHECKPOINT
        try:
            # Arrays and numbers only: a checkpoint from elsewhere can run no code.
            state: dict[str, Any] = torch.load(path, weights_only=True)
            config_hash = state["config_hash"]
        except (OSError, RuntimeError, EOFError, LookupError, TypeError, ValueError, pickle.UnpicklingError) as error:
            raise CheckpointError(
                f"{path} is corrupt or foreign; delete it to begin afresh ({_first_line(error)})"
            ) from error
        if not self._identity.fits(config_hash):
            raise CheckpointError(
                f"{path} belongs to another configuration: give the settings in {self.folder / 'config.json'}, "
                "another folder (--out), or no resume"
            )
        try:
            self.model.policy.load_state_dict(state["policy"])
            self.model.policy.optimizer.load_state_dict(state["optimizer"])
            self.history = History.from_json(state["history"])
            self.model.num_timesteps = int(state["steps"])
        except (AttributeError, LookupError, RuntimeError, TypeError, ValueError) as error:
            raise CheckpointError(
                f"{path} does not fit this run; delete it to begin afresh ({_first_line(error)})"
            ) from error
        # Games go on from other seeds than those already played.
        stream = np.random.SeedSequence([self.config.seed, self.model.num_timesteps])
        self.env.seed(int(stream.generate_state(1)[0]))
        self._say(f"resuming {self.folder} at step {self.model.num_timesteps:,}")


def load_all(names: Sequence[str], config: GameConfig) -> list[Player]:
    """Load policies by name or folder; equal names share one object, so that they are answered together."""
    loaded = {name: policies.load(name, config) for name in names}
    return [loaded[name] for name in names]


def _make_env(config: TrainConfig) -> SwarmVecEnv | StackedVecEnv:
    def make(game: GameConfig, num_envs: int, seed: int) -> SwarmVecEnv:
        return SwarmVecEnv(
            game,
            num_envs,
            opponent=load_all(config.opponents, game),
            action_cells=config.action_cells,
            threads=config.threads,
            seed=seed,
        )

    if not config.sizes:
        return make(config.game, config.num_envs, config.seed)
    games = [config.game.replace(drones_per_team=size) for size in config.sizes]
    env = StackedVecEnv([make(game, config.num_envs // len(games), config.seed) for game in games])
    env.seed(config.seed)
    return env


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]


class _Identity:
    """What a checkpoint belongs to: all but how long and on how many threads the run is.

    A learned opponent counts as what it is, and not only as what its folder is called.
    """

    def __init__(self, config: TrainConfig, opponents: Sequence[Player]) -> None:
        self._settings = config.replace(total_steps=1, threads=1, evaluate_every=1, checkpoint_every=1)
        digests = sorted({player.digest for player in opponents if isinstance(player, LearnedPolicy)})
        self._opponents = [digest[:16] for digest in digests]

    def __str__(self) -> str:
        return "-".join([self._settings.hash, *self._opponents])

    def fits(self, found: object) -> bool:
        """Tell whether an identity that was found in a file is this one."""
        settings, *opponents = str(found).split("-")
        return self._settings.has_hash(settings) and opponents == self._opponents
