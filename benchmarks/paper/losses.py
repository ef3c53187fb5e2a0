"""When a team lost its first drone, and when its last."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import BLUE
from swarm_pz.evaluation.rollout import Rollout


class Losses:
    """Watches what blue loses, every control period.

    Attributes
    ----------
    first, last : float64 array (E,)
        Seconds at which blue first lost a drone and had lost all; infinite if it did not.
    spread : float64 array (E,)
        Root mean square distance of blue's drones from their mean just before the first loss; NaN without one.
    """

    def __init__(self, rollout: Rollout) -> None:
        games = len(rollout.rows)
        self.first, self.last = np.full((2, games), np.inf)
        self.spread = np.full(games, np.nan)
        self._before = rollout.simulator.teams == BLUE
        self._places = rollout.simulator.positions.copy()

    def __call__(self, rollout: Rollout) -> None:
        """Look at all games."""
        simulator = rollout.simulator
        members = simulator.teams == BLUE
        lost = (self._before & ~members).any(axis=1) & np.isinf(self.first)
        for row in np.flatnonzero(lost):
            own = self._places[row, self._before[row]].astype(np.float64)
            self.spread[row] = np.sqrt(((own - own.mean(axis=0)) ** 2).sum(axis=1).mean())
        self.first[lost] = simulator.time_s[lost]
        over = ~members.any(axis=1) & np.isinf(self.last)
        self.last[over] = simulator.time_s[over]
        self._before, self._places = members, simulator.positions.copy()

    def whole_within(self, seconds: float) -> NDArray[np.bool_]:
        """Return which games (E,) blue lost whole, so soon after its first loss."""
        return np.asarray(np.isfinite(self.last) & (self.last <= self.first + seconds + 1e-6))
