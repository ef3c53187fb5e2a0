"""Plots in one style, that of `plots.mplstyle`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.errors import require_extra
from swarm_pz.files import draft_of

GREY = "#868e96"


@contextmanager
def drawing(path: Path, size: tuple[float, float] | None = None) -> Iterator[Any]:
    """Yield an empty matplotlib figure, of a size in inches, and write it to a file when the block ends."""
    with require_extra("matplotlib.style", "cli").context("swarm_pz.rendering.plots"):
        figure = require_extra("matplotlib.figure", "cli").Figure(figsize=size)
        yield figure
        with draft_of(path) as draft:
            figure.savefig(draft)


def matrix(axes: Any, names: Sequence[str], shares: NDArray[np.float64], title: str) -> None:
    """Draw shares (n, n) of rows against columns as percentages, the darker the larger; NaN stays blank."""
    places = range(len(names))
    axes.imshow(shares, vmin=0, vmax=1, aspect="auto")
    axes.set_xticks(places, names, rotation=60, ha="right", rotation_mode="anchor")
    axes.set_yticks(places, names)
    for (i, j), value in np.ndenumerate(shares):
        if np.isfinite(value):
            colour = "white" if value > 0.6 else "black"
            axes.text(j, i, f"{100 * value:.0f}", ha="center", va="center", fontsize="small", color=colour)
    axes.grid(visible=False)
    axes.set_title(title)
