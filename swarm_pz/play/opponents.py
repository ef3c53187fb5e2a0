"""Opponents that a page unlocks one after the other: scripts, then learned players, as docs/ladder.md rates them."""

from collections.abc import Container

SCRIPTED = (
    "corners", "uniform", "wavefront", "centre", "halo", "lasso",
    "breather", "pendulum", "tide", "stroller", "hoop", "runner",
)  # fmt: skip
LEARNED = ("hunter", "champion", "veteran", "finisher", "scholar")
"""In `static/levels.js`, each has a face and an idea that beats it. All play without a server, too."""


def opponents_among(policies: Container[str]) -> list[str]:
    """Return the installed opponents, in the order above."""
    return [name for name in (*SCRIPTED, *LEARNED) if name in policies]
