"""The pictures of the ladder of systems: times to a win, and who beats whom."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.paper.style import DPI, RC, SERIES
from swarm_pz.errors import require_extra
from swarm_pz.files import draft_of

_KINDS = (("scripted", "script", SERIES[0]), ("learned", "trained policy", SERIES[1]))
"""Of the players: their kind, its label and its colour."""


def draw_times(results: dict[str, Any], path: Path) -> None:
    """Draw each system's mean time to a win against the adversary, for each track."""
    limit, tracks = results["config"]["game"]["time_limit"], results["tracks"]
    systems = sorted({row["system"] for told in tracks.values() for row in told["standings"]}, reverse=True)
    with require_extra("matplotlib", "cli").rc_context(RC):
        figure = require_extra("matplotlib.figure", "cli").Figure(figsize=(8, 3.0), layout="constrained")
        panels = figure.subplots(1, len(tracks), sharey=True, squeeze=False)[0]
        for axes, (track, told) in zip(panels, tracks.items(), strict=True):
            for kind, label, colour in _KINDS:
                rows = [row for row in told["standings"] if row["kind"] == kind]
                means = np.array([row["time_to_win"]["mean"] for row in rows])
                ends = np.array([row["time_to_win"]["ci95"] for row in rows]).reshape(-1, 2).T
                places = [systems.index(row["system"]) for row in rows]
                errors = np.maximum(np.abs(ends - means), 0.0)
                axes.errorbar(means, places, xerr=errors, fmt="o", markersize=4, color=colour, label=label)
            axes.set_yticks(range(len(systems)), systems)
            axes.set(xlabel="mean time to a win, s", xlim=(0, 1.02 * limit), title=track.replace("_", " "))
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=2, fontsize=8)
        with draft_of(path) as draft:
            figure.savefig(draft, dpi=DPI, format="png")


def draw_field(told: dict[str, Any], path: Path) -> None:
    """Draw the share of its games that each entrant wins against each, and each one's share of the mixture."""
    names, shares = told["order"], np.array(told["wins"])
    count = len(names)
    with require_extra("matplotlib", "cli").rc_context(RC | {"axes.grid": False}):
        figure = require_extra("matplotlib.figure", "cli").Figure(
            figsize=(0.42 * count + 4.0, 0.36 * count + 2.2), layout="constrained"
        )
        axes, bars = figure.subplots(1, 2, sharey=True, width_ratios=(count, 3))
        axes.imshow(100 * shares, cmap="Greens", vmin=0, vmax=100, aspect="auto")
        axes.set_xticks(range(count), names, rotation=60, ha="right", rotation_mode="anchor")
        axes.set_yticks(range(count), names)
        for (i, j), value in np.ndenumerate(shares):
            colour = "white" if value > 0.6 else "black"
            axes.text(j, i, f"{100 * value:.0f}", ha="center", va="center", fontsize=7, color=colour)
        axes.set_title("% of its games that the row wins against the column")
        bars.barh(range(count), 100 * np.array(told["game"]["mixture"]), color="tab:green")
        bars.set_title("mixture, %")
        with draft_of(path) as draft:
            figure.savefig(draft, dpi=DPI, format="png")
