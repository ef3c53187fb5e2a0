"""The games of a track, as a tournament, and the lines that a report keeps of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.errors import KindError, ResultsError
from swarm_pz.evaluation.ledger import PlayedGame
from swarm_pz.evaluation.tournament import Tournament, TournamentConfig
from swarm_pz.policies.pattern import NAME
from swarm_pz.policy import Player, Program, folder_of, load
from swarm_pz.simulator.spawn import Seed
from swarm_pz.spaces.observation import Observations
from swarm_pz.standard.protocol import Protocol, Track, Trial

ENTRY, LATE, LEARNED, ITSELF = "entry", "late", "learned", "itself"
"""First words of names: of an entry's policies, ``entry 0`` and, delayed by a command, ``late 0``; and of attackers,
``learned 0`` and ``itself 0``."""
CHOICE, ROBUST = "choice", "robust"
"""Tracks of attacks: games to choose the worst attacker of each policy, and its games that count."""


class Line(NamedTuple):
    """One game of a report, from the entry's side, without the times that depend on the machine."""

    track: str
    policy: int
    opponent: str
    number: int
    outcome: str
    share: float
    seconds: float
    forfeit: str


class LatePlayer:
    """A policy whose commands are delayed by one command; the first is uniform coverage."""

    def __init__(self, player: Any, game: GameConfig) -> None:
        self._player, self._cells = player, game.command_cells
        self._held: dict[int, NDArray[Any]] = {}
        if hasattr(player, "plan"):
            self.plan = lambda simulator, teams, rows: self._late(player.plan(simulator, teams, rows), rows)
        else:
            self.observation = player.observation

    def reset(self, seeds: Sequence[Seed], rows: NDArray[np.int64]) -> None:
        """Begin new games."""
        self._player.reset(seeds, rows)
        self._held |= {row: np.ones((self._cells, self._cells)) for row in rows.tolist()}

    def act(self, observations: Observations, rows: NDArray[np.int64]) -> NDArray[Any]:
        """Return the previous commands."""
        return self._late(self._player.act(observations, rows), rows)

    def _late(self, commands: NDArray[Any], rows: NDArray[np.int64]) -> NDArray[Any]:
        held = np.stack([self._held[row] for row in rows.tolist()])
        self._held |= dict(zip(rows.tolist(), np.array(commands), strict=True))
        return held


@dataclass(frozen=True)
class PlayerFactory:
    """Makes players by their names in a track.

    Players are the entry's policies, opponents (`trials`), exploiters, patterns, and `others`: (name, policy).
    """

    policies: tuple[str, ...]
    trials: tuple[Trial, ...] = ()
    exploiters: tuple[str, ...] = ()
    others: tuple[tuple[str, str], ...] = ()

    def __call__(self, name: str, game: GameConfig) -> Player:
        """Return a player for a game; raise a ResultsError if none has that name."""
        for trial in self.trials:
            if trial.name == name:
                return trial.load(trial.game(game))
        kind, _, _ = name.partition(" ")
        if kind.startswith(f"{NAME}:"):
            return load(name, game)
        policy = self._policy(name)
        if policy is None:
            raise ResultsError(f"nobody is called {name!r} in this track")
        player = load(policy, game)
        return LatePlayer(player, game) if kind == LATE else player

    def folder_of(self, name: str) -> Path | None:
        """Return a player's folder, if it has one."""
        policy = self._policy(name)
        return None if policy is None else folder_of(policy)

    def _policy(self, name: str) -> str | None:
        """Return the name or folder of a policy of the entry, an exploiter, or one of `others`."""
        if name in (others := dict(self.others)):
            return others[name]
        kind, _, rest = name.partition(" ")
        folders = {LEARNED: self.exploiters}.get(kind, self.policies if kind in (ENTRY, LATE, ITSELF) else ())
        return folders[int(rest)] if rest.isdigit() and int(rest) < len(folders) else None


class TrackGames(Tournament):
    """The games of a track: `meetings` of policies, by number, with opponents; by default, all meet."""

    def __init__(
        self,
        track: Track,
        protocol: Protocol,
        factory: PlayerFactory,
        folder: Path,
        *,
        meetings: Sequence[tuple[int, str]] = (),
        command: str = "",
    ) -> None:
        self.track, self._trials = track, {trial.name: trial for trial in track.trials}
        kind = LATE if track.is_late else ENTRY
        everybody = [(number, trial.name) for number in range(len(factory.policies)) for trial in track.trials]
        self._pairings = [(f"{kind} {number}", name) for number, name in meetings or everybody]
        players = list(dict.fromkeys(name for pairing in self._pairings for name in pairing))
        super().__init__(players, config_of(track, protocol), folder, factory, command)

    def pairings(self) -> list[tuple[str, str]]:
        """Return the pairs of players that meet, the entry first."""
        return self._pairings

    def rules_of(self, one: str, other: str) -> TournamentConfig:
        """Return the settings of the games of two players; a trial may have its own rules."""
        return with_trial(self.config, self._trials.get(other))

    def lines(self) -> list[Line]:
        """Return all games, in order."""
        return [
            line_of(self.track.name, self.games[one, other, number])
            for one, other in self._pairings
            for number in range(self.track.games)
        ]

    def thinking_ms(self) -> list[float]:
        """Return the entry's mean milliseconds per command in each game without a forfeit."""
        return [game.thinking_ms[0] for game in self.games.values() if not game.forfeit]


def config_of(track: Track, protocol: Protocol) -> TournamentConfig:
    """Return the settings of a track's games."""
    game = track.game(protocol.game)
    return TournamentConfig(games=track.games, seed=track.seed, budget_ms=protocol.budget_ms, game=game)


def with_trial(config: TournamentConfig, trial: Trial | None) -> TournamentConfig:
    """Return the settings of the games against an opponent."""
    return config if trial is None else config.replace(game=trial.game(config.game))


def line_of(track: str, game: PlayedGame) -> Line:
    """Return the line of a game whose first player is a policy of the entry."""
    return Line(
        track=track,
        policy=int(game.one.split()[1]),
        opponent=game.other,
        number=game.number,
        outcome=game.outcome,
        share=game.share,
        seconds=round(game.seconds, 4),
        forfeit=game.forfeit,
    )


def worst_attackers(lines: Sequence[Line]) -> dict[int, str]:
    """Return for each policy the attacker against which it keeps the fewest drones in these games."""
    left: dict[int, dict[str, list[float]]] = {}
    for line in lines:
        left.setdefault(line.policy, {}).setdefault(line.opponent, []).append(line.share)
    return {policy: min(by, key=lambda name: float(np.mean(by[name]))) for policy, by in left.items()}


def all_tracks(protocol: Protocol) -> list[Track]:
    """Return all tracks of a protocol: each track, its late version, and the tracks of the attacks."""
    return [one for track in protocol.tracks for one in (track, track.late)] + [
        choice_of(protocol),
        robust_of(protocol),
    ]


def choice_of(protocol: Protocol) -> Track:
    """Return the track that chooses the worst attacker of each policy; public attackers are the field's opponents."""
    robust = protocol.robust
    public = [trial for track in protocol.tracks if track.name == "field" for trial in track.trials]
    return Track(name=CHOICE, seed=robust.seed + 1, games=robust.choice_games, late_games=0, trials=tuple(public))


def robust_of(protocol: Protocol) -> Track:
    """Return the track of the worst attackers' games that count."""
    return replace(choice_of(protocol), name=ROBUST, seed=protocol.robust.seed, games=protocol.robust.games)


def check_flies(policy: str, protocol: Protocol) -> Player:
    """Return a policy for the protocol's game.

    Raises a KindError if its commands are not densities, a ForfeitError if it is a program that does not respond.
    """
    try:
        player = load(policy, protocol.game)
    except KindError as error:
        raise KindError(
            f"{error}; protocol {protocol.version} is for policies that answer densities, flown by ergodic; "
            "`python -m benchmarks.systems_ladder` in a clone compares others"
        ) from error
    if isinstance(player, Program):
        player.reset([0], np.zeros(1, np.int64))  # raises if it did not answer the greeting
    return player
