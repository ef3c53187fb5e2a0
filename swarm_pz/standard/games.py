"""The games of a track, as a tournament, and the lines that a report keeps of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from swarm_pz.config import GameConfig
from swarm_pz.errors import KindError, ResultsError
from swarm_pz.evaluation.ledger import PlayedGame
from swarm_pz.evaluation.tournament import Tournament, TournamentConfig
from swarm_pz.policies.scripted import Tactic
from swarm_pz.policy import Player, Program, folder_of, load
from swarm_pz.policy.identity import identity_of
from swarm_pz.standard.protocol import Protocol, Track, Trial
from swarm_pz.standard.siege import siege

ENTRY, LEARNED, SEARCHED = "entry", "learned", "siege"
"""Names of a track's players: ``entry 0``; and of its attackers, ``learned 0`` and ``siege 0.1 ...``."""


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


def entry_name(number: int) -> str:
    """Return the name in a track of a training seed's policy."""
    return f"{ENTRY} {number}"


@dataclass(frozen=True)
class PlayerFactory:
    """Makes players by their names in a track: policies, one a training seed, opponents, exploiters of each policy."""

    policies: tuple[str, ...]
    trials: tuple[Trial, ...] = ()
    exploiters: tuple[str, ...] = ()

    def __call__(self, name: str, game: GameConfig) -> Player:
        """Return a player, made for a game; raise a ResultsError if nobody has that name."""
        for trial in self.trials:
            if trial.name == name:
                return trial.load(trial.game(game))
        if name.partition(" ")[0] == SEARCHED:
            return siege_of(name)(game)
        policy = self._policy(name)
        if policy is None:
            raise ResultsError(f"nobody is called {name!r} in this track")
        return load(policy, game)

    def folder_of(self, name: str) -> Path | None:
        """Return the folder that a player comes from, if any."""
        policy = self._policy(name)
        return None if policy is None else folder_of(policy)

    def _policy(self, name: str) -> str | None:
        """Return the name or folder of one of the entry's policies or exploiters."""
        kind, _, rest = name.partition(" ")
        folders = {ENTRY: self.policies, LEARNED: self.exploiters}.get(kind, ())
        return folders[int(rest)] if rest.isdigit() and int(rest) < len(folders) else None


def siege_of(name: str) -> Tactic:
    """Return the tactic that a name with numbers stands for; raise a ResultsError if they are out of bounds."""
    try:
        return siege(tuple(float(word) for word in name.split()[1:]))
    except ValueError as error:
        raise ResultsError(f"{name!r} names no tactic of the search: {error}") from error


class TrackGames(Tournament):
    """The games of a track: each policy of an entry against each opponent, and its own attackers (number, name).

    `digests` are those of the policies, by which nobody meets itself.
    """

    def __init__(
        self,
        track: Track,
        protocol: Protocol,
        factory: PlayerFactory,
        folder: Path,
        *,
        digests: Sequence[str] = (),
        attackers: Sequence[tuple[int, str]] = (),
        command: str = "",
    ) -> None:
        self.track, self._trials = track, {trial.name: trial for trial in track.trials}
        meetings = [(number, name) for number, digest in enumerate(digests) for name in track.opponents(digest)]
        self._pairings = [(entry_name(number), name) for number, name in [*meetings, *attackers]]
        players = list(dict.fromkeys(name for pairing in self._pairings for name in pairing))
        super().__init__(players, config_of(track, protocol), folder, factory, command)

    def pairings(self) -> list[tuple[str, str]]:
        """Return every two players that play, the entry first."""
        return self._pairings

    def rules_of(self, one: str, other: str) -> TournamentConfig:
        """Return the settings of the games of two players: a trial may have rules of its own."""
        return with_trial(self.config, self._trials.get(other))

    def lines(self) -> list[Line]:
        """Return all games, in order."""
        return [
            line_of(self.track.name, self.games[one, other, number])
            for one, other in self._pairings
            for number in range(self.track.games)
        ]

    def thinking_ms(self) -> list[float]:
        """Return the mean milliseconds a command of the entry in each game that was not forfeited."""
        return [game.thinking_ms[0] for game in self.games.values() if not game.forfeit and game.one.startswith(ENTRY)]


def config_of(track: Track, protocol: Protocol) -> TournamentConfig:
    """Return the settings of a track's games."""
    game = track.game(protocol.game)
    return TournamentConfig(games=track.games, seed=track.seed, budget_ms=protocol.budget_ms, game=game)


def with_trial(config: TournamentConfig, trial: Trial | None) -> TournamentConfig:
    """Return the settings of the games against an opponent."""
    return config if trial is None else config.replace(game=trial.game(config.game))


def line_of(track: str, game: PlayedGame) -> Line:
    """Return the line of a game that a policy of the entry played as its first player."""
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


def all_tracks(protocol: Protocol) -> list[Track]:
    """Return the tracks of a protocol, and the one in which attacks are tried."""
    return [*protocol.tracks, attacked(protocol)]


def attacked(protocol: Protocol) -> Track:
    """Return the track of the attackers' games."""
    return Track(name="robust", seed=protocol.robust.seed, games=protocol.robust.games, trials=())


def check_flies(policy: str, protocol: Protocol) -> Player:
    """Return a policy, made for the protocol's game.

    A KindError is raised if it does not answer densities, a ResultsError if it is all that a track has, a ForfeitError
    if it is a program that does not answer.
    """
    try:
        player = load(policy, protocol.game)
    except KindError as error:
        raise KindError(
            f"{error}; protocol {protocol.version} is for policies that answer densities, flown by ergodic; "
            "`python -m benchmarks.systems_ladder` in a clone compares others"
        ) from error
    for track in protocol.tracks:
        track.opponents(identity_of(policy, player))
    if isinstance(player, Program):
        player.reset([0], np.zeros(1, np.int64))  # raises if it did not answer the greeting
    return player
