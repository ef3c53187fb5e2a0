"""What a study found: conditions compared within participants.

Games of one person are not independent, so a person's games are averaged first, and persons are compared with
themselves. Whether a difference could be chance is asked of the signs of these differences, which are as likely + as -
where conditions do not differ (Fisher, The Design of Experiments, 1935): a test that is exact for any number of
participants, and an interval of all differences that it does not refuse.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_pz.errors import ResultsError
from swarm_pz.evaluation.intervals import LEVEL
from swarm_pz.evaluation.survival import kaplan_meier

_EXACT = 14
"""Participants up to which all signs are tried; else so many draws are."""
_DRAWS = 20_000
_STEPS = 40
"""Halvings of where an interval's end may be."""


@dataclass(frozen=True, kw_only=True)
class StudyGame:
    """A game that counts.

    Attributes
    ----------
    participant, condition : str
    won : bool
        By the participant.
    seconds : float
        Length of the game.
    decided : bool
        Whether anybody won; else it would have lasted longer.
    """

    participant: str
    condition: str
    won: bool
    seconds: float
    decided: bool


@dataclass(frozen=True, kw_only=True)
class ConditionRow:
    """A condition's games: how many, the share won with its interval, and how long they last (Kaplan-Meier)."""

    condition: str
    participants: int
    games: int
    win_rate: float
    low: float
    high: float
    median_s: float | None
    restricted_mean_s: float


@dataclass(frozen=True, kw_only=True)
class Comparison:
    """A measure under one condition less that under another, in the mean of the participants who met both.

    Attributes
    ----------
    measure : str
        "win_rate", "restricted_mean_s", or a form's score.
    first, second : str
    participants : int
    difference, low, high : float
        With its 95 % interval; infinite ends where there are too few participants to exclude anything.
    p : float
        Chance of a difference as large or larger if the conditions do not differ.
    """

    measure: str
    first: str
    second: str
    participants: int
    difference: float
    low: float
    high: float
    p: float


def conditions(games: Sequence[StudyGame]) -> list[ConditionRow]:
    """Return a row for each condition, in the order of their first games."""
    rows = []
    for condition in dict.fromkeys(game.condition for game in games):
        own = [game for game in games if game.condition == condition]
        median, mean = kaplan_meier([game.seconds for game in own], [game.decided for game in own])
        low, high = win_interval([[game.won for game in own if game.participant == one] for one in _people(own)])
        rows.append(
            ConditionRow(
                condition=condition,
                participants=len(_people(own)),
                games=len(own),
                win_rate=float(np.mean([game.won for game in own])),
                low=low,
                high=high,
                median_s=median,
                restricted_mean_s=mean,
            )
        )
    return rows


def _people(games: Sequence[StudyGame]) -> list[str]:
    return list(dict.fromkeys(game.participant for game in games))


def win_interval(people: Sequence[Sequence[bool]]) -> tuple[float, float]:
    """Return the 95 % interval of the share of games won, of which a participant's are alike.

    Wilson's, of as many independent games as would be worth these: fewer by as much as the shares of participants
    differ more than chance lets them (Korn and Graubard, Survey Methodology 24, 1998). With one participant all
    games may be worth one.

    Parameters
    ----------
    people : sequence of sequence of bool
        Games won and not, a participant each.
    """
    wins, games = np.array([sum(own) for own in people], np.float64), np.array([len(own) for own in people], np.float64)
    share, total, count = wins.sum() / games.sum(), games.sum(), len(people)
    binomial = share * (1.0 - share) / total
    if count > 1:
        between = count / (count - 1) * ((wins - share * games) ** 2).sum() / total**2
        total /= max(between / binomial, 1.0) if binomial > 0.0 else 1.0
    else:
        total = 1.0
    z = NormalDist().inv_cdf((1.0 + LEVEL) / 2.0)
    middle = (share + z**2 / (2.0 * total)) / (1.0 + z**2 / total)
    half = z / (1.0 + z**2 / total) * np.sqrt(share * (1.0 - share) / total + z**2 / (4.0 * total**2))
    return float(max(middle - half, 0.0)), float(min(middle + half, 1.0))


def compare(games: Sequence[StudyGame]) -> list[Comparison]:
    """Return each pair of conditions compared, by the share won and by how long games last."""
    names = list(dict.fromkeys(game.condition for game in games))
    longest = max((game.seconds for game in games), default=0.0)
    found = []
    for first, second in itertools.combinations(names, 2):
        for measure in ("win_rate", "restricted_mean_s"):
            values = [_of_person(games, condition, measure, longest) for condition in (first, second)]
            found.append(compare_values(measure, (first, second), (values[0], values[1])))
    return [one for one in found if one is not None]


def compare_values(
    measure: str, conditions: tuple[str, str], values: tuple[Mapping[str, float], Mapping[str, float]]
) -> Comparison | None:
    """Return two conditions compared by a value of each participant; None if nobody met both."""
    both = [person for person in values[0] if person in values[1]]
    if not both:
        return None
    differences = np.array([values[0][person] - values[1][person] for person in both])
    low, high = interval(differences)
    return Comparison(
        measure=measure,
        first=conditions[0],
        second=conditions[1],
        participants=len(both),
        difference=float(differences.mean()),
        low=low,
        high=high,
        p=sign_test(differences),
    )


def _of_person(games: Sequence[StudyGame], condition: str, measure: str, longest: float) -> dict[str, float]:
    """Return each participant's mean in a condition; who wins nobody plays to the longest time."""
    values: dict[str, list[float]] = {}
    for game in games:
        if game.condition == condition:
            lasted = game.seconds if game.decided else longest
            values.setdefault(game.participant, []).append(float(game.won) if measure == "win_rate" else lasted)
    return {person: float(np.mean(own)) for person, own in values.items()}


def sign_test(differences: ArrayLike) -> float:
    """Return how likely a mean as far from zero or farther is, if each difference (n,) had either sign by chance.

    Raises
    ------
    ResultsError
        If there are no differences.
    """
    given = np.asarray(differences, np.float64)
    if given.ndim != 1 or not len(given) or not np.isfinite(given).all():
        raise ResultsError(f"a test of signs is of at least one finite difference, got {given.tolist()}")
    means = _means(given)
    return float((np.abs(means) >= abs(given.mean()) * (1.0 - 1e-9)).mean())


def _means(differences: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the means under all signs, or under many drawn ones, the given ones among them."""
    return np.asarray(_signs(len(differences)) @ differences / len(differences))


@functools.lru_cache(maxsize=4)
def _signs(count: int) -> NDArray[np.float64]:
    if count <= _EXACT:
        return np.array(list(itertools.product((1.0, -1.0), repeat=count)))
    signs = np.random.default_rng(0).choice((1.0, -1.0), size=(_DRAWS, count))
    signs[0] = 1.0
    return signs


def interval(differences: ArrayLike) -> tuple[float, float]:
    """Return the ends of the interval of means that the test of signs does not refuse at 5 %."""
    given = np.asarray(differences, np.float64)
    mean, wide = float(given.mean()), float(np.ptp(given)) + 1e-9
    return _end(given, mean, -wide), _end(given, mean, wide)


def _end(given: NDArray[np.float64], mean: float, reach: float) -> float:
    if sign_test(given - (mean + reach)) > 1.0 - LEVEL:
        return float(np.copysign(np.inf, reach))
    kept, refused = 0.0, 1.0
    for _ in range(_STEPS):
        between = (kept + refused) / 2.0
        if sign_test(given - (mean + between * reach)) > 1.0 - LEVEL:
            kept = between
        else:
            refused = between
    return mean + kept * reach
