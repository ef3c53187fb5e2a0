"""Players that see only the clock: they measure what play without observations is worth.

``open_loop.json`` holds the best players that a search found for tracks of the benchmark, and their scores there.
`python -m benchmarks.board.open_loop` writes it.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from swarm_pz.policies.scripted import CLOCK, View, tactic
from swarm_pz.policy import constant

FILE = Path(__file__).with_suffix(".json")
Images: TypeAlias = tuple[tuple[int, tuple[tuple[float, ...], ...]], ...]
"""Images, shown in this order again and again: the number of commands for each, and its rows (y, x)."""


def images_of(plain: list[Any]) -> Images:
    """Return images as the file holds them."""
    return tuple((int(count), tuple(tuple(map(float, row)) for row in image)) for count, image in plain)


def shown(images: Images, view: View) -> NDArray[np.float64]:
    """Return the images (n, A, A) that games show now; images on other grids are sampled at the cells' centres."""
    ends = np.cumsum([count for count, _ in images])
    turn = np.searchsorted(ends, view.steps % ends[-1], side="right")
    pictures = np.array([image for _, image in images])
    rows, columns = (np.floor(place * pictures.shape[-1]).astype(int) for place in (view.y, view.x))
    return np.asarray(pictures[turn[:, None, None], rows, columns])


BESTS: dict[str, Any] = json.loads(FILE.read_text())
"""By track: `KINDS`, each with ``images``, ``score`` and ``score_ci95``."""
KINDS = ("constant", "sequence", "lap")
CONSTANT, SEQUENCE = (images_of(BESTS["field"][name]["images"]) for name in ("constant", "sequence"))
"""Tuples, so that digests of the two tactics below include them."""


@tactic(sees=CLOCK)
@constant
def best_constant(view: View) -> NDArray[np.float64]:
    """Send one fixed density, the best that a search found against the field of the benchmark."""
    return shown(CONSTANT, view)


@tactic(sees=CLOCK)
def best_sequence(view: View) -> NDArray[np.float64]:
    """Send a few densities in turn by the clock, the best that a search found against the field of the benchmark."""
    return shown(SEQUENCE, view)
