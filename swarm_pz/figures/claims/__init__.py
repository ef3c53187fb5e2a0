"""The claims of the paper, each with the rule by which it holds or not."""

from __future__ import annotations

from swarm_pz.figures.claims import (
    adversary,
    capture_geometry,
    comebacks,
    communication,
    compactness,
    dropout,
    ensemble_tactic,
    flocking_comparison,
    permutation_invariance,
    scale_invariance,
    team_sizes,
)
from swarm_pz.figures.figure import Figure

FIGURES: dict[str, Figure] = {
    module.FIGURE.name: module.FIGURE
    for module in (
        capture_geometry,
        scale_invariance,
        permutation_invariance,
        ensemble_tactic,
        team_sizes,
        flocking_comparison,
        adversary,
        compactness,
        comebacks,
        communication,
        dropout,
    )
}
"""All figures by name, in the order of the page."""
