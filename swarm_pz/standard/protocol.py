"""The protocol: opponents, rules, seeds, and the budget of attacks. It is written in ``protocol.json``.

A published version never changes: it has digests of its opponents, and a run is refused where others are installed.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from swarm_pz.config import GameConfig
from swarm_pz.config.base import digest
from swarm_pz.config.registry import system_of
from swarm_pz.errors import ResultsError
from swarm_pz.policies import held_out
from swarm_pz.policy import Player, load
from swarm_pz.standard.identity import identity_of, source_digest

FILE = Path(__file__).with_name("protocol.json")
FLOWN_BY = "ergodic"
"""The control system that flies every entry."""
HELD_OUT = "held-out:"
"""Begins the names of players that have none: those of the held-out suite."""


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One opponent, and what differs in its games.

    `name` stands in tables. `player` is the name of a policy, with ``held-out:`` before one of the held-out suite, and
    `digest` that of `identity_of`. Its team is flown by `system`; `rules` are fields of the game that differ.
    """

    name: str
    player: str
    digest: str
    system: str = FLOWN_BY
    rules: dict[str, Any]

    def game(self, game: GameConfig) -> GameConfig:
        """Return the rules of its games; the entry flies by the first of the control systems."""
        changed = {
            name: getattr(game, name).replace(**value) if isinstance(value, dict) else value
            for name, value in self.rules.items()
        }
        return game.replace(controllers=(FLOWN_BY, self.system), **changed)

    def load(self, game: GameConfig) -> Player:
        """Return the opponent, made for a game."""
        if self.player.startswith(HELD_OUT):
            made: Player = getattr(held_out, self.player.removeprefix(HELD_OUT))(game)
            return made
        return load(self.player, game, system_of(self.system))

    def found(self, game: GameConfig) -> str:
        """Return the digest of what is installed under its name."""
        if self.player.startswith(HELD_OUT):
            return source_digest(getattr(held_out, self.player.removeprefix(HELD_OUT)))
        return identity_of(self.player, self.load(game))


@dataclass(frozen=True, kw_only=True)
class Track:
    """Games that answer one question: an even number of `games` against each opponent."""

    name: str
    seed: int
    games: int
    trials: tuple[Trial, ...]


@dataclass(frozen=True, kw_only=True)
class Robust:
    """The budget of attacks on an entry.

    Each attack that is found plays `games`, on seeds that no search has seen. An exploiter learns from `steps`
    commands. The search that does not learn has `generations` of `candidates`, which play `search_games` each.
    """

    seed: int
    games: int
    steps: int
    generations: int
    candidates: int
    search_games: int


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """One version of the standard; `plain` is the same as it is written."""

    version: str
    game: GameConfig
    budget_ms: float
    tracks: tuple[Track, ...]
    robust: Robust
    plain: dict[str, Any]

    @classmethod
    def read(cls, path: Path = FILE) -> Protocol:
        """Return the protocol that a file holds."""
        plain = json.loads(path.read_text())
        tracks = tuple(
            Track(
                name=name,
                seed=track["seed"],
                games=track["games"],
                trials=tuple(Trial(**{"rules": {}} | trial) for trial in track["trials"]),
            )
            for name, track in plain["tracks"].items()
        )
        return cls(
            version=plain["version"],
            game=GameConfig.from_dict(plain["rules"]),
            budget_ms=plain["budget_ms"],
            tracks=tracks,
            robust=Robust(**plain["robust"]),
            plain=plain,
        )

    @cached_property
    def digest(self) -> str:
        """Sixteen hexadecimal digits of all that it says."""
        return digest(self.plain)

    def quick(self) -> Protocol:
        """Return a try of it, with few and short games: it says whether all works, and nothing about an entry."""
        game = self.game.replace(time_limit=20.0)
        robust = replace(self.robust, games=2, steps=2_000, generations=1, candidates=4, search_games=2)
        tracks = tuple(replace(track, games=2) for track in self.tracks)
        plain = self.plain | {"version": f"{self.version}-quick"}
        return replace(self, version=plain["version"], game=game, tracks=tracks, robust=robust, plain=plain)

    def check(self) -> None:
        """Check that the installed rules and opponents are those of the protocol: else a ResultsError names them."""
        if self.plain["rules_hash"] != GameConfig.from_dict(self.plain["rules"]).rules_hash:
            raise ResultsError(f"the rules of protocol {self.version} have another hash here: use a released swarm-pz")
        changed = [
            f"{trial.player} (expected {trial.digest}, got {found})"
            for track in self.tracks
            for trial in track.trials
            if (found := trial.found(trial.game(self.game))) != trial.digest
        ]
        if changed:
            raise ResultsError(
                f"opponents of protocol {self.version} are others here: {', '.join(changed)}; results would not "
                "compare: use a released swarm-pz, without changes to its players"
            )
