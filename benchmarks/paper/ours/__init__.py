"""What we say, and the paper does not: each claim with the rule by which it holds or not."""

from __future__ import annotations

from importlib import import_module

from benchmarks.paper.figure import Figure
from benchmarks.paper.page import Page

PAGE = Page(
    "robustness",
    "Robustness",
    """\
What happens to a team whose drones hear each other badly, or fail, and what does drawing cost? The paper makes no claim
about it; [its claims](figures.md) are on another page. In the default game all drones hear each other, and none fails.

- **Hearing a few can be worse than hearing nobody.** A drone takes those that it hears for the whole team. At the worst
  radius an even target is covered half as well as by drones that know of nobody.
- **Passing messages on ends that** (`controller.relay`). While drones are connected, a short radius is as good as one
  across the square. Where they are not, relays neither help nor harm.
- **A longer memory ends it too**, but a shorter one does not make it worse, so forgetting is not the whole reason. With
  8 s, more games are drawn.
- **Being captured is like failing.** Drones that leave and return at the same rates cost a team about as much in both
  cases; if most are away, captures cost more. A team with half of its drones out covers its target more coarsely than
  a fixed team of half its size.""",
)

FIGURES: dict[str, Figure] = {
    name: import_module(f"{__name__}.{name}").FIGURE
    for name in ("communication", "short_memory", "relays", "dropout", "drawing_attention")
}
"""All figures by name, in the order of the page."""
