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
    """An opponent of the pool, and how the learner has done against it lately.

    Attributes
    ----------
    name : str
    source : str
        Name of the policy, or its folder within the league's.
    kind : {"script", "initial", "snapshot", "exploiter"}
    games, score : float
        Games of late, and the learner's score in them; a draw is half a win.
    """

    name: str
    source: str
    kind: str
    games: float = _PRIOR_GAMES
    score: float = _PRIOR_GAMES / 2

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
    """The members of a league and what has been done so far.

    Attributes
    ----------
    members : list of Member
    config_hash : str
        Of the settings that the league is played under.
    snapshot_step, exploiter_step : int
        Steps of the learner at the latest of each; of an exploiter, where it began.
    exploiters : int
        How many have been trained to their end.
    target : str
        The snapshot that an exploiter is being trained against, or none.
    until : int
        Steps of the learner at which those dealt last have been met for long enough.
    unrated : str
        The snapshot whose rating is not known yet, or none.
    """

    members: list[Member] = field(default_factory=list)
    config_hash: str = ""
    snapshot_step: int = 0
    target: str = ""
    exploiters: int = 0
    exploiter_step: int = 0
    until: int = 0
    unrated: str = ""

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
