"""What we say, and the paper does not: each claim with the rule by which it holds or not."""

from __future__ import annotations

from benchmarks.paper.figure import Figure
from benchmarks.paper.ours import communication, dropout, relays, short_memory
from benchmarks.paper.page import Page

PAGE = Page(
    "ours.md",
    "Robustness",
    """\
What becomes of a team whose drones hear each other badly, or fail? The paper makes no claim about it: what stands here
is ours, beside [the paper's](index.md). In the default game everybody hears everybody, and nobody fails.

- **To hear a few can be worse than to hear nobody.** A drone averages over those whom it hears, and takes them for the
  whole team; probably all groups of them leave the same ground to others. At the worst radius an even target is covered
  half as well as by drones that know of nobody.
- **Passing messages on ends that.** With `controller.relay` a drone averages over all whom it is connected with, over
  any number of drones. While they are connected, a short radius is as good as one across the square; where they are
  not, relays bring nothing, and do no harm.
- **A longer memory ends it, too, but a shorter one does not make it worse**, so that forgetting is not all of the
  reason. With 8 s to hear a few is nowhere worse than silence; but drones that hear nobody then cover an even target
  less well than with 4 s, and more games are drawn.
- **To be captured is like failing.** Drones that leave and return at the same rates cost a team about as much whether
  they stand still meanwhile or fly for the opponent; if most of them are away, the latter costs more. With half of its
  drones out a team covers its target more coarsely than one of half its size, to which nobody comes or goes.""",
)

FIGURES: dict[str, Figure] = {
    module.FIGURE.name: module.FIGURE for module in (communication, short_memory, relays, dropout)
}
"""All figures by name, in the order of the page."""
