"""The claims of the paper, each with the rule by which it holds or not."""

from __future__ import annotations

from importlib import import_module

from benchmarks.paper.figure import Figure
from benchmarks.paper.page import Page

PAGE = Page(
    "figures",
    "The paper's evidence, made again",
    "How much of what *A Game Benchmark for Real-Time Human-Swarm Control* says about its game is reproduced, by the "
    "rules of the paper and of its [released code](paper.md#the-released-code). Commands are drawings, as the table "
    "makes commands of them; raw densities stand beside them. A part holds if its whole 95 % interval says so, and is "
    "no stricter than the paper's sentence: what it says *may* happen has to happen once. Parts of our own are no part "
    "of a verdict. The paper has no number for *converges*: here the ergodic metric E falls to a tenth, a bound of "
    "ours that was set after a first look. [Claims of our own](robustness.md) are on another page. The command also "
    "writes PDF and SVG, one and two columns wide.",
)

FIGURES: dict[str, Figure] = {
    name: import_module(f"{__name__}.{name}").FIGURE
    for name in (
        "capture_geometry", "scale_invariance", "permutation_invariance", "fluctuation", "ensemble_tactic",
        "team_sizes", "flocking_comparison", "adversary", "bunching_up", "wavefront", "comebacks",
    )
}  # fmt: skip
"""All figures by name, in the order of the page."""
