"""The protocol: opponents, rules, seeds, and the budget of attacks. It is written in ``protocol.json``.

A published version never changes: it has digests of its opponents, and a run is refused if others are installed.
`scripts/board refresh` writes the digests of a version that is not published yet.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from swarm_pz.config import GameConfig
from swarm_pz.config.base import digest
from swarm_pz.config.registry import system_of
from swarm_pz.errors import ResultsError
from swarm_pz.files import draft_of
from swarm_pz.policies import generated, open_loop, zoo
from swarm_pz.policy import Player, load
from swarm_pz.policy.identity import identity_of, source_digest

FILE = Path(__file__).with_name("protocol.json")
ZOO = Path(zoo.__file__).parent
FLOWN_BY = "ergodic"
"""The control system that flies every entry."""
NAMELESS = {f"test:{kind.__name__}": kind for kind in generated.TEST}
"""Players by names that only the protocol knows, so that no training run finds them."""


@dataclass(frozen=True, kw_only=True)
class Trial:
    """One opponent.

    `name` appears in tables. `player` is the name of a policy, a folder of the zoo, or one of `NAMELESS`, and `digest`
    is what `found` must return. The control system `system` flies its team.
    """

    name: str
    player: str
    digest: str
    system: str = FLOWN_BY

    def game(self, game: GameConfig) -> GameConfig:
        """Return the rules of its games; the first control system flies for the entry."""
        return game.replace(controllers=(FLOWN_BY, self.system))

    def load(self, game: GameConfig) -> Player:
        """Return the opponent for a game."""
        kind = NAMELESS.get(self.player)
        place = str(ZOO / self.player) if "/" in self.player else self.player
        return load(place, game, system_of(self.system)) if kind is None else kind(game)

    def found(self, game: GameConfig) -> str:
        """Return the digest of the player that is installed under its name."""
        kind = NAMELESS.get(self.player)
        return identity_of(self.player, self.load(self.game(game))) if kind is None else source_digest(kind)


@dataclass(frozen=True, kw_only=True)
class Track:
    """Games that answer one question: an even number of `games` against each opponent.

    The first `late_games` are played again with the entry's commands delayed by one command. `rules` has the fields
    that differ in the game's sections.
    """

    name: str
    seed: int
    games: int
    late_games: int
    trials: tuple[Trial, ...]
    rules: dict[str, Any] = field(default_factory=dict)
    is_late: bool = False

    @property
    def late(self) -> Track:
        """The same track with the entry's commands delayed by one command."""
        return replace(self, name=f"{self.name}, late", games=self.late_games, is_late=True)

    def game(self, game: GameConfig) -> GameConfig:
        """Return the rules of its games."""
        return game.replace(**{name: getattr(game, name).replace(**value) for name, value in self.rules.items()})


@dataclass(frozen=True, kw_only=True)
class Robust:
    """The budget of attacks on an entry.

    A method's policies share the `exploiters`, which learn from `steps` commands each; the seeds of each policy's
    exploiters begin at 0. They may start from the weights of the policy `best`, or from an imitation of the entry's
    policy in `recorded_games`. A search without learning has `generations` of `candidates`, which play `search_games`
    each. Every attacker plays `choice_games`; the worst one of each policy plays `games` more, which count.
    """

    seed: int
    games: int
    choice_games: int
    exploiters: int
    steps: int
    best: str
    recorded_games: int
    generations: int
    candidates: int
    search_games: int

    def exploiters_each(self, policies: int) -> int:
        """Return the number of exploiters of each policy: three policies cost about as much as one."""
        return math.ceil(self.exploiters / policies)


@dataclass(frozen=True, kw_only=True)
class Protocol:
    """One version of the standard; `plain` is all of it, with the scores of open-loop players."""

    version: str
    game: GameConfig
    budget_ms: float
    tracks: tuple[Track, ...]
    robust: Robust
    plain: dict[str, Any]

    @classmethod
    def read(cls, path: Path = FILE) -> Protocol:
        """Return the protocol in a file."""
        plain = json.loads(path.read_text())
        tracks = tuple(
            Track(name=name, **track | {"trials": tuple(Trial(**trial) for trial in track["trials"])})
            for name, track in plain["tracks"].items()
        )
        return cls(
            version=plain["version"],
            game=GameConfig.from_dict(plain["rules"]),
            budget_ms=plain["budget_ms"],
            tracks=tracks,
            robust=Robust(**plain["robust"]),
            plain=plain | {"open_loop": open_loop.BESTS},
        )

    @property
    def open_loop(self) -> dict[str, dict[str, Any]]:
        """Scores of the best open-loop players in each track: see `open_loop.BESTS`."""
        scores: dict[str, dict[str, Any]] = self.plain.get("open_loop", {})
        return scores

    @cached_property
    def digest(self) -> str:
        """Hash of the whole protocol, sixteen hexadecimal digits."""
        return digest(self.plain)

    def quick(self) -> Protocol:
        """Return a version with few and short games, to test that everything works; its scores mean nothing."""
        game = self.game.replace(time_limit=20.0)
        robust = replace(
            self.robust,
            games=2,
            choice_games=2,
            steps=2_000,
            recorded_games=4,
            generations=1,
            candidates=4,
            search_games=2,
        )
        tracks = tuple(replace(track, games=2, late_games=2) for track in self.tracks)
        plain = self.plain | {"version": f"{self.version}-quick"}
        return replace(self, version=plain["version"], game=game, tracks=tracks, robust=robust, plain=plain)

    def attacks_alone(self, steps: int) -> Protocol:
        """Return a version with only the attacks, whose exploiters learn from `steps` commands each."""
        tracks = tuple(replace(track, games=0, late_games=0) for track in self.tracks)
        plain = self.plain | {"version": f"{self.version}, attacks of {steps:,} commands alone"}
        return replace(
            self, version=plain["version"], tracks=tracks, robust=replace(self.robust, steps=steps), plain=plain
        )

    def check(self) -> None:
        """Check that the protocol's rules and opponents are installed; raise a ResultsError that names what differs."""
        if self.plain["rules_hash"] != GameConfig.from_dict(self.plain["rules"]).rules_hash:
            raise ResultsError(f"the rules of protocol {self.version} have another hash here: use a released swarm-pz")
        changed = [
            f"{trial.player} (expected {trial.digest}, got {digest})"
            for track in self.tracks
            for trial in track.trials
            if (digest := trial.found(track.game(self.game))) != trial.digest
        ]
        if changed:
            raise ResultsError(
                f"opponents of protocol {self.version} are others here: {', '.join(changed)}; results would not "
                "compare: use a released swarm-pz, without changes to its players"
            )


def refresh(path: Path = FILE) -> None:
    """Write the digests of the installed rules and opponents into an unpublished protocol."""
    protocol, plain = Protocol.read(path), json.loads(path.read_text())
    plain["rules_hash"] = GameConfig.from_dict(plain["rules"]).rules_hash
    for track in protocol.tracks:
        for trial, entry in zip(track.trials, plain["tracks"][track.name]["trials"], strict=True):
            entry["digest"] = trial.found(track.game(protocol.game))
    text = json.dumps(plain, indent=1)
    for _ in range(2):  # join what fits on one line
        text = re.sub(r"[\[{][^\[\]{}]+[\]}]|(?<=: )\{[^{}]{1,400}\}", lambda match: " ".join(match[0].split()), text)
    with draft_of(path) as draft:
        draft.write_text(text + "\n")
