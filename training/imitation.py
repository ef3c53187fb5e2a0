"""Imitation: an actor learns the commands of a policy, from games that the policy plays."""

from __future__ import annotations

from contextlib import closing
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.policies.network import Actor
from swarm_pz.simulator.commands import interpolation_matrix
from swarm_pz.spaces.actions import LOG_DENSITY_RANGE

_RECORDED, _BATCH = 40_000, 256
"""Largest number of commands to learn from, and batch size."""


class _Recorded(Rollout):
    """Games that record the first player's commands, with a learner's observations from that side."""

    def __init__(self, seeing: ObservationConfig, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._seeing = seeing
        self.kept: list[tuple[NDArray[np.uint8], NDArray[np.float64]]] = []

    def ask(self) -> NDArray[np.float64]:
        """Return the commands of both players, as `Rollout.ask`."""
        teams = self.sides[0, self.rows]
        observations = np.asarray(self.batch.see(self._seeing, teams, self.rows))
        commands = super().ask()
        self.kept.append((observations, commands[self.rows, teams]))
        return commands


def recorded(target: str, game: GameConfig, games: int, seed: int) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Return observations (n, C, G, G) as `game` defines them, and a policy's densities (n, A, A), which sum to 1.

    They are sampled from games of the policy against itself and against uniform coverage.
    """
    numbers, kept = range(max(games // 2, 2)), []
    for opponent in (target, "uniform"):
        with closing(_Recorded(game.observations[0], target, opponent, numbers, seed=seed, config=game)) as rollout:
            rollout.play()
            kept += rollout.kept
    observations, commands = (np.concatenate(parts) for parts in zip(*kept, strict=True))
    chosen = np.random.default_rng(seed).permutation(len(observations))[:_RECORDED]
    wanted = commands[chosen] + 1e-9
    return observations[chosen], wanted / wanted.sum(axis=(1, 2), keepdims=True)


def fit(actor: Actor, images: NDArray[np.uint8], wanted: NDArray[np.float64], seed: int, steps: int = 1_000) -> None:
    """Fit an actor's densities to those wanted, with a cross-entropy loss."""
    optimizer = torch.optim.Adam(actor.parameters(), lr=2e-3)
    rate = torch.optim.lr_scheduler.LinearLR(optimizer, 1.0, 0.05, total_iters=steps)
    generator = np.random.default_rng(seed)
    for _ in range(steps):
        part = generator.integers(len(images), size=_BATCH)
        actions = actor(torch.from_numpy(images[part]).float() / 255.0)
        fine = torch.from_numpy(interpolation_matrix(wanted.shape[-1], actions.shape[-1])).float()
        logs = LOG_DENSITY_RANGE * (fine @ actions @ fine.T).flatten(1)
        entropy = -(torch.from_numpy(wanted[part]).float().flatten(1) * logs.log_softmax(dim=1)).sum(dim=1).mean()
        beyond = torch.relu(actions.abs() - 1.0).square().mean()  # actions are clipped to [-1, 1]
        optimizer.zero_grad()
        (entropy + beyond).backward()
        optimizer.step()
        rate.step()
