"""Games of parked and hidden teams: teams that rest, and drawings that never change.

The rows of docs/tables/parking.csv; docs/parking.md proves when a parked drone is safe.

python -m benchmarks.parking --games 40 > docs/tables/parking.csv
"""

from __future__ import annotations

import argparse
import csv
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CaptureConfig, GameConfig, MemoryConfig
from swarm_pz.evaluation.match import play_match
from swarm_pz.evaluation.rollout import Game
from swarm_pz.policies.commanders import GameState, Script, commander
from swarm_pz.policies.scripted import CLOCK, Tactic, View, tactic, uniform
from swarm_pz.policy import Player, load
from swarm_pz.spaces.densities import disc

LEARNED = ("veteran", "champion")
Array = NDArray[np.float64]


@tactic(sees=CLOCK)
def corner(view: View) -> Array:
    """Send everyone to a disc of 0.07 at (0.95, 0.95), and never change it."""
    return view.every(disc(np.hypot(view.x - 0.95, view.y - 0.95), 0.07))


@tactic(sees=CLOCK)
def noisy_uniform(view: View) -> Array:
    """Cover evenly with 1 % of noise, new in every command."""
    return np.asarray(1.0 + 0.01 * view.random())


def drawings(count: int, seed: int) -> Iterator[Tactic]:
    """Return drawings that never change: discs of any width near corners and walls."""
    generator = np.random.default_rng(seed)
    for _ in range(count):
        along, wall, width = generator.random(), generator.integers(4), generator.uniform(0.05, 0.15)
        inset = generator.uniform(0.03, 0.12)
        x, y = [(along, inset), (along, 1 - inset), (inset, along), (1 - inset, along)][wall]

        def play(view: View, x: float = x, y: float = y, width: float = width) -> Array:
            return view.every(disc(np.hypot(view.x - x, view.y - y), width))

        yield Tactic(play, uniform.observation)


def resting(shape: int, place: float, size: float) -> Script:
    """Return a player that asks for one formation, on the square's diagonal, and never changes it."""

    @commander("formation")
    def rest(_: GameState) -> Any:
        return [shape, place, place, size, 0.0]

    return rest


FORMATIONS = [
    resting(*numbers)
    for numbers in ((0, 0.5, 0.25), (0, 0.3, 0.15), (1, 0.5, 0.3), (2, 0.5, 0.4), (3, 0.6, 0.3), (4, 0.5, 0.3))
]
"""Two rings, a disc, a line, a wedge and a grid: shape, place and size."""


@dataclass(frozen=True, kw_only=True)
class Side:
    """Policy and control system of a team."""

    player: str | Tactic | Script
    system: str = "ergodic"

    def make(self, config: GameConfig, team: int) -> Player:
        """Return the player, made for a game."""
        if not isinstance(self.player, str):
            return self.player(config)
        return load(self.player, config, config.team_systems[team])

    @property
    def name(self) -> str:
        """Name in the table."""
        name = self.player if isinstance(self.player, str) else self.player.__name__
        return name if self.system == "ergodic" else f"{name}, flown by {self.system}"


def play(first: Side, second: Side, games: int, preset: str = "paper", **rules: Any) -> list[Game]:
    """Play a match under changed rules; return the games that count."""
    config = GameConfig.preset(preset).replace(controllers=(first.system, second.system), **rules)
    return play_match(first.make(config, 0), second.make(config, 1), games=games, seed=36, config=config).unique


VARIANTS: dict[str, dict[str, Any]] = {
    "": {},
    ", threshold 0.5": {"capture": CaptureConfig(threshold=0.5)},
    ", threshold 0.9": {"capture": CaptureConfig(threshold=0.9)},
    ", trail of 1 s": {"memory": MemoryConfig(trail=1.0)},
    ", trail of 30 s": {"memory": MemoryConfig(trail=30.0)},
    ", preset released": {"preset": "released"},
}
"""Rules under which a parked team is tried."""


def rows(games: int) -> Iterator[tuple[str, str, str, list[Game]]]:
    """Play the rows one by one, and yield each one's title, two sides and games."""
    parked = Side(player="hold", system="formation")
    for rules, changed in VARIANTS.items():
        for name in LEARNED if not rules else LEARNED[:1]:
            yield f"a parked team{rules}", parked.name, name, play(parked, Side(player=name), games, **changed)
    for name in ("uniform", LEARNED[0]):
        both = play(parked, Side(player=name), 2 * games, drones_per_team=(1, 19))
        yield "one parked drone of 20", parked.name, name, [game for game in both if game.side == "red"]
    pairs = combinations([Side(player=one, system="formation") for one in FORMATIONS], 2)
    duels = [play(one, other, max(2, games // 5), time_limit=120.0) for one, other in pairs]
    yield "15 pairs of resting formations, 120 s", "formation", "formation", [game for match in duels for game in match]
    for name in LEARNED:
        yield "a disc in a corner", "corner", name, play(Side(player=corner), Side(player=name), games)
        played = [play(Side(player=name), Side(player=one), games // 2) for one in drawings(20, seed=36)]
        yield "20 discs near walls", name, "disc", [game for match in played for game in match]
    yield "a disc in a corner", "uniform", "corner", play(Side(player=uniform), Side(player=corner), games)
    for name in (*LEARNED, "halo"):
        for one in (Side(player=uniform), Side(player=noisy_uniform)):
            yield "time to a win", name, one.name, play(Side(player=name), one, games)


def main() -> None:
    """Play and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--games", type=int, default=40)
    write = csv.writer(sys.stdout, lineterminator="\n").writerow
    write(["", "first", "second", "won", "drawn", "lost", "median length, s"])
    for title, first, second, games in rows(parser.parse_args().games):
        counts = [sum(game.outcome == outcome for game in games) for outcome in ("win", "draw", "loss")]
        write([title, first, second, *counts, f"{np.median([game.seconds for game in games]):.0f}"])
        sys.stdout.flush()


if __name__ == "__main__":
    main()
