"""Who plays whom on the ladder of systems, and the tournaments that say it."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from pathlib import Path

from swarm_pz.config import GameConfig
from swarm_pz.config.presets import PRESETS
from swarm_pz.config.registry import registered, system_of
from swarm_pz.errors import CommandError, KindError, SwarmError, nearest
from swarm_pz.evaluation.survival import kaplan_meier
from swarm_pz.evaluation.tournament import Tournament, TournamentConfig
from swarm_pz.policy import Player, PrivilegedPolicy, answers_of, load
from swarm_pz.policy import registered as installed

ADVERSARY = "ergodic/uniform"
"""Whom everybody plays: even coverage, flown by the ergodic controller."""
TRACKS = {"hovering": 0.0, "fixed_wing": PRESETS["fixed_wing"]["dynamics"].min_speed}
"""The least airspeed of each track's rules."""
TRAINED = "trained"
"""Gives the policy that was trained for a system."""
HOLD = "hold"
"""Commands every system: it sends what that does by itself."""
_PILOT = 1_000_003
"""Sets the seed of the games that choose among scripts apart from that of the games that count."""


def system_name(entrant: str) -> str:
    """Return the control system of an entrant: "ergodic" of "ergodic/ring"."""
    return entrant.split("/", 1)[0]


def player_name(entrant: str) -> str:
    """Return who commands it: "ring" of "ergodic/ring"."""
    return entrant.split("/", 1)[1]


def load_entrant(entrant: str, game: GameConfig) -> Player:
    """Return the policy of an entrant, made for its system."""
    if "/" not in entrant:
        raise CommandError(f"an entrant is called SYSTEM/PLAYER, as {ADVERSARY}, got {entrant!r}")
    name = system_name(entrant)
    return load(player_name(entrant), game.replace(controllers=name), system_of(name))


class Contest(Tournament):
    """A tournament of entrants, as SYSTEM/PLAYER, of which each flies by its own system.

    Each meets every other and itself; if `against` is given, that one alone.
    """

    def __init__(
        self, entrants: Sequence[str], config: TournamentConfig, folder: Path, command: str = "", against: str = ""
    ) -> None:
        self._against = against
        super().__init__(entrants, config, folder, load_entrant, command)

    def pairings(self) -> list[tuple[str, str]]:
        """Return who plays whom, each two in alphabetical order."""
        if self._against:
            return [pair for pair in super().pairings() if self._against in pair]
        return list(itertools.combinations_with_replacement(sorted(self.players), 2))

    def rules_of(self, one: str, other: str) -> TournamentConfig:
        """Return the rules of two entrants: each flies by its own system."""
        flown = (system_name(one), system_name(other))
        return self.config.replace(game=self.config.game.replace(controllers=flown))

    def order(self, entrant: str) -> tuple[float, float]:
        """Return what entrants are sorted by, after their games against the adversary: wins, and mean time to one."""
        won, drawn, lost = self.tally(entrant, ADVERSARY).sum(axis=0).tolist()
        games = [alike[0] for alike in self.counting(entrant, ADVERSARY)]
        decided = [game.outcome_of(entrant) == "win" for game in games]
        limit = self.config.game.time_limit
        lengths = [game.seconds if is_won else limit for game, is_won in zip(games, decided, strict=True)]
        _, mean = kaplan_meier(lengths, decided)
        return -won / (won + drawn + lost), mean


def rules_of_track(track: str, game: GameConfig) -> GameConfig:
    """Return a track's rules: those of a game, with its least airspeed."""
    return game.replace(dynamics=game.dynamics.replace(min_speed=TRACKS[track]))


def choose_systems(names: Sequence[str]) -> tuple[str, ...]:
    """Return the control systems of these names; all that are installed, if none are given."""
    known = sorted(registered())
    for name in names:
        if name not in known:
            raise CommandError(f"there is no control system {name!r}; {nearest(name, known)}")
    return tuple(dict.fromkeys(names)) or tuple(known)


def scripts_for(system: str, game: GameConfig) -> list[str]:
    """Return the installed scripts that answer a system's commands, and `hold`, which for densities is `uniform`."""
    found = []
    flown, takes = game.replace(controllers=system), system_of(system).takes
    for name in sorted(installed()):
        try:
            made = load(name, flown)
        except SwarmError:  # of another kind, or not to be had here
            continue
        learned, planned = hasattr(made, "digest"), isinstance(made, PrivilegedPolicy)
        if not learned and not planned and answers_of(made) == takes and (name, takes) != (HOLD, "density"):
            found.append(name)
    return found


def trained_for(system: str, game: GameConfig) -> str | None:
    """Return the entrant that was trained for a system; None if there is none for it and this game."""
    entrant = f"{system}/{TRAINED}"
    try:
        load_entrant(entrant, game)
    except KindError:
        return None
    return entrant


def pilot(systems: Sequence[str], config: TournamentConfig, folder: Path, command: str = "") -> Contest:
    """Return the tournament in which everybody plays the adversary, on other seeds than those that count.

    Of each system these are all scripts for its commands, and the policy that was trained for it.
    """
    entrants = []
    for system in systems:
        entrants += [f"{system}/{name}" for name in scripts_for(system, config.game)]
        if (trained := trained_for(system, config.game)) is not None:
            entrants.append(trained)
    others = [entrant for entrant in entrants if entrant != ADVERSARY]
    return Contest([ADVERSARY, *others], config.replace(seed=config.seed + _PILOT), folder, command, ADVERSARY)


def best_players(played: Contest) -> list[str]:
    """Return the best entrant of each system after the pilot: most wins against the adversary, then soonest."""
    best: dict[str, str] = {}
    for entrant in sorted((one for one in played.players if one != ADVERSARY), key=played.order):
        best.setdefault(system_name(entrant), entrant)
    return list(best.values())
