"""The claims of the paper, each with the rule by which it holds or not."""

from __future__ import annotations

from importlib import import_module

from benchmarks.paper.figure import Figure
from benchmarks.paper.page import Page

PAGE = Page(
    "figures",
    "The paper's evidence, made again",
    "The claims of *A Game Benchmark for Real-Time Human-Swarm Control* about its game, and whether they hold here. "
    "Claims of our own are on [another page](robustness.md).",
)

FIGURES: dict[str, Figure] = {
    name: import_module(f"{__name__}.{name}").FIGURE
    for name in (
        "capture_geometry", "scale_invariance", "permutation_invariance", "fluctuation", "ensemble_tactic",
        "team_sizes", "flocking_comparison", "drawing_attention", "adversary", "bunching_up", "wavefront", "comebacks",
    )
}  # fmt: skip
"""All figures by name, in the order of the page."""
