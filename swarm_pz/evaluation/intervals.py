"""Statistics of few games, with 95 % intervals."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_pz.errors import ResultsError, require_extra

Array = NDArray[np.float64]

RESAMPLES = 2000
LEVEL = 0.95
_TAILS = ((1 - LEVEL) / 2, (1 + LEVEL) / 2)


def middle(drawn: ArrayLike) -> tuple[Array, Array]:
    """Return the ends of the central `LEVEL` of draws along the first axis."""
    low, high = np.quantile(np.asarray(drawn, np.float64), _TAILS, axis=0)
    return np.asarray(low), np.asarray(high)


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Return Wilson's interval of a share of at least one trial (Wilson, J. Am. Stat. Assoc. 22, 1927)."""
    if not 0 <= successes <= trials or trials < 1:
        raise ResultsError(f"a share is of at least one trial and of successes among them, got {successes} of {trials}")
    stats = require_extra("scipy.stats", "cli")
    interval = stats.binomtest(int(successes), int(trials)).proportion_ci(LEVEL, method="wilson")
    return float(interval.low), float(interval.high)


def over_runs(values: ArrayLike) -> tuple[float, float]:
    """Return Student's interval of the mean of at least two runs (n,), cut to [0, 1] since they are shares."""
    stats = require_extra("scipy.stats", "cli")
    runs = _samples(values)
    if len(runs) < 2:
        raise ResultsError("an interval over runs needs at least two")
    half = float(stats.t.ppf(_TAILS[1], len(runs) - 1) * runs.std(ddof=1) / np.sqrt(len(runs)))
    return max(float(runs.mean()) - half, 0.0), min(float(runs.mean()) + half, 1.0)


def bootstrap(values: ArrayLike, statistic: Callable[[Any], Any] | None = None) -> tuple[Array, Array, Array]:
    """Return a statistic of samples (n, ...), by default the mean, and its percentile bootstrap interval.

    The resamples are always the same (Efron, Annals of Statistics 7, 1979).
    """
    samples = _samples(values)
    compute = statistic if statistic is not None else (lambda drawn: drawn.mean(axis=0))
    generator = np.random.default_rng(0)
    drawn = [compute(samples[generator.integers(len(samples), size=len(samples))]) for _ in range(RESAMPLES)]
    return np.asarray(compute(samples)), *middle(drawn)


def _samples(values: ArrayLike) -> Array:
    samples = np.asarray(values, np.float64)
    if samples.ndim == 0 or len(samples) == 0:
        raise ResultsError(f"there must be at least one sample, got an array of shape {samples.shape}")
    return samples


def mean_with_interval(values: ArrayLike) -> tuple[float, tuple[float, float]]:
    """Return the mean of samples (n,) and its bootstrap interval."""
    mean, low, high = bootstrap(values)
    return float(mean), (float(low), float(high))


def median_with_interval(values: ArrayLike) -> tuple[float, tuple[float, float]]:
    """Return the median of samples (n,), which may be infinite, and its interval between order statistics.

    The number of samples below the median is binomial, whatever their distribution (Thompson, Annals of Mathematical
    Statistics 7, 1936). A NaN, or no sample, raises a ResultsError.
    """
    stats = require_extra("scipy.stats", "cli")
    ordered = np.sort(_samples(values))
    if np.isnan(ordered).any():
        raise ResultsError(f"samples must be numbers or infinite, got NaN among {ordered.tolist()}")
    count = len(ordered)
    below = max(int(stats.binom.ppf(_TAILS[0], count, 0.5)) - 1, 0)
    median = (ordered[(count - 1) // 2] + ordered[count // 2]) / 2
    return float(median), (float(ordered[below]), float(ordered[count - 1 - below]))


def rounded(values: ArrayLike, digits: int = 4) -> Any:
    """Return numbers as plain lists, rounded to `digits` significant digits."""
    array = np.asarray(values, np.float64)
    safe = np.where((array == 0) | ~np.isfinite(array), 1.0, np.abs(array))
    scale = 10.0 ** (digits - 1 - np.floor(np.log10(safe)))
    return (np.where(np.isfinite(array), np.round(array * scale) / scale, array)).tolist()
