"""Style of figures: colours, labels, and the square with its drones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.paper.coverage import COVERED, JUDGED, SECONDS
from swarm_pz.config import BLUE, GRID_CELLS, RED
from swarm_pz.errors import require_extra
from swarm_pz.rendering.board import INK, SHADE_COLOURS, TEAM_COLOURS

TEAMS = tuple(tuple(value / 255 for value in colour) for colour in TEAM_COLOURS)
"""Colours of red and blue."""
GROUND = tuple(tuple(value / 255 for value in colour) for colour in SHADE_COLOURS)
DARK = tuple(value / 255 for value in INK)
FADED = {"facecolor": "white", "alpha": 0.7, "linewidth": 0, "pad": 0.5}
GREY, PALE = "#868e96", "#dee2e6"
SERIES = ("#064b48", "#d9822b", "#6a4c93", "#4d6b1f")
"""Colours for things other than teams; in greyscale the first is darker than red. Lines also differ in their dashes."""
DASHES = ("-", "--", ":", "-.")
BRUSHES = {"attract": "#0b6e4f", "repel": "#7a4a00"}
"""Colours of a person's strokes."""
_MARKERS = ("o", "D")

WIDTH, RASTER = 7.16, 200
"""Width of a picture in inches, and its pixels per inch."""
POINTS = 7.0
TEXTS = ("font.size", "axes.titlesize", "axes.labelsize", "legend.fontsize", "xtick.labelsize", "ytick.labelsize")
LOOK = {**dict.fromkeys(TEXTS, POINTS), "lines.markersize": 3.5, "lines.linewidth": 1.1, "axes.linewidth": 0.6}
"""matplotlib's settings for pictures of this width, after those of `swarm_pz/rendering/plots.mplstyle`."""


def band(axes: Any, x: Any, series: dict[str, Any], colour: Any, dash: Any = "-", label: str | None = None) -> None:
    """Draw a mean as a line and its interval as a band; `series` holds `mean`, `low` and `high`."""
    axes.fill_between(x, series["low"], series["high"], color=colour, alpha=0.2, linewidth=0)
    axes.plot(x, series["mean"], linestyle=dash, color=colour, label=label)


def bound(axes: Any) -> None:
    """Draw our bound on the metric into axes of the metric over time."""
    axes.plot([JUDGED, JUDGED, SECONDS], [1e-5, COVERED, COVERED], "-", color=DARK, linewidth=0.6)
    look = {"ha": "right", "bbox": {"facecolor": "white", "alpha": 0.8, "linewidth": 0, "pad": 1}}
    axes.annotate(f"ours: {COVERED:g}", (SECONDS, COVERED), (0, 3), textcoords="offset points", **look)


def whisker(axes: Any, x: Any, value: Any, low: Any, high: Any, *, sideways: bool = False, **look: Any) -> None:
    """Draw values at places x with intervals, upright or sideways; all of them arrays or all of them numbers."""
    reach = [np.maximum(np.subtract(value, low), 0), np.maximum(np.subtract(high, value), 0)]
    places = (value, x) if sideways else (x, value)
    axes.errorbar(*places, **{"xerr" if sideways else "yerr": np.reshape(reach, (2, -1))}, capsize=2, **look)


def bars(axes: Any, rows: list[dict[str, Any]]) -> None:
    """Draw won, drawn and lost games of each player, the first at the top, with the win rate's interval.

    A row holds `policy`, `games`, `win`, `draw`, `loss` and `win_ci95`.
    """
    places, left = np.arange(len(rows))[::-1], np.zeros(len(rows))
    for key, label, colour in (("win", "won", SERIES[0]), ("draw", "drawn", PALE), ("loss", "lost", SERIES[1])):
        share: NDArray[np.float64] = np.array([row[key] / row["games"] for row in rows])
        axes.barh(places, share, left=left, color=colour, height=0.7, label=label)
        left += share
    rates = np.array([row["win"] / row["games"] for row in rows])
    low, high = np.array([row["win_ci95"] for row in rows]).T
    for look in ({"ecolor": "white", "elinewidth": 2.5, "capthick": 2.5}, {"ecolor": DARK, "label": "won, 95 %"}):
        whisker(axes, places, rates, low, high, sideways=True, fmt="none", **look)
    axes.set_yticks(places, [row["policy"] for row in rows])
    axes.set(xlim=(0, 1))
    axes.grid(visible=False)
    mark(axes, 0.5, "half", upright=True)


def mark(axes: Any, value: float, text: str, *, upright: bool = False, at: float = 0.995) -> None:
    """Draw a line across the axes for comparison, with a text left of a place `at`."""
    (axes.axvline if upright else axes.axhline)(value, color=GREY, linewidth=0.9)
    place = axes.get_xaxis_transform() if upright else axes.get_yaxis_transform()
    x, y, side = (value, 1.0, "center") if upright else (at, value, "right")
    axes.text(x, y, text, transform=place, color=GREY, ha=side, va="bottom", bbox=FADED)


def arena(axes: Any, title: str) -> None:
    """Make axes the square, in map widths."""
    axes.set(xlim=(0, 1), ylim=(0, 1), aspect="equal", title=title)
    axes.set_xlabel("x (map widths)")
    axes.set_ylabel("y (map widths)")
    axes.set(xticks=(0, 0.5, 1), yticks=(0, 0.5, 1))
    axes.grid(visible=False)
    for side in axes.spines.values():
        side.set_visible(True)


def captured_ground(axes: Any, cells: Sequence[Sequence[int]], team: int) -> None:
    """Hatch the cells (column, row) in which a team captures, upwards for red and downwards for blue."""
    side = 1 / GRID_CELLS
    squares = [patch("Rectangle", (side * column, side * row), side, side) for column, row in cells]
    collection = require_extra("matplotlib.collections", "cli").PatchCollection(
        squares,
        hatch="/////" if team == RED else "\\\\\\\\\\",
        facecolor=(*GROUND[team], 0.3),
        edgecolor=GROUND[team],
        linewidth=0,
        zorder=1,
    )
    axes.add_collection(collection)


def drones(axes: Any, positions: NDArray[np.float64], teams: NDArray[np.int64], size: float = 10.0) -> None:
    """Draw drones (N, 2): red discs and blue diamonds."""
    for team in (RED, BLUE):
        own = positions[teams == team]
        axes.scatter(
            *own.T, s=size, marker=_MARKERS[team], color=TEAMS[team], edgecolor="white", linewidth=0.3, zorder=3
        )


def patch(kind: str, place: tuple[float, float], *size: float, **look: Any) -> Any:
    """Make a "Rectangle" (by its corner) or a "Circle" (by its centre) to be added to axes."""
    return getattr(require_extra("matplotlib.patches", "cli"), kind)(place, *size, **look)


def swatch(
    text: str, colour: Any, *, marker: str = "none", line: float = 0.0, dash: str = "-", hollow: bool = False
) -> Any:
    """Make a legend's entry."""
    return require_extra("matplotlib.lines", "cli").Line2D(
        [], [], color=colour, marker=marker, linewidth=line, linestyle=dash if line else "none",
        markerfacecolor="none" if hollow else colour, label=text,
    )  # fmt: skip


def legend_below(figure: Any, handles: Any = None, columns: int = 4) -> None:
    """Put a legend under the whole figure: of some entries, of some axes, or of all of them, each label once."""
    if hasattr(handles, "get_legend_handles_labels"):
        handles, _ = handles.get_legend_handles_labels()
    elif handles is None:
        handles = [one for axes in figure.axes for one in axes.get_legend_handles_labels()[0]]
    entries = list({one.get_label(): one for one in reversed(handles)}.values())[::-1]
    figure.legend(handles=entries, loc="outside lower center", ncols=columns, columnspacing=1.2, handlelength=2.2)


def letters(figure: Any) -> None:
    """Put (a), (b), ... before the titles of the axes of a figure that has several, from the top left on."""
    where = {axes: axes.get_subplotspec().get_position(figure) for axes in figure.axes if axes.get_subplotspec()}
    every = sorted(where, key=lambda axes: (-round(where[axes].y1, 2), where[axes].x0))
    if len(every) > 1:
        for place, axes in enumerate(every):
            axes.set_title(f"({chr(ord('a') + place)}) {axes.get_title(loc='left')}")
