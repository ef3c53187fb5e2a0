"""What tests of claims are given: games that were not played, and flights that were not flown.

A figure decides its claim by the rule that stands in it, by the interval's end and not by the mean. So it is given what
games might have said, on either side of its bound.
"""

from __future__ import annotations

import numpy as np
import pytest

from swarm_pz.evaluation import intervals
from swarm_pz.evaluation.rollout import Game

SEED = 3


@pytest.fixture(autouse=True)
def few_resamples(monkeypatch):
    """Take fewer resamples than results do: no case here is near its bound."""
    monkeypatch.setattr(intervals, "RESAMPLES", 250)


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
    """Let every flight's metric be what a function of rules, seeds and seconds says; return what was flown."""
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
