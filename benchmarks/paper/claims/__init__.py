"""The claims of the paper, each with the rule by which it holds or not."""

from __future__ import annotations

from importlib import import_module

from benchmarks.paper.figure import Figure

FIGURES: dict[str, Figure] = {
    name: import_module(f"{__name__}.{name}").FIGURE
    for name in (
        "capture_geometry", "scale_invariance", "permutation_invariance", "fluctuation", "ensemble_tactic",
        "team_sizes", "flocking_comparison", "adversary", "bunching_up", "wavefront", "comebacks",
    )
}  # fmt: skip
"""All figures by name, in the order of the page."""
