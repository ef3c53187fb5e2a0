"""Imitation: an actor learns the commands of another policy, or of the best responses to a population."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.evaluation.workers import silent
from swarm_pz.policies.network import Actor
from swarm_pz.policies.pattern import PatternPlayer
from swarm_pz.policy import Player, load
from swarm_pz.simulator.commands import interpolation_matrix
from swarm_pz.spaces.actions import LOG_DENSITY_RANGE
from swarm_pz.training.oracle import Population, play

Array = NDArray[np.float64]
Lessons = tuple[NDArray[np.uint8], NDArray[np.float64]]

_RECORDED, _STEPS, _BATCH = 40_000, 1_000, 256
"""Most commands that are learned from, steps of the optimizer, and commands in each."""
_LESSONS, _LESSON, _LONG = 3, 60_000, 6_000
"""Times that the learner plays while best responses are asked, commands that each adds, and steps of the optimizer."""
_MET, _TRIED, _AGAINST = 6, 10, 24
"""Games against each pattern, those in which each response is tried against a policy, and those of the best one."""


class _Recorded(Rollout):
    """Games in which a learner's observations are kept with the first player's commands, or those of an expert.

    The expert is asked what it would command in the first player's place.
    """

    def __init__(self, seeing: ObservationConfig, expert: Any, *args: Any, **options: Any) -> None:
        super().__init__(*args, **options)
        self._seeing, self._expert = seeing, expert
        self._kept: list[tuple[NDArray[np.uint8], NDArray[np.float64]]] = []
        if expert is not None:
            expert.reset([np.random.SeedSequence(int(row)) for row in self.rows], self.rows)

    def ask(self) -> NDArray[np.float64]:
        """Return the commands of both players, as `Rollout.ask`."""
        teams = self.sides[0, self.rows]
        seen = np.asarray(self.batch.see(self._seeing, teams, self.rows))
        wanted = None
        if self._expert is not None:
            wanted = self._expert.act(self.batch.see(self._expert.observation, teams, self.rows), self.rows)
        commands = super().ask()
        self._kept.append((seen, commands[self.rows, teams] if wanted is None else np.asarray(wanted)))
        return commands

    def lessons(self) -> Lessons:
        """Play to the end, and return observations (n, C, G, G) with densities (n, A, A)."""
        self.play()
        seen, wanted = zip(*self._kept, strict=True)
        return np.concatenate(seen), np.concatenate(wanted)


def recorded(target: str, game: GameConfig, games: int, seed: int) -> Lessons:
    """Return observations (n, C, G, G) as of `game`, and a policy's densities (n, A, A), which add up to 1.

    They are drawn from games against itself and against uniform coverage.
    """
    numbers, kept = range(max(games // 2, 2)), []
    for opponent in (target, "uniform"):
        rollout = _Recorded(game.observations[0], None, target, opponent, numbers, seed=seed, config=game)
        with closing(rollout):
            kept.append(rollout.lessons())
    return _drawn(kept, _RECORDED, seed)


def _drawn(kept: Sequence[Lessons], count: int, seed: int) -> Lessons:
    """Return at most so many of some lessons, with densities that add up to 1."""
    seen, commands = (np.concatenate(parts) for parts in zip(*kept, strict=True))
    chosen = np.random.default_rng(seed).permutation(len(seen))[:count]
    wanted = commands[chosen] + 1e-9
    return seen[chosen], wanted / wanted.sum(axis=(1, 2), keepdims=True)


def imitate_best_responses(
    actor: Actor,
    player: Callable[[], Player],
    population: Population,
    opponents: Sequence[str],
    game: GameConfig,
    seed: int,
    *,
    say: Callable[[str], None] = silent,
) -> None:
    """Fit an actor to the patterns that beat others most: those of a population, and policies by name.

    First the patterns play, and then `player`, the actor as it stands, while they say what they would command (Ross et
    al., "A reduction of imitation learning and structured prediction to no-regret online learning", AISTATS 2011).
    """
    n, generator = len(population.numbers), np.random.default_rng(seed)
    responses = np.argmax(population.shares, axis=0)
    met = np.concatenate([np.repeat(np.arange(n), _MET), generator.choice(n, size=2 * n, p=population.equilibrium)])
    games: list[tuple[Any, Array]] = [(population.numbers[met], population.numbers[responses[met]])]
    experts = population.numbers[np.unique(responses)]
    for name in opponents:
        opponent = load(name, game)
        tried = play(np.repeat(experts, _TRIED, axis=0), opponent, game, seed=seed)
        best = experts[np.argmax(tried.reshape(-1, _TRIED).mean(axis=1))]
        games.append((name, np.repeat(best[None], _AGAINST, axis=0)))
    kept: list[Lessons] = []
    for number in range(_LESSONS + 1):
        shares = []
        for opponent, expert in games:
            against = PatternPlayer(opponent, game) if isinstance(opponent, np.ndarray) else load(opponent, game)
            first = player() if number else PatternPlayer(expert, game)
            numbers = range(len(expert))
            shown = PatternPlayer(expert, game)
            rollout = _Recorded(game.observations[0], shown, first, against, numbers, seed=seed + number, config=game)
            with closing(rollout):
                kept.append(rollout.lessons())
                shares.append(np.mean([one.share for one in rollout.games()]))
        who = "learner" if number else "best responses"
        say(
            f"imitation {number}: {shares[0]:.2f} of the drones for the {who} against patterns, "
            f"{np.mean(shares[1:]):.2f} against others"
        )
        fit(actor, *_drawn(kept, _LESSON * (number + 1), seed), seed + number, steps=_LONG)


def fit(actor: Actor, seen: NDArray[np.uint8], wanted: NDArray[np.float64], seed: int, *, steps: int = _STEPS) -> None:
    """Fit an actor's densities to those wanted, by their cross entropy."""
    optimizer = torch.optim.Adam(actor.parameters(), lr=2e-3)
    rate = torch.optim.lr_scheduler.LinearLR(optimizer, 1.0, 0.05, total_iters=steps)
    generator = np.random.default_rng(seed)
    for _ in range(steps):
        part = generator.integers(len(seen), size=_BATCH)
        actions = actor(torch.from_numpy(seen[part]).float() / 255.0)
        fine = torch.from_numpy(interpolation_matrix(wanted.shape[-1], actions.shape[-1])).float()
        logs = LOG_DENSITY_RANGE * (fine @ actions @ fine.T).flatten(1)
        entropy = -(torch.from_numpy(wanted[part]).float().flatten(1) * logs.log_softmax(dim=1)).sum(dim=1).mean()
        beyond = torch.relu(actions.abs() - 1.0).square().mean()  # actions are cut to [-1, 1]
        optimizer.zero_grad()
        (entropy + beyond).backward()
        optimizer.step()
        rate.step()
