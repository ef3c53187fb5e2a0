"""One number of many runs and tasks, as rliable computes it, and how sure it is.

Agarwal, Schwarzer, Castro, Courville & Bellemare, "Deep reinforcement learning at the edge of the statistical
precipice", NeurIPS 2021: the interquartile mean over runs and tasks, percentile intervals from a bootstrap that draws
runs anew within each task, the performance profile, and the probability of improvement.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from swarm_pz.evaluation.intervals import RESAMPLES

Array = NDArray[np.float64]
_AT_ONCE = 2**20
"""Pairs of games that are drawn in one piece, since all of them would fill the memory."""


def interquartile_mean(scores: Array) -> Array:
    """Return the mean of the middle half of all scores (..., runs, tasks)."""
    ordered = np.sort(np.ascontiguousarray(scores.reshape(*scores.shape[:-2], -1)))
    cut = ordered.shape[-1] // 4
    return np.asarray(ordered[..., cut : ordered.shape[-1] - cut].mean(axis=-1))


def performance_profile(scores: Array, thresholds: Sequence[float]) -> Array:
    """Return the share of scores (..., runs, tasks) above each threshold, the last axis."""
    return np.stack([(scores > threshold).mean(axis=(-2, -1)) for threshold in thresholds], axis=-1)


def probability_of_improvement(scores: Array, baseline: Array) -> float:
    """Return how likely a run of one method is better than one of another, the mean over tasks; a tie is half."""
    better = (scores[:, None] > baseline[None]).mean(axis=(0, 1)) + (scores[:, None] == baseline[None]).mean(
        axis=(0, 1)
    ) / 2
    return float(better.mean())


def drawn_runs(scores: Array, generator: np.random.Generator, count: int) -> Array:
    """Return scores (count, runs, tasks) of runs drawn anew in each task, so many times."""
    runs, tasks = scores.shape
    return np.asarray(scores[generator.integers(runs, size=(count, runs, tasks)), np.arange(tasks)])


def drawn_pairs(pairs: Sequence[Array], generator: np.random.Generator, count: int) -> Array:
    """Return scores (count, 1, tasks) of one run, from pairs of games drawn anew in each task, so many times.

    Of each task, `pairs` has points and games (n, 2).
    """
    counts = [len(task) for task in pairs]
    below, ends = np.repeat(counts, counts), np.cumsum(counts)
    step = max(1, _AT_ONCE // len(below))
    found = np.empty((count, 1, len(pairs)))
    for first in range(0, count, step):
        part = found[first : first + step, 0]
        drawn = generator.integers(below, size=(len(part), len(below))).T
        for place, (task, end) in enumerate(zip(pairs, ends, strict=True)):
            points, games = np.take(task, drawn[end - len(task) : end], axis=0).sum(axis=0).T
            part[:, place] = points / games
    return found


def resampled(draw: Callable[[np.random.Generator, int], Array]) -> Array:
    """Return what is drawn anew for intervals, along the first axis: always the same."""
    return draw(np.random.default_rng(0), RESAMPLES)
