"""Shared control: a command that a player and a policy make together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_pz.play.commands import Command, as_followed


def mixture(own: NDArray[np.float64], helpers: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Return two densities (A, A) mixed, each scaled to a sum of 1; an empty one counts as uniform."""
    parts = [
        density / density.sum() if density.any() else np.full_like(density, 1.0 / density.size)
        for density in (own, helpers)
    ]
    return as_followed((1.0 - share) * parts[0] + share * parts[1])


class SharedCommand:
    """Mixes the latest densities of a team's player and its helper; `cells` a side."""

    def __init__(self, team: int, cells: int, share: float, helper: str) -> None:
        self._team, self._share, self._sender = team, share, f"shared:{helper}"
        self._own = Command(team, 0, np.ones((cells, cells)))
        self._helpers: NDArray[np.float64] | None = None
        self._latest = np.zeros(0)

    def take(self, own: Command) -> Command | None:
        """Take the player's command; return the mixed one, or None before the helper's first."""
        self._own = own
        return self._mixed()

    def be_helped(self, helpers: NDArray[np.float64]) -> Command | None:
        """Take the helper's density; return the mixed command, or None if it is unchanged."""
        self._helpers = helpers
        before, now = self._latest, self._mixed()
        return None if np.array_equal(before, self._latest) else now

    def _mixed(self) -> Command | None:
        if self._helpers is None:
            return None
        self._latest = mixture(self._own.values, self._helpers, self._share)
        return Command(self._team, self._own.number, self._latest, "density", self._sender)
