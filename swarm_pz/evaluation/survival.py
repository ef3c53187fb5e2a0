"""How long games last where some end undecided: a draw says only that a win takes longer.

Kaplan and Meier, "Nonparametric estimation from incomplete observations", J. Am. Stat. Assoc. 53, 1958: the share
S(t) of games undecided at t is the product, over the times of decisions up to t, of the share of the games still
running then that go on.
"""

from __future__ import annotations

from collections.abc import Sequence

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
    lengths, ended = np.asarray(seconds, np.float64), np.asarray(decided, bool)
    if lengths.ndim != 1 or lengths.shape != ended.shape or not len(lengths):
        raise ResultsError(
            "survival is that of at least one game, each with a length and whether it was decided, got shapes "
            f"{lengths.shape} and {ended.shape}"
        )
    if not (np.isfinite(lengths) & (lengths >= 0)).all():
        raise ResultsError(f"lengths of games must be finite and not below 0, got {lengths.tolist()}")
    median, mean = None, 0.0
    above, below = 1, 1  # survival, as a fraction
    before = 0.0
    for moment in np.unique(lengths[ended]).tolist():
        mean += above / below * (moment - before)
        at_risk = int((lengths >= moment).sum())
        left = at_risk - int((ended & (lengths == moment)).sum())
        above, below = above * left, below * at_risk
        if median is None and 2 * above <= below:
            median = moment
        before = moment
    return median, mean + above / below * (float(lengths.max()) - before)
