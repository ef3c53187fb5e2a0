"""One number of many runs and tasks, as rliable computes it, and how sure it is.

Agarwal, Schwarzer, Castro, Courville & Bellemare, "Deep reinforcement learning at the edge of the statistical
precipice", NeurIPS 2021: the interquartile mean over runs and tasks, percentile intervals from a bootstrap that draws
runs anew within each task, the performance profile, and the probability of improvement.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from swarm_pz.evaluation.intervals import RESAMPLES, middle

Array = NDArray[np.float64]
Statistic = Callable[[Array], Array]


def interquartile_mean(scores: Array) -> float:
    """Return the mean of the middle half of all scores (runs, tasks)."""
    ordered = np.sort(scores, axis=None)
    cut = len(ordered) // 4
    return float(ordered[cut : len(ordered) - cut].mean())


def performance_profile(scores: Array, thresholds: Sequence[float]) -> Array:
    """Return the share of scores (runs, tasks) above each threshold."""
    return np.array([float((scores > threshold).mean()) for threshold in thresholds])


def probability_of_improvement(scores: Array, baseline: Array) -> float:
    """Return how likely a run of one method is better than one of another, the mean over tasks; a tie is half."""
    better = (scores[:, None] > baseline[None]).mean(axis=(0, 1)) + (scores[:, None] == baseline[None]).mean(
        axis=(0, 1)
    ) / 2
    return float(better.mean())


def drawn_runs(scores: Array, generator: np.random.Generator) -> Array:
    """Return scores (runs, tasks) of runs drawn anew in each task."""
    runs, tasks = scores.shape
    return np.asarray(scores[generator.integers(runs, size=(runs, tasks)), np.arange(tasks)])


def drawn_pairs(pairs: Sequence[Array], generator: np.random.Generator) -> Array:
    """Return scores (1, tasks) of one run, from pairs of games drawn anew in each task: (n, 2) points and games."""
    drawn = [task[generator.integers(len(task), size=len(task))].sum(axis=0) for task in pairs]
    return np.array([[points / games for points, games in drawn]])


def interval(draw: Callable[[np.random.Generator], Array], statistic: Statistic) -> tuple[Array, Array]:
    """Return the ends of the intervals of a statistic over scores that are drawn anew, always the same ones."""
    generator = np.random.default_rng(0)
    return middle([statistic(draw(generator)) for _ in range(RESAMPLES)])
