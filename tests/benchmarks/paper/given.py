"""Games and flights made by hand for tests of claims.

A figure decides each part of its claim by the interval's end. So tests make results on either side of its bound.
"""

from __future__ import annotations

import json
from types import SimpleNamespace

import matplotlib
import numpy as np
from matplotlib.text import Text

from benchmarks.paper.figure import Setting
from benchmarks.paper.page import on_canvas, to_dict
from benchmarks.paper.style import LEAST_POINTS, PRINT
from swarm_pz.evaluation.rollout import Game

SEED = 3
SETTING = Setting("paper", SEED)
_DRAWN: set[str] = set()


def found_by(module, setting=SETTING):
    """Return the record of a figure, with `holds` of the paper's parts and of ours, and the values.

    The first time the figure is drawn: what is drawn is there, is plain, and can be read where it is printed.
    """
    figure = module.FIGURE
    record = json.loads(json.dumps(to_dict(figure, figure.measure(setting), setting), allow_nan=False))
    if figure.name not in _DRAWN:
        _DRAWN.add(figure.name)
        with matplotlib.rc_context(PRINT):
            for columns in (1, 2):
                can_be_read(on_canvas(figure, record["series"], columns))
    parts = record["parts"]
    return SimpleNamespace(
        papers=[part["holds"] for part in parts if not part["ours"]],
        ours=[part["holds"] for part in parts if part["ours"] and part["holds"] is not None],
        values=[part["value"] for part in parts],
        verdict=record["verdict"],
        record=record,
    )


def can_be_read(canvas):
    """Check that a picture has no headline, no text below 7 points, and none beyond its edges."""
    canvas.draw_without_rendering()
    assert canvas.get_suptitle() == ""
    for text in canvas.findobj(Text):
        assert text.get_fontsize() >= LEAST_POINTS or not text.get_text().strip(), text
    drawn = canvas.get_tightbbox()
    assert drawn.x0 > -0.03 and drawn.x1 < canvas.get_figwidth() + 0.03, drawn
    assert drawn.y0 > -0.03 and drawn.y1 < canvas.get_figheight() + 0.03, drawn


def game(number, outcome="win", *, seconds=10.0, captures=3, sizes=(10, 20)):
    return Game(
        pair=number // 2,
        side=("red", "blue")[number % 2],
        outcome=outcome,
        share=float(outcome == "win"),
        seconds=seconds,
        captures=captures,
        recaptures=0,
        fingerprint=str(number).encode(),
        sizes=list(sizes),
    )


def results(wins, count, losing="loss"):
    return ["win"] * wins + [losing] * (count - wins)


def spread_around(mean, apart, seeds):
    """Samples of a mean, whose interval reaches about 0.31 times `apart` to each side for 40, 0.43 for 20."""
    return mean + apart * np.where(np.arange(seeds) % 2, 1.0, -1.0)
