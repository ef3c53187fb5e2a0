"""Imitation: an actor learns the commands of a policy, of best responses to a population, or of several teachers."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from swarm_pz.config import GameConfig, ObservationConfig
from swarm_pz.evaluation.rollout import Rollout
from swarm_pz.evaluation.workers import never, silent
from swarm_pz.policies.network import Actor
from swarm_pz.policies.pattern import PatternPlayer
from swarm_pz.policy import Player, load
from swarm_pz.simulator.commands import interpolation_matrix
from swarm_pz.spaces.actions import LOG_DENSITY_RANGE
from swarm_pz.training.oracle import Population, play

Array = NDArray[np.float64]
Examples = tuple[NDArray[np.uint8], NDArray[np.float64]]

_RECORDED, _STEPS, _BATCH = 40_000, 1_000, 256
"""Most commands that are learned from, steps of the optimizer, and commands in each."""
_KEPT, _REMEMBERED, _LONG = 80, 300_000, 2_500
"""Most commands of a game, and of all, that are learned from while teachers are asked, and steps of the optimizer."""
_MET, _TRIED, _AGAINST = 6, 10, 20
"""Games against each pattern, those in which a teacher is tried, and those in which one is asked."""
_ENOUGH = 0.06
"""Share of the drones by which a teacher may do worse than the best."""


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

    def examples(self) -> Examples:
        """Play to the end, and return observations (n, C, G, G) with densities (n, A, A)."""
        self.play()
        seen, wanted = zip(*self._kept, strict=True)
        return np.concatenate(seen), np.concatenate(wanted)


def recorded(target: str, game: GameConfig, games: int, seed: int) -> Examples:
    """Return observations (n, C, G, G) as of `game`, and a policy's densities (n, A, A), which add up to 1.

    They are drawn from games against itself and against uniform coverage.
    """
    numbers, kept = range(max(games // 2, 2)), []
    for opponent in (target, "uniform"):
        rollout = _Recorded(game.observations[0], None, target, opponent, numbers, seed=seed, config=game)
        with closing(rollout):
            kept.append(rollout.examples())
    return _drawn(kept, _RECORDED, seed)


def _drawn(kept: Sequence[Examples], count: int, seed: int) -> Examples:
    """Return at most so many of some examples, with densities that add up to 1."""
    seen, commands = (np.concatenate(parts) for parts in zip(*kept, strict=True))
    chosen = np.random.default_rng(seed).permutation(len(seen))[:count]
    wanted = commands[chosen] + 1e-9
    return seen[chosen], wanted / wanted.sum(axis=(1, 2), keepdims=True)


@dataclass(frozen=True)
class Lesson:
    """Games of a learner against an opponent, in which a teacher tells what it would command in the learner's place.

    Both are policies, or patterns (n, 13), one for each game.
    """

    opponent: str | Array
    teacher: str | Array
    games: int


def learn(
    actor: Actor,
    player: Callable[[], Player],
    lessons: Sequence[Lesson],
    game: GameConfig,
    seed: int,
    *,
    rounds: int = 3,
    say: Callable[[str], None] = silent,
    should_stop: Callable[[], bool] = never,
) -> int:
    """Fit an actor to the teachers of some lessons, and return how many commands were played for it.

    First the teachers play, and then, in each round, `player`, the actor as it stands (Ross et al., "A reduction of
    imitation learning and structured prediction to no-regret online learning", AISTATS 2011). A stop ends the rounds.
    """
    kept: Examples | None = None
    played = 0
    for number in range(rounds + 1):
        if number and should_stop():
            say(f"stopped after {number - 1} of {rounds} rounds")
            break
        shares, found = [], []
        for place, lesson in enumerate(lessons):
            games = seed + number * len(lessons) + place
            teacher = _player(lesson.teacher, game)
            players = player() if number else _player(lesson.teacher, game), _player(lesson.opponent, game)
            rollout = _Recorded(game.observations[0], teacher, *players, range(lesson.games), seed=games, config=game)
            with closing(rollout):
                told = rollout.examples()
                played += len(told[0])
                found.append(_drawn([told], _KEPT * lesson.games, games))
                shares.append(float(np.mean([one.share for one in rollout.games()])))
        kept = _drawn(found if kept is None else [kept, *found], _REMEMBERED, seed + number)
        played_by = "the learner ends" if number else "the teachers end"
        hardest = lessons[int(np.argmin(shares))].opponent
        say(
            f"imitation {number} of {rounds}: {played_by} with {np.mean(shares):.2f} of the drones, and with "
            f"{min(shares):.2f} against {hardest if isinstance(hardest, str) else 'patterns'}"
        )
        fit(actor, *kept, seed + number, steps=_LONG * (1 + (number == rounds)), batch=2 * _BATCH)
    return played


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
    """Fit an actor to the patterns that beat others most: those of a population, and policies by name."""
    n, generator = len(population.numbers), np.random.default_rng(seed)
    responses = np.argmax(population.shares, axis=0)
    met = np.concatenate([np.repeat(np.arange(n), _MET), generator.choice(n, size=2 * n, p=population.equilibrium)])
    best = Lesson(population.numbers[met], population.numbers[responses[met]], len(met))
    experts = [one[None] for one in population.numbers[np.unique(responses)]]
    learn(
        actor, player, [best, *lessons_of(experts, opponents, population.numbers[:0], game, seed)], game, seed, say=say
    )


def lessons_of(
    teachers: Sequence[str | Array],
    opponents: Sequence[str],
    patterns: Array,
    game: GameConfig,
    seed: int,
    *,
    say: Callable[[str], None] = silent,
) -> list[Lesson]:
    """Return lessons against opponents, and against patterns (n, 13), of the teachers that beat each of them.

    Each is taught by the first of the teachers that ends with as much as the best, but for `_ENOUGH`: what few teachers
    say is easier to learn.
    """

    def tried(opponent: str | Array, games: int) -> Array:
        shares = [play(_player(one, game), _player(opponent, game), games, game, seed) for one in teachers]
        return np.asarray(np.stack(shares).reshape(len(teachers), -1, _TRIED).mean(axis=2))

    def first(means: Array) -> NDArray[np.intp]:
        return np.asarray(np.argmax(means >= means.max(axis=0) - _ENOUGH, axis=0))

    lessons = [Lesson(name, teachers[int(first(tried(name, _TRIED))[0])], _AGAINST) for name in opponents]
    if len(patterns):
        which = first(tried(np.repeat(patterns, _TRIED, axis=0), _TRIED * len(patterns)))
        for teacher in np.unique(which):
            own = np.repeat(patterns[which == teacher], 2, axis=0)
            lessons.append(Lesson(own, teachers[teacher], len(own)))
            say(f"{teachers[teacher]} teaches against {len(own) // 2} patterns")
    for line in dict.fromkeys(f"{one.teacher} teaches against {one.opponent}" for one in lessons[: len(opponents)]):
        say(line)
    return lessons


def _player(of: str | Array, game: GameConfig) -> Player:
    return load(of, game) if isinstance(of, str) else PatternPlayer(of, game)


def fit(
    actor: Actor,
    seen: NDArray[np.uint8],
    wanted: NDArray[np.float64],
    seed: int,
    *,
    steps: int = _STEPS,
    batch: int = _BATCH,
) -> None:
    """Fit an actor's densities to those wanted, by their cross entropy."""
    optimizer = torch.optim.Adam(actor.parameters(), lr=2e-3)
    rate = torch.optim.lr_scheduler.LinearLR(optimizer, 1.0, 0.05, total_iters=steps)
    generator = np.random.default_rng(seed)
    for _ in range(steps):
        part = generator.integers(len(seen), size=batch)
        actions = actor(torch.from_numpy(seen[part]).float() / 255.0)
        fine = torch.from_numpy(interpolation_matrix(wanted.shape[-1], actions.shape[-1])).float()
        logs = LOG_DENSITY_RANGE * (fine @ actions @ fine.T).flatten(1)
        entropy = -(torch.from_numpy(wanted[part]).float().flatten(1) * logs.log_softmax(dim=1)).sum(dim=1).mean()
        beyond = torch.relu(actions.abs() - 1.0).square().mean()  # actions are cut to [-1, 1]
        optimizer.zero_grad()
        (entropy + beyond).backward()
        optimizer.step()
        rate.step()
