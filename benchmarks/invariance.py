"""Learned policies in teams of other sizes, with the board turned, and with drones renumbered, against `uniform`.

    python -m benchmarks.invariance --table docs/tables/invariance.csv

Plays `hunter` and the first run of some methods of `benchmarks.algorithms`, which learned in teams of 10; trains what
is not trained yet. Stopped, it goes on with what is trained. A policy that is invariant answers a turned board with its
own answer turned, and drones that are renumbered with its own answer.
"""

from __future__ import annotations

import argparse
import dataclasses
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.torch_layers import CombinedExtractor

from benchmarks.algorithms.methods import METHODS
from benchmarks.algorithms.runs import SEED, Budget, run
from benchmarks.csv_table import write_csv
from swarm_pz.config import GameConfig
from swarm_pz.evaluation.match import play_match
from swarm_pz.policy import Policy, load
from swarm_pz.simulator.spawn import Seed

SIZES, AS_IS = (3, 10, 30, 100), "as it is"
HEAD = "policy", "drones a team", "shown", "won", "drawn", "lost", "share of drones", "answer moved", "answer uneven"
LISTS = "ppo-lists"
"""As `ppo-sets`, but its network takes the lists entry after entry. Both only play the size that they have learned."""


class Changed:
    """A policy that sees each second's board turned, or its drones renumbered, at random, and answers for the original.

    `parts` says how much of each answer lies elsewhere than the answer to the original, and how much of the latter lies
    elsewhere than uniform coverage.
    """

    def __init__(self, policy: Policy) -> None:
        self.observation, self._policy = policy.observation, policy
        self._generator = np.random.default_rng(0)
        self.parts: list[NDArray[np.float64]] = []

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games in some rows."""
        self._policy.reset(seeds, rows)

    def act(self, observations: Any, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        """Answer n observations with densities."""
        ask = self._renumbered if isinstance(observations, dict) else self._turned
        original, answer = self._policy.act(observations, rows), ask(observations, rows)
        one, other, even = (x / x.sum(axis=(1, 2), keepdims=True) for x in (original, answer, np.ones_like(answer)))
        self.parts.append(0.5 * np.abs([one - other, one - even]).sum(axis=(2, 3)))
        return answer

    def _turned(self, images: Any, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        turns, flip = divmod(int(self._generator.integers(1, 8)), 2)  # all but the board as it is
        seen = np.rot90(images[..., ::-1] if flip else images, turns, (2, 3))
        answer = np.rot90(self._policy.act(np.ascontiguousarray(seen), rows), -turns, (1, 2))
        return answer[..., ::-1] if flip else answer

    def _renumbered(self, lists: Any, rows: NDArray[np.int64]) -> NDArray[np.float64]:
        seen = dict(lists)
        for side in ("own", "opposing"):
            there = lists[f"{side}_mask"]
            order = np.argsort(self._generator.random(there.shape) - there, axis=1)  # what is there stays in front
            for part in ("positions", "velocities"):
                seen[f"{side}_{part}"] = np.take_along_axis(lists[f"{side}_{part}"], order[..., None], axis=1)
        return self._policy.act(seen, rows)


def play(name: str, player: str, how: str, size: int, games: int) -> tuple[Any, ...]:
    """Play a policy, shown the game as it is or changed, and return a row of the table."""
    config = GameConfig(drones_per_team=size)
    policy: Any = load(player, config)
    shown = policy if how == AS_IS else Changed(policy)
    match = play_match(shown, "uniform", games=games, seed=SEED, config=config)
    counts = (match.count(outcome) for outcome in ("win", "draw", "loss"))
    parts = np.concatenate(shown.parts, axis=1).mean(axis=1) if isinstance(shown, Changed) else None
    told = ["", ""] if parts is None else [f"{part:.3f}" for part in parts]
    return name, size, how, *counts, f"{match.share():.2f}", *told


def main() -> None:
    """Train what is not trained yet, play, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--commands", type=int, default=Budget().commands, help="that each run learns from")
    parser.add_argument("--games", type=int, default=100)
    parser.add_argument("--out", type=Path, default=Path("runs/algorithms"), help="folder of policies")
    parser.add_argument("--table", type=Path, default=Path("runs/invariance/table.csv"))
    options = parser.parse_args()
    sets = METHODS["ppo-sets"]
    layers = partial(sets.learner, features_extractor_class=CombinedExtractor)
    METHODS[LISTS] = dataclasses.replace(sets, learner=layers)
    rows: list[tuple[Any, ...]] = [HEAD]
    for name in ("hunter", "ppo", "ppo-mlp", "ppo-sets", LISTS):
        player = name
        if name in METHODS:
            run(name, 0, Budget(commands=options.commands), options.out)
            player = str(options.out / f"{name}-0")
        sees_lists = name in (LISTS, "ppo-sets")
        shown = [("renumbered", 10), (AS_IS, 10)] if sees_lists else [("turned", 10), *((AS_IS, n) for n in SIZES)]
        for how, size in shown:
            rows.append(play(name, player, how, size, options.games))
            print(*rows[-1], flush=True)
    write_csv(options.table, rows)


if __name__ == "__main__":
    main()
