"""Curves of the ergodic metric over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from benchmarks.paper import style
from benchmarks.paper.coverage import COVERED, JUDGED, SECONDS

COLOURS = (*style.SERIES, style.DARK, style.GREY)
DASHES = (*style.DASHES, (0, (5, 1, 1, 1, 1, 1)), (0, (1, 3)))


def over_time(axes: Any, series: Mapping[str, Mapping[str, Sequence[float]]]) -> None:
    """Draw means with bands over the seconds, a line for each entry of `series`, and our bound."""
    times = np.arange(1, SECONDS + 1)
    for (label, values), colour, dash in zip(series.items(), COLOURS, DASHES, strict=False):
        style.band(axes, times, dict(values), colour, dash, label)
    bound(axes)
    axes.set(yscale="log", xlabel="time (s)", xlim=(0, SECONDS), ylim=(1e-5, 1.0))


def bound(axes: Any) -> None:
    """Draw our bound on the metric."""
    axes.plot([JUDGED, JUDGED, SECONDS], [1e-5, COVERED, COVERED], "-", color=style.DARK, linewidth=0.6)
    look = {"ha": "right", "bbox": {"facecolor": "white", "alpha": 0.8, "linewidth": 0, "pad": 1}}
    axes.annotate(f"ours: {COVERED:g}", (SECONDS, COVERED), (0, 3), textcoords="offset points", **look)
