"""How long games last where some end undecided: a draw says only that a win takes longer.

Kaplan and Meier, "Nonparametric estimation from incomplete observations", J. Am. Stat. Assoc. 53, 1958: the share
S(t) of games undecided at t is the product, over the times of decisions up to t, of the share of the games still
running then that go on.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from swarm_pz.errors import ResultsError


def kaplan_meier(seconds: Sequence[float], decided: Sequence[bool]) -> tuple[float | None, float]:
    """Return the median time to a decision, and its mean restricted to the longest time seen: the area under S.

    The median is the first time at which at most half of the games are undecided: S(t) <= 1/2, as lifelines
    has it. Where S is one half exactly up to the next decision, others (R's `survfit`, numpy's `median`) take
    the middle between the two times. S is a quotient of whole numbers here: in floats a product that is one
    half can come out just above it, and the median one decision late. A game that ends undecided at the
    time of a decision counts as undecided at that time.

    Parameters
    ----------
    seconds : sequence of float
        Length of each game.
    decided : sequence of bool
        Whether it ended with a win; else its length is a lower bound.

    Returns
    -------
    median : float or None
        None if more than half are undecided after the last decision.
    mean : float

    Raises
    ------
    ResultsError
        If there are no games, as many lengths as outcomes are not given, or a length is no time.
    """
    median, mean = None, 0.0
    above, below, before = 1, 1, 0.0
    for moment, after_above, after_below in _survival(seconds, decided):
        mean += above / below * (moment - before)
        above, below, before = after_above, after_below, moment
        if median is None and 2 * above <= below:
            median = moment
    return median, mean + above / below * (float(np.max(seconds)) - before)


def survival_curve(seconds: Sequence[float], decided: Sequence[bool]) -> tuple[list[float], list[float]]:
    """Return the times at which games were decided, and the share undecided from each on; see `kaplan_meier`.

    Both begin with the start, 0 and 1, and end with the longest time seen.
    """
    times, shares = [0.0], [1.0]
    for moment, above, below in _survival(seconds, decided):
        times.append(moment)
        shares.append(above / below)
    return [*times, float(np.max(seconds))], [*shares, shares[-1]]


def _survival(seconds: Sequence[float], decided: Sequence[bool]) -> Iterator[tuple[float, int, int]]:
    """Yield each time of decisions, and the share undecided from it on, as a fraction of whole numbers."""
    lengths, ended = np.asarray(seconds, np.float64), np.asarray(decided, bool)
    if lengths.ndim != 1 or lengths.shape != ended.shape or not len(lengths):
        raise ResultsError(
            "survival is that of at least one game, each with a length and whether it was decided, got shapes "
            f"{lengths.shape} and {ended.shape}"
        )
    if not (np.isfinite(lengths) & (lengths >= 0)).all():
        raise ResultsError(f"lengths of games must be finite and not below 0, got {lengths.tolist()}")
    above, below = 1, 1
    for moment in np.unique(lengths[ended]).tolist():
        at_risk = int((lengths >= moment).sum())
        left = at_risk - int((ended & (lengths == moment)).sum())
        above, below = above * left, below * at_risk
        yield moment, above, below
