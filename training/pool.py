"""The opponents of a league's learner, and its results against each."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.policies.pattern import KINDS, name_of, numbers_in, numbers_of, points_of

_PRIOR_GAMES = 10.0
"""Imagined games at an even score, with which a new opponent starts."""
_REMEMBERED_GAMES = 200.0
"""Largest count of games: older ones fade, since the learner changes."""
_TRIED_GAMES, _EASY = 30.0, 0.85
"""Games, including the imagined ones, after which a pattern is judged, and the learner's mean share at which it is
dropped."""
_SPREAD, _VARIED = 0.12, 0.06
"""Standard deviations, in the unit cube, of new patterns around the named ones, and around those that stay."""
_NAMED = points_of(np.array([list(kind.values()) for kind in KINDS.values()]))


@dataclass
class Member:
    """An opponent of the pool, and the learner's latest results against it."""

    name: str
    source: str
    """Name of the policy, or its folder within the league's."""
    kind: str
    """"script", "initial", "snapshot", "exploiter" or "pattern"."""
    games: float = _PRIOR_GAMES
    score: float = _PRIOR_GAMES / 2
    """The sum of the learner's shares of the drones at the ends of these games."""

    @property
    def beaten(self) -> float:
        """The learner's mean share of the drones."""
        return self.score / self.games

    def count(self, share: float) -> None:
        """Count a game that the learner ended with a share of the drones."""
        self.games, self.score = self.games + 1.0, self.score + share
        if self.games > _REMEMBERED_GAMES:
            self.score *= _REMEMBERED_GAMES / self.games
            self.games = _REMEMBERED_GAMES


@dataclass
class Pool:
    """The members of a league and its state."""

    members: list[Member] = field(default_factory=list)
    config_hash: str = ""
    snapshot_step: int = 0
    target: str = ""
    """Snapshot that an exploiter is being trained against."""
    exploiters: int = 0
    """Exploiters whose training has ended."""
    exploiter_step: int = 0
    """Steps of the learner at the beginning of the latest exploiter."""
    until: int = 0
    """Steps of the learner at which opponents are dealt anew."""

    @classmethod
    def from_dict(cls, plain: dict[str, Any]) -> Pool:
        """Return the pool that `dataclasses.asdict` turned into plain values."""
        return cls(**plain | {"members": [Member(**entry) for entry in plain["members"]]})

    def newest(self) -> Member:
        """Return the newest snapshot; a league begins with one."""
        return next(member for member in reversed(self.members) if member.kind == "snapshot")

    def weights(self, exponent: float, floor: float, **shares: float) -> NDArray[np.float64]:
        """Return each member's probability of being dealt; `shares` are totals of kinds, other kinds get the rest."""
        hard = np.array([(1.0 - member.beaten) ** exponent for member in self.members]) + floor
        kinds = np.array([member.kind if member.kind in shares else "" for member in self.members])
        shares = {kind: share for kind, share in shares.items() if kind in kinds}
        for kind, share in {**shares, "": max(1.0 - sum(shares.values()), 0.0)}.items():
            hard[kinds == kind] *= share / hard[kinds == kind].sum() if (kinds == kind).any() else 0.0
        return np.asarray(hard / hard.sum())

    def renew_patterns(self, count: int, generator: np.random.Generator) -> None:
        """Keep the patterns that are hard for the learner, or not judged yet; replace the others.

        Half of the new patterns are variations of the hard ones, half of the named ones; after
        Parker-Holder et al., "Evolving curricula with regret-based environment design", ICML 2022.
        """
        patterns = [member for member in self.members if member.kind == "pattern"]
        tried = sorted((one for one in patterns if one.games >= _TRIED_GAMES), key=lambda one: one.beaten)
        stay = [one for one in tried[: count // 2] if one.beaten < _EASY]
        parents = points_of(np.array([numbers_in(one.name) for one in stay])) if stay else _NAMED
        kept = stay + [one for one in patterns if one.games < _TRIED_GAMES][: count - len(stay)]
        self.members = [one for one in self.members if one.kind != "pattern"] + kept
        for number in range(count - len(kept)):
            points, spread = (parents, _VARIED) if number % 2 else (_NAMED, _SPREAD)
            point = points[generator.integers(len(points))] + spread * generator.normal(size=points.shape[1])
            name = name_of(numbers_of(point))
            self.members.append(Member(name, name, "pattern"))
