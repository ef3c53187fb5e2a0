"""Opponents that a page unlocks one after the other: scripts, then learned players, as docs/ladder.md rates them."""

from collections.abc import Container

SCRIPTED = (
    "corners", "uniform", "wavefront", "centre", "halo", "lasso",
    "breather", "pendulum", "tide", "stroller", "hoop", "runner",
)  # fmt: skip
LEARNED = ("hunter", "champion", "veteran", "finisher", "scholar")
"""Each has a face and an idea that beats it in `static/levels.js`, and plays without a server, too."""


def opponents_among(policies: Container[str]) -> list[str]:
    """Return the opponents that are installed, in this order."""
    return [name for name in (*SCRIPTED, *LEARNED) if name in policies]
