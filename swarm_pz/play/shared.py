"""Shared control: a command that a player and a policy make together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarm_pz.play.commands import Command, as_followed

SHARED = "shared:"
"""What the sender of a shared command begins with; the policy's name follows."""


def mixture(own: NDArray[np.float64], helpers: NDArray[np.float64], share: float) -> NDArray[np.float64]:
    """Return the density (A, A) of which the helper makes a share and the player the rest.

    Both count by their shape alone: each is made to sum to 1 before they are mixed. One of nothing is the whole square.
    """
    parts = [
        density / density.sum() if density.any() else np.full_like(density, 1.0 / density.size)
        for density in (own, helpers)
    ]
    return as_followed((1.0 - share) * parts[0] + share * parts[1])


class SharedCommand:
    """The latest of what a team's player and its helper ask for: densities of so many cells a side, mixed."""

    def __init__(self, team: int, cells: int, share: float, helper: str) -> None:
        self._team, self._share, self._sender = team, share, f"{SHARED}{helper}"
        self._own = Command(team, 0, np.ones((cells, cells)))
        self._helpers: NDArray[np.float64] | None = None
        self._latest = np.zeros(0)

    def take(self, own: Command) -> Command | None:
        """Take what the player asks for; return what becomes of it, None while the helper has said nothing."""
        self._own = own
        return self._mixed()

    def be_helped(self, helpers: NDArray[np.float64]) -> Command | None:
        """Take what the helper asks for; return what becomes of the command, None if it is as before."""
        self._helpers = helpers
        before, now = self._latest, self._mixed()
        return None if np.array_equal(before, self._latest) else now

    def _mixed(self) -> Command | None:
        if self._helpers is None:
            return None
        self._latest = mixture(self._own.values, self._helpers, self._share)
        return Command(self._team, self._own.number, self._latest, "density", self._sender)
