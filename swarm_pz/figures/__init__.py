"""The paper's evidence, made again, and ours: one claim, one picture, one verdict each.

A claim is a module with a `FIGURE`, of `swarm_pz.figures.claims` where the paper says it, of `swarm_pz.figures.ours`
where we do: `measure` plays the games and says whether the claim holds, by a rule that stands there before anybody
looks; `draw` shows what was found.
"""

from swarm_pz.figures.claims import FIGURES
from swarm_pz.figures.figure import Figure, Finding
from swarm_pz.figures.making import EVERY, Made, make, make_all
from swarm_pz.figures.ours import FIGURES as OURS

__all__ = ["EVERY", "FIGURES", "OURS", "Figure", "Finding", "Made", "make", "make_all"]
