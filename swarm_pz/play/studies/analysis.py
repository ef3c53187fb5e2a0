"""Comparison of a study's conditions within participants.

Games of one person are not independent, so a person's games are averaged first, and persons are compared with
themselves. The test flips the signs of these differences, which are as likely + as - where conditions do not differ
(Fisher, The Design of Experiments, 1935). It is exact for few participants, and its interval holds all differences that
it does not refuse.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_pz.evaluation.intervals import LEVEL
from swarm_pz.evaluation.survival import kaplan_meier
from swarm_pz.play.studies.rows import GameRow

_EXACT = 14
"""Participants up to which all signs are tried; else so many draws are."""
_DRAWS = 20_000


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

    `measure` is "win_rate", "restricted_mean_s", or a form's score. The ends of the 95 % interval are infinite where
    there are too few participants to exclude anything. `p` is the chance of a difference as large or larger if the
    conditions do not differ.
    """

    measure: str
    first: str
    second: str
    participants: int
    difference: float
    low: float
    high: float
    p: float


def conditions(games: Sequence[GameRow]) -> list[ConditionRow]:
    """Return a row for each condition, in the order of their first games."""
    rows = []
    for condition in dict.fromkeys(game.condition for game in games):
        own = [game for game in games if game.condition == condition]
        people: dict[str, list[bool]] = {}
        for game in own:
            people.setdefault(game.participant, []).append(game.won)
        median, mean = kaplan_meier([game.seconds for game in own], [game.decided for game in own])
        low, high = win_interval(list(people.values()))
        rows.append(
            ConditionRow(
                condition=condition,
                participants=len(people),
                games=len(own),
                win_rate=float(np.mean([game.won for game in own])),
                low=low,
                high=high,
                median_s=median,
                restricted_mean_s=mean,
            )
        )
    return rows


def win_interval(people: Sequence[Sequence[bool]]) -> tuple[float, float]:
    """Return the 95 % interval of the share of games won; `people` are the wins and losses of each participant.

    Wilson's, of as many independent games as would be worth these: fewer by as much as the shares of participants
    differ more than chance lets them (Korn and Graubard, Survey Methodology 24, 1998). With one participant all
    games may be worth one.
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


def compare(games: Sequence[GameRow]) -> list[Comparison]:
    """Return each pair of conditions compared, by the share won and by how long games last."""
    longest = max((game.seconds for game in games), default=0.0)
    values: dict[str, dict[str, dict[str, list[float]]]] = {"win_rate": {}, "restricted_mean_s": {}}
    for game in games:
        lasted = game.seconds if game.decided else longest  # without a winner it would go on
        for measure, value in zip(values, (float(game.won), lasted), strict=True):
            values[measure].setdefault(game.condition, {}).setdefault(game.participant, []).append(value)
    found = []
    for first, second in itertools.combinations(values["win_rate"], 2):
        for measure, of in values.items():
            means = [{one: float(np.mean(own)) for one, own in of[name].items()} for name in (first, second)]
            found.append(compare_values(measure, (first, second), (means[0], means[1])))
    return [one for one in found if one is not None]


def compare_values(
    measure: str, conditions: tuple[str, str], values: tuple[Mapping[str, float], Mapping[str, float]]
) -> Comparison | None:
    """Return two conditions compared by a value of each participant; None if nobody met both."""
    differences = [values[0][person] - values[1][person] for person in values[0] if person in values[1]]
    if not differences:
        return None
    low, high, p = sign_test(differences)
    first, second = conditions
    return Comparison(
        measure=measure,
        first=first,
        second=second,
        participants=len(differences),
        difference=float(np.mean(differences)),
        low=low,
        high=high,
        p=p,
    )


def sign_test(differences: ArrayLike) -> tuple[float, float, float]:
    """Return the ends of the interval of a mean of n >= 1 differences (n,), and p: the chance of a mean as far from 0.

    A shift d is refused if, of all ways to flip signs, at most 5 % move the mean of the differences less d as far
    from zero or farther: those that flip a subset whose own mean is at most d, or the rest of one (Hartigan, J. Am.
    Stat. Assoc. 64, 1969). SciPy's `permutation_test` gives p alone; here the same flips give both.
    """
    given = np.asarray(differences, np.float64)
    flips, total = _flips(len(given)), given.sum()
    sums, counts = flips @ given, flips.sum(axis=1)
    p = float((np.abs(total - 2.0 * sums) >= abs(total) * (1.0 - 1e-9)).mean())
    sums, counts = np.concatenate([sums, total - sums]), np.concatenate([counts, len(given) - counts])
    low, high = (
        np.sort(np.divide(sums, counts, out=np.full(len(sums), end), where=counts > 0)) for end in (-np.inf, np.inf)
    )
    refused = int((1.0 - LEVEL) * len(flips))
    return float(low[refused]), float(high[-1 - refused]), p


@functools.lru_cache(maxsize=4)
def _flips(count: int) -> NDArray[np.float64]:
    """Return which signs are flipped, a way each row: all ways, or many drawn ones, the first of which flips none."""
    if count <= _EXACT:
        return np.array(list(itertools.product((0.0, 1.0), repeat=count)))
    flips = (np.random.default_rng(0).choice((1.0, -1.0), size=(_DRAWS, count)) < 0.0).astype(np.float64)
    flips[0] = 0.0
    return flips
