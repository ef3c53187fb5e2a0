"""The opponents of a league's learner, and its results against each."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

_PRIOR_GAMES = 10.0
"""Games at an even score that a new opponent starts with."""
_REMEMBERED_GAMES = 200.0
"""Older games fade: the learner changes."""


@dataclass
class Member:
    """An opponent of the pool, and the learner's latest results against it."""

    name: str
    source: str
    """Name of the policy, or its folder within the league's."""
    kind: str
    """"script", "initial", "snapshot" or "exploiter"."""
    games: float = _PRIOR_GAMES
    score: float = _PRIOR_GAMES / 2
    """The learner's points in these games; a draw is half a win."""

    @property
    def beaten(self) -> float:
        """The learner's share of the points."""
        return self.score / self.games

    def count(self, points: float) -> None:
        """Count a game of the learner against it."""
        self.games, self.score = self.games + 1.0, self.score + points
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
        """Return the pool of which `dataclasses.asdict` gave the plain values."""
        return cls(**plain | {"members": [Member(**entry) for entry in plain["members"]]})

    def newest(self) -> Member:
        """Return the newest snapshot; a league begins with one."""
        return next(member for member in reversed(self.members) if member.kind == "snapshot")

    def weights(self, exponent: float, floor: float, scripts: float) -> NDArray[np.float64]:
        """Return each member's probability of being dealt; `scripts` is what all scripts share."""
        hard = np.array([(1.0 - member.beaten) ** exponent for member in self.members]) + floor
        is_script = np.array([member.kind == "script" for member in self.members])
        if is_script.any() and not is_script.all():
            hard[is_script] *= scripts / hard[is_script].sum()
            hard[~is_script] *= (1.0 - scripts) / hard[~is_script].sum()
        return np.asarray(hard / hard.sum())
