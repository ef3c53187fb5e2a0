"""The picture of the comparison with flocking."""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.paper import style
from benchmarks.paper.claims.flocking_flights import MODES, NEAR, REACHED
from benchmarks.paper.coverage import SECONDS


def draw(figure: Any, series: dict[str, Any]) -> None:
    """Draw where drones were, the metric, how the modes were filled, and what an attractor's weight changes."""
    top, bottom = figure.subfigures(2, 1, height_ratios=[1, 1.05])
    _draw_maps(top, series)
    left, middle, right = bottom.subplots(1, 3, width_ratios=[1.2, 1, 1])
    times = np.arange(1, SECONDS + 1)
    for (name, flight), colour, dash in zip(series["flights"].items(), style.SERIES, style.DASHES, strict=False):
        commands = flight["commands"]
        style.band(left, times, flight["metric"], colour, dash, f"{name} ({commands} command{'s' * (commands > 1)})")
    style.mark(left, REACHED, f"reached: {REACHED:g}", at=0.8)
    left.set(yscale="log", xlabel="time (s)", ylabel="ergodic metric E (no unit)", xlim=(0, SECONDS))
    left.set_title("mean over seeds, band 95 %")
    _draw_modes(middle, series)
    _draw_weights(right, series)
    style.legend_below(figure, left, columns=3)


def _draw_maps(figure: Any, series: dict[str, Any]) -> None:
    maps = {"asked for": series["target"]} | {name: flight["map"] for name, flight in series["flights"].items()}
    panels = figure.subplots(1, len(maps), sharey=True)
    image = None
    for axes, (name, cells) in zip(panels, maps.items(), strict=True):
        style.arena(axes, name)
        image = axes.imshow(cells, origin="lower", extent=(0, 1, 0, 1), cmap="Greys", vmin=0, vmax=8)
        for mode in MODES:
            axes.add_patch(style.patch("Circle", mode, NEAR, fill=False, edgecolor=style.DARK, linestyle="--"))
        axes.label_outer()
    figure.colorbar(image, ax=panels, label=f"density in {SECONDS} s / even cover", extend="max")


def _draw_modes(axes: Any, series: dict[str, Any]) -> None:
    asked = series["asked"]
    for mode in range(2):
        wanted = asked["share"][mode]
        axes.plot([mode - 0.4, mode + 0.4], [wanted, wanted], color=style.DARK, linewidth=2)
        text = f"asked: {wanted:.2f}, rms {asked['reach'][mode]:.2f}"
        axes.annotate(text, (mode, 1.16), ha="center", va="top", fontsize=8)
        for place, (flight, colour) in enumerate(zip(series["flights"].values(), style.SERIES, strict=False)):
            x, reach = mode + 0.26 * (place - 1), flight["reach"][mode]
            value, low, high = (flight["share"][key][mode] for key in ("mean", "low", "high"))
            axes.bar(x, value, 0.22, color=colour, alpha=0.75)
            style.whisker(axes, [x], value, low, high, fmt="none", ecolor=style.DARK)
            text = "never there" if reach is None else f"rms {reach:.2f}"
            look = {"color": "white" if value > 0.3 else style.DARK, "fontsize": 8}
            foot = 0.02 if value > 0.3 else max(value, wanted) + 0.02
            axes.annotate(text, (x, foot), rotation=90, ha="center", va="bottom", **look)
    axes.set_xticks([0, 1], ["diffuse, lower left", "compact, upper right"])
    axes.set(ylabel=f"share of time within {NEAR:g} of a mode", ylim=(0, 1.18))
    axes.set_title("time near each mode; rms: distance from it")


def _draw_weights(axes: Any, series: dict[str, Any]) -> None:
    found, colour = series["spreads"], style.SERIES[1]
    axes.plot(series["weights"], found["mean"], color=colour, linewidth=1.2)
    style.whisker(axes, series["weights"], found["mean"], found["low"], found["high"], fmt="o", color=colour)
    for reach, mode, side in zip(series["asked"]["reach"], ("diffuse", "compact"), ("bottom", "top"), strict=True):
        axes.axhline(reach, color=style.GREY, linewidth=0.9)
        axes.text(max(series["weights"]), reach, f"asked of the {mode} spot", color=style.GREY, ha="right", va=side)
    axes.set(xlabel="weight of the attractor (all that there are)", ylabel="rms distance from it (map widths)")
    axes.set_ylim(0, 1.25 * max(*series["asked"]["reach"], *found["high"]))
    axes.set_title("one flock, one attractor in the middle")
