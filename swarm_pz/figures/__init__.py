"""The paper's evidence, made again: one claim, one picture, one verdict each.

A claim is a module of `swarm_pz.figures.claims` with a `FIGURE`: `measure` plays the games and says whether the claim
holds, by a rule that stands there before anybody looks; `draw` shows what was found.
"""

from swarm_pz.figures.claims import FIGURES
from swarm_pz.figures.figure import Figure, Finding
from swarm_pz.figures.making import Made, make, make_all

__all__ = ["FIGURES", "Figure", "Finding", "Made", "make", "make_all"]
