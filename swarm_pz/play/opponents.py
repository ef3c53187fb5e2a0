"""Opponents that a page unlocks one after the other, from the weakest on, as docs/ladder.md rates them."""

from collections.abc import Container

_ORDER = (
    "corners", "centre", "blind_ring", "wavefront", "ring", "uniform",
    "lasso", "halo", "selfplay", "hunter", "champion", "veteran",
)  # fmt: skip
"""Without planners, which see the simulator, and without scripts that avoid fights or play like `uniform`."""


def opponents_among(policies: Container[str]) -> list[str]:
    """Return the opponents that are installed, from the weakest on."""
    return [name for name in _ORDER if name in policies]
