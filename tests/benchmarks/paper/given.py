"""What tests of claims are given: games that were not played, and flights that were not flown.

A figure decides its claim by the rule that stands in it, by the interval's end and not by the mean. So it is given what
games might have said, on either side of its bound.
"""

from __future__ import annotations

import json

import matplotlib
import numpy as np
from matplotlib.figure import Figure as Canvas

from benchmarks.paper.page import to_dict
from benchmarks.paper.style import RC
from swarm_pz.evaluation.rollout import Game

SEED = 3
_DRAWN: set[str] = set()


def found_by(module):
    """Return what the file of a figure would hold, and draw it the first time: what is drawn is there, and plain."""
    figure = module.FIGURE
    record = json.loads(json.dumps(to_dict(figure, figure.measure(SEED), SEED), allow_nan=False))
    if figure.name in _DRAWN:
        return record
    _DRAWN.add(figure.name)
    with matplotlib.rc_context(RC):
        canvas = Canvas(figsize=figure.size, layout="constrained")
        figure.draw(canvas, record["series"])
        canvas.draw_without_rendering()
    return record


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


def flights(monkeypatch, module, values_of):
    """Let every flight's metric be what a function of rules, command, seeds and seconds says; return what was flown."""
    flown = []

    def start(config, seeds, command):
        flown.append((config, tuple(seeds), np.asarray(command).tobytes()))
        return config, seeds, command

    def metric(flight, seconds=60, then=None):
        config, seeds, command = flight
        return values_of(config, command, len(seeds), seconds)

    monkeypatch.setattr(module, "start", start)
    monkeypatch.setattr(module, "metric_over_time", metric)
    return flown


def spread_around(mean, apart, seeds):
    """Samples of a mean, whose interval reaches about 0.31 times `apart` to each side for 40, 0.43 for 20."""
    return mean + apart * np.where(np.arange(seeds) % 2, 1.0, -1.0)
