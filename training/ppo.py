"""Train a tactic with Stable-Baselines3's PPO, in a folder that a run can be resumed from."""

from __future__ import annotations

import functools
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback, CallbackList
from stable_baselines3.common.logger import Logger, TensorBoardOutputFormat
from stable_baselines3.common.vec_env import VecEnv, VecMonitor

from swarm_pz import files, policies
from swarm_pz.errors import CheckpointError
from swarm_pz.evaluation.provenance import provenance
from swarm_pz.evaluation.workers import never
from swarm_pz.files import write_json
from swarm_pz.policies.learned import LearnedPolicy, lineage
from swarm_pz.policies.network import Actor
from swarm_pz.policy import load
from swarm_pz.training import checkpoint
from swarm_pz.training.callbacks import Account, Checkpoint, PeriodicEvaluation, Progress, RunState, Schedules
from swarm_pz.training.checkpoint import BEGIN_AFRESH, CHECKPOINT, Story
from swarm_pz.training.config import MAY_CHANGE, TrainConfig
from swarm_pz.training.imitation import fit, recorded
from swarm_pz.training.networks import DronesPolicy, GridPolicy, as_policy, policy_class
from swarm_pz.training.vec_env import StackedVecEnv, SwarmVecEnv

HISTORY, SETTINGS = "history.json", "config.json"

_IMITATED_GAMES = 200
"""Games to record for imitation, if a run starts from a policy without weights."""


class _Learner(PPO):
    """PPO that passes images to its network unchanged."""

    @staticmethod
    def _wrap_env(env: Any, verbose: int = 0, monitor_wrapper: bool = True) -> VecEnv:  # noqa: ARG004
        """Skip SB3's wrappers, which would take an image's channels for its columns if there are many."""
        assert isinstance(env, VecEnv)  # noqa: S101  (as `Training` makes it)
        return env


class Training:
    """One training run in a folder, which continues from its last checkpoint if there is one.

    The folder holds ``config.json``, ``checkpoint.safetensors``, ``history.json``, the curves in ``tensorboard`` and,
    in the end, ``policy.safetensors`` with ``policy.json``, whose card names the `command`. A resumed run has the
    weights, the optimizer and the counters of its checkpoint, and plays new games. Raises a CheckpointError if the
    folder holds another run, or a corrupt checkpoint, and an OutputError if it cannot be written to.
    """

    def __init__(
        self,
        config: TrainConfig,
        folder: Path,
        *,
        say: Callable[[str], None] = print,
        command: str = "",
    ) -> None:
        is_begun = checkpoint.is_begun(folder, CHECKPOINT)
        self.config, self.folder, self.command = config, folder, command
        self.state = RunState(config)
        self.stored: Story = {}
        self._ancestors: list[dict[str, Any]] = []
        self._say = say
        self._identity = _identity_of(config)
        self.env = _make_env(config)
        torch.set_num_threads(config.threads)
        self.model = _Learner(
            policy_class(config.game),
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
            self._start_from(config.start_from, is_begun=is_begun)
        self._streams = checkpoint.random_streams()
        files.check_folder(folder)
        if is_begun:
            self._load_checkpoint()
        write_json(folder / SETTINGS, config.to_dict())
        if not is_begun:
            self.save_checkpoint()

    def _learning_rate(self) -> float:
        done = self.model.num_timesteps / self.config.total_steps if hasattr(self, "model") else 0.0
        return self.config.learning_rate * max(1.0 - done, 0.05)

    def _start_from(self, name: str, *, is_begun: bool) -> None:
        policy, actor = policies.load(name, self.config.game), self.model.policy.actor
        if not isinstance(policy, LearnedPolicy):
            if not isinstance(actor, Actor):
                raise CheckpointError(f"start_from must name a learned policy, got {name!r}")
            if not is_begun:
                imitated = recorded(name, self.config.game, _IMITATED_GAMES, self.config.seed)
                fit(actor, *imitated, self.config.seed)
            return
        parent, *older = lineage(policy.card)
        self._ancestors = [parent | {"name": policy.name}, *older]
        try:
            actor.load_state_dict(policy.weights())  # type: ignore[union-attr]
        except RuntimeError as error:
            raise CheckpointError(f"{name!r} has another network than this run trains: {_first_line(error)}") from error

    def untrained(self) -> LearnedPolicy:
        """Return the tactic of this seed's network before any training."""
        with checkpoint.random_streams_kept():
            torch.manual_seed(self.config.seed)
            spaces = self.model.observation_space, self.model.action_space
            fresh = policy_class(self.config.game)(*spaces, lambda _: 0.0, width=self.config.width)
        return self._policy(fresh, "untrained")

    def policy(self) -> LearnedPolicy:
        """Return the tactic trained so far; it plays its mean action."""
        return self._policy(self.model.policy, self.folder.name)  # type: ignore[arg-type]

    def _policy(self, network: GridPolicy | DronesPolicy, name: str) -> LearnedPolicy:
        steps, seconds = self.model.num_timesteps, self.state.seconds
        fields: dict[str, Any] = {"steps": steps, "seconds": seconds, "command": self.command}
        return as_policy(network, self.config, name, **fields, ancestors=self._ancestors)

    @property
    def is_finished(self) -> bool:
        """True if nothing is left to train."""
        return self.model.num_timesteps >= self.config.total_steps

    def say_finished(self) -> None:
        """Say that nothing is left to train."""
        self._say(
            f"{self.folder} is finished, and nothing is trained: it has had {self.model.num_timesteps:,} of "
            f"{self.config.total_steps:,} steps; ask for more to go on"
        )

    def standing(self) -> str:
        """Return a sentence with the steps so far."""
        return f"{self.folder} is saved at step {self.model.num_timesteps:,} of {self.config.total_steps:,}"

    def run(self, should_stop: Callable[[], bool] = never) -> LearnedPolicy:
        """Train to the end, write the policy and return it.

        If `should_stop` returns True between two rollouts, a checkpoint is saved and Stopped is raised.
        """
        if self.is_finished:
            self.say_finished()
        else:
            evaluation = PeriodicEvaluation(self.state, self.policy)
            stops = Checkpoint(self.state, self.save_checkpoint, should_stop, self.standing)
            with closing(self.logger):
                self.learn(self.config.total_steps, evaluation, stops, Progress(self.state, self._say))
                evaluation.evaluate()
            self.save_checkpoint()
        policy = self.policy()
        policy.write(self.folder)
        self.env.close()
        return policy

    @functools.cached_property
    def logger(self) -> Logger:
        """Logger of this process's curves."""
        return Logger(None, [TensorBoardOutputFormat(str(self.folder / "tensorboard"))])

    def learn(self, until: int, *callbacks: BaseCallback) -> None:
        """Train up to a number of steps, counted from the run's start."""
        self.model.set_logger(self.logger)
        # SB3 draws from the process's random streams: set them to this run's, and restore them afterwards.
        with checkpoint.random_streams_kept():
            checkpoint.set_random_streams(self._streams)
            self.model.learn(
                until - self.model.num_timesteps,
                callback=CallbackList([Schedules(self.state), Account(self.state), *callbacks]),
                reset_num_timesteps=self.model.num_timesteps == 0,
            )
            self._streams = checkpoint.random_streams()

    # --- checkpoints ------------------------------------------------------------------------------

    def save_checkpoint(self, **more: Any) -> None:
        """Write the learner, its history and `more` atomically; call it only between two rollouts."""
        learner, arrays = checkpoint.learner_state(self.model)
        history = {"seconds": self.state.seconds, "records": self.state.records}
        story = {
            "config_hash": self._identity,
            "total_steps": self.config.total_steps,
            "finished": self.is_finished,
            "learner": learner,
            "recent": list(self.state.recent),
            "history": history,
            **more,
        }
        checkpoint.write(self.folder / CHECKPOINT, story, arrays)
        write_json(self.folder / HISTORY, history | provenance(self.config.game, self.command))

    def _load_checkpoint(self) -> None:
        path = self.folder / CHECKPOINT
        story, arrays = checkpoint.read(path)
        if story.get("config_hash") != self._identity:
            raise CheckpointError(
                f"{path} belongs to another configuration: give the settings in {self.folder / SETTINGS}, or another "
                "folder (--out)"
            )
        try:
            checkpoint.restore_learner(self.model, story["learner"], arrays)
            self.state.records = list(story["history"]["records"])
            self.state.seconds = float(story["history"]["seconds"])
            self.state.recent.extend((bool(won), float(share)) for won, share in story["recent"])
            total = int(story["total_steps"])
        except (AttributeError, LookupError, RuntimeError, TypeError, ValueError) as error:
            raise CheckpointError(f"{path} does not fit this run ({_first_line(error)}); {BEGIN_AFRESH}") from error
        self.stored = story
        # A new seed, so that games and noise do not repeat.
        fresh = np.random.SeedSequence([self.config.seed, self.model.num_timesteps]).generate_state(1)
        self.model.set_random_seed(int(fresh[0]))
        self._streams = checkpoint.random_streams()
        self._say(f"resuming {self.folder} at step {self.model.num_timesteps:,}")
        if total != self.config.total_steps:
            self._say(
                f"the run was to have {total:,} steps: learning rate and exploration fall from here on as in one of "
                f"{self.config.total_steps:,}"
            )


def _make_env(config: TrainConfig) -> SwarmVecEnv | StackedVecEnv:
    games = [config.game.replace(drones_per_team=size) for size in config.sizes] or [config.game]
    parts = [
        SwarmVecEnv(
            game,
            config.num_envs // len(games),
            opponent=config.opponents,
            action_cells=config.action_cells if game.team_systems[0].takes == "density" else None,
            threads=config.threads,
        )
        for game in games
    ]
    env = StackedVecEnv(parts) if config.sizes else parts[0]
    env.seed(config.seed)
    return env


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]


def _identity_of(config: TrainConfig) -> str:
    """Return a digest of all settings but `MAY_CHANGE`, and of learned opponents."""
    opponents = (load(name, config.game, config.game.team_systems[1]) for name in set(config.opponents))
    digests = {player.digest for player in opponents if isinstance(player, LearnedPolicy)}
    return "-".join([config.replace(**MAY_CHANGE).hash, *(digest[:16] for digest in sorted(digests))])
