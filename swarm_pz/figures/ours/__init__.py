"""What we say, and the paper does not: each claim with the rule by which it holds or not."""

from __future__ import annotations

from swarm_pz.figures.figure import Figure
from swarm_pz.figures.ours import communication, dropout, relays, short_memory
from swarm_pz.figures.page import Page

PAGE = Page(
    "ours.md",
    "Robustness",
    "What becomes of a team whose drones hear each other badly, or fail. The paper makes no claim about it: these are "
    "ours, beside [the paper's](index.md).",
)

FIGURES: dict[str, Figure] = {
    module.FIGURE.name: module.FIGURE for module in (communication, short_memory, relays, dropout)
}
"""All figures by name, in the order of the page."""
