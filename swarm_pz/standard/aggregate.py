"""One number of many training seeds, and its interval.

Agarwal, Schwarzer, Castro, Courville & Bellemare, "Deep reinforcement learning at the edge of the statistical
precipice", NeurIPS 2021: the interquartile mean over runs, percentile intervals from a bootstrap that draws runs anew
within each task, and the probability of improvement. A score that is not there is NaN.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from swarm_pz.evaluation.intervals import RESAMPLES

Array = NDArray[np.float64]


def interquartile_mean(scores: Array) -> Array:
    """Return the mean of the middle half of all scores (..., runs, tasks)."""
    ordered = np.sort(np.ascontiguousarray(scores.reshape(*scores.shape[:-2], -1)))
    cut = ordered.shape[-1] // 4
    return np.asarray(ordered[..., cut : ordered.shape[-1] - cut].mean(axis=-1))


def mean_of_known(scores: Array, axis: int) -> Array:
    """Return the mean of what is not NaN; NaN where nothing is."""
    known = (~np.isnan(scores)).sum(axis=axis)
    return np.where(known > 0, np.nansum(scores, axis=axis) / np.maximum(known, 1), np.nan)


def probability_of_improvement(scores: Array, baseline: Array) -> float:
    """Return the probability that a run is better than one of the baseline, the mean over tasks; a tie is half."""
    better = (1.0 + np.sign(scores[:, None] - baseline[None])) / 2.0
    return float(mean_of_known(mean_of_known(better.reshape(-1, scores.shape[1]), 0), 0))


def drawn_runs(scores: Array, generator: np.random.Generator, count: int) -> Array:
    """Return scores (count, runs, tasks) of runs drawn anew in each task, so many times."""
    runs, tasks = scores.shape
    return np.asarray(scores[generator.integers(runs, size=(count, runs, tasks)), np.arange(tasks)])


def drawn_pairs(pairs: Sequence[Array], generator: np.random.Generator, count: int) -> Array:
    """Return scores (count, 1, tasks) of one run, from pairs of games drawn anew in each task, so many times.

    Of each task, `pairs` has the scores of its pairs (n,), none if the run has not played it.
    """
    drawn = [
        task[generator.integers(len(task), size=(count, len(task)))].mean(axis=1)
        if len(task)
        else np.full(count, np.nan)
        for task in pairs
    ]
    return np.stack(drawn, axis=-1)[:, None]


def resampled(draw: Callable[[np.random.Generator, int], Array]) -> Array:
    """Return resamples for intervals, along the first axis, from a fixed seed."""
    return draw(np.random.default_rng(0), RESAMPLES)
