"""Times to a decision; undecided games are right-censored (Kaplan & Meier, J. Am. Stat. Assoc. 53, 1958)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from swarm_pz.errors import require_extra

Array = NDArray[np.float64]
_HALF = 0.5 * (1 + 1e-12)
"""S is a product of floats: one half may come out slightly above it."""


def kaplan_meier(seconds: Sequence[float], decided: Sequence[bool]) -> tuple[float | None, float]:
    """Return the median time to a decision, and the mean restricted to the longest time: the area under S(t).

    The median is the first time at which the share S(t) of undecided games is at most one half, or None.
    """
    times, shares = _survival(seconds, decided)
    below = times[shares <= _HALF]
    ends = np.diff([0.0, *times, np.max(seconds)])
    return float(below[0]) if len(below) else None, float(ends @ [1.0, *shares])


def survival_curve(seconds: Sequence[float], decided: Sequence[bool]) -> tuple[list[float], list[float]]:
    """Return times and shares of the curve S(t), from (0, 1) to the longest time."""
    times, shares = _survival(seconds, decided)
    undecided = [1.0, *shares.tolist()]
    return [0.0, *times.tolist(), float(np.max(seconds))], [*undecided, undecided[-1]]


def _survival(seconds: Sequence[float], decided: Sequence[bool]) -> tuple[Array, Array]:
    """Return the times of decisions, and S(t) at each."""
    lengths, ended = np.asarray(seconds, np.float64), np.asarray(decided, bool)
    stats = require_extra("scipy.stats", "cli")
    curve = stats.ecdf(stats.CensoredData.right_censored(lengths, ~ended)).sf
    is_decision = np.isin(curve.quantiles, lengths[ended])
    return curve.quantiles[is_decision], curve.probabilities[is_decision]
