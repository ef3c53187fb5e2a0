"""Comparison of a study's conditions: main effects, interactions and pairs.

Games of one person are not independent, so a person's games are averaged first. Within people, the test flips the sign
of each person's contrast, since both signs are equally likely if conditions do not differ (Fisher, The Design of
Experiments, 1935). Between people, it permutes people among groups. The test is exact for few participants. Its
interval has all differences that the test does not reject.
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from swarm_pz.errors import require_extra
from swarm_pz.evaluation.intervals import LEVEL
from swarm_pz.evaluation.survival import kaplan_meier
from swarm_pz.play.recordings.seats import column
from swarm_pz.play.studies.rows import GameRow

Array = NDArray[np.float64]
Values = Mapping[str, Mapping[str, float]]
"""A measure's values, by condition and participant."""
_EXACT_FLIPS, _EXACT_ORDERS = 14, 8
"""Most participants for which all signs, or all permutations, are tried; else `_DRAWS` random ones are."""
_DRAWS = 20_000


@dataclass(frozen=True, kw_only=True)
class ConditionRow:
    """A condition's games: their number, the share won with its interval, and their length (Kaplan-Meier)."""

    condition: str
    participants: int
    games: int
    win_rate: float
    low: float
    high: float
    median_s: float | None
    restricted_mean_s: float


@dataclass(frozen=True, kw_only=True)
class Effect:
    """A main effect, an interaction, or the difference of a pair of conditions.

    The ends of the 95 % interval are infinite where there are too few participants to exclude anything.
    """

    measure: str = column(
        '"win_rate" (share of games won, 0 to 1), "restricted_mean_s" (mean length in s of game; one that nobody won '
        "counts as the longest of all), or a form's score"
    )
    effect: str = column(
        'a factor, factors with " x " between them, or a pair of conditions with " less " between them'
    )
    kind: str = column("effect or pair")
    participants: int = column("participants with all values that it needs", "count")
    degrees: int = column("degrees of freedom", "count")
    difference: float | None = column(
        "of a pair the first minus the second; of a factor its second level minus its first, in the report's order; of "
        "an interaction the difference of these differences; empty if a factor has more than two levels"
    )
    low: float | None = column("lower end of its 95 % interval")
    high: float | None = column("upper end of its 95 % interval")
    p: float = column("chance of an effect as large or larger if there is none, by permutation")
    planned: bool = column("whether the study's plan names the test; else it is exploratory", default=False)
    p_holm: float | None = column("p of a pair after Holm's correction for all pairs of the measure", default=None)


def conditions(games: Sequence[GameRow]) -> list[ConditionRow]:
    """Return a row for each condition, in the order of their first games."""
    rows = []
    for condition, people in _played(games).items():
        own = [game for of in people.values() for game in of]
        median, mean = kaplan_meier([game.seconds for game in own], [game.decided for game in own])
        low, high = win_interval([[game.won for game in of] for of in people.values()])
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


def _played(games: Sequence[GameRow]) -> dict[str, dict[str, list[GameRow]]]:
    """Return the games of each condition and participant."""
    played: dict[str, dict[str, list[GameRow]]] = {}
    for game in games:
        played.setdefault(game.condition, {}).setdefault(game.participant, []).append(game)
    return played


def win_interval(people: Sequence[Sequence[bool]]) -> tuple[float, float]:
    """Return the 95 % interval of the share of games won; `people` are the wins and losses of each participant.

    It is Wilson's interval for an effective number of games: their number over the factor by which the variance among
    participants exceeds chance, if it does (Korn and Graubard, Survey Methodology 24, 1998). With one participant, or
    if all games were won or all lost, this factor is unknown: then each participant counts as one game.
    """
    wins, games = np.array([sum(own) for own in people], np.float64), np.array([len(own) for own in people], np.float64)
    share, total, count = wins.sum() / games.sum(), games.sum(), len(people)
    binomial = share * (1.0 - share) / total
    if count > 1 and binomial > 0.0:
        between = count / (count - 1) * ((wins - share * games) ** 2).sum() / total**2
        total /= max(between / binomial, 1.0)
    else:
        total = float(count)
    z = NormalDist().inv_cdf((1.0 + LEVEL) / 2.0)
    middle = (share + z**2 / (2.0 * total)) / (1.0 + z**2 / total)
    half = z / (1.0 + z**2 / total) * np.sqrt(share * (1.0 - share) / total + z**2 / (4.0 * total**2))
    return float(max(middle - half, 0.0)), float(min(middle + half, 1.0))


def values_of(games: Sequence[GameRow]) -> dict[str, dict[str, dict[str, float]]]:
    """Return participants' means (share won, length of games) by measure, condition and participant."""
    longest = max((game.seconds for game in games), default=0.0)
    means: dict[str, dict[str, dict[str, float]]] = {"win_rate": {}, "restricted_mean_s": {}}
    for title, people in _played(games).items():
        for person, own in people.items():
            lasted = [game.seconds if game.decided else longest for game in own]  # without a winner it would go on
            for measure, values in zip(means.values(), ([float(game.won) for game in own], lasted), strict=True):
                measure.setdefault(title, {})[person] = float(np.mean(values))
    return means


def compare_pairs(measure: str, values: Values) -> list[Effect]:
    """Return a comparison of each pair of conditions, with Holm's correction (Scand. J. Statist. 6, 1979).

    A pair is compared within participants who met both, or between participants if nobody did.
    """
    effects = []
    for first, second in itertools.combinations(values, 2):
        of = {"pair": {second: "second", first: "first"}}
        pair = {title: values[title] for title in (first, second)}
        between = () if pair[first].keys() & pair[second].keys() else ("pair",)
        effects += [
            replace(one, kind="pair", effect=f"{first} less {second}")
            for one in factor_effects(measure, pair, of, between)
        ]
    ranked = sorted(range(len(effects)), key=lambda which: effects[which].p)
    corrected = itertools.accumulate(
        (min((len(effects) - rank) * effects[which].p, 1.0) for rank, which in enumerate(ranked)), max
    )
    of_pair = dict(zip(ranked, corrected, strict=True))
    return [replace(one, p_holm=of_pair[which]) for which, one in enumerate(effects)]


def factor_effects(
    measure: str, values: Values, factors: Mapping[str, Mapping[str, str]], between: Collection[str] = ()
) -> list[Effect]:
    """Return the main effects and interactions of crossed factors, each of which has a level for every condition.

    Each participant meets all levels of a factor, or only one if it is `between` people. Participants without a value
    for one of their conditions are left out; the list is empty if nobody is left in a group.
    """
    levels = {name: list(dict.fromkeys(of.values())) for name, of in factors.items()}
    apart, within = ([name for name in factors if (name in between) is wanted] for wanted in (True, False))
    title_of = {
        tuple(factors[name][title] for name in (*apart, *within)): title for title in next(iter(factors.values()))
    }
    groups, cells = (list(itertools.product(*(levels[name] for name in names))) for names in (apart, within))
    rows, members = [], []
    for person in sorted({person for of in values.values() for person in of}):
        for place, group in enumerate(groups):
            own = [values.get(title_of[group + cell], {}).get(person) for cell in cells]
            if None not in own:
                rows.append(own)
                members.append(place)
    if set(members) != set(range(len(groups))):
        return []
    table, member = np.array(rows, np.float64), np.eye(len(groups))[members]
    effects = []
    for size in range(1, len(factors) + 1):
        for chosen in itertools.combinations(factors, size):
            inner, outer = (
                _contrasts([(len(levels[name]), name in chosen) for name in names]) for names in (within, apart)
            )
            weights, shift = outer.T @ (member / member.sum(axis=0)).T, (member @ outer / (outer**2).sum())[:, 0]
            contrasts, is_between = table @ inner, not set(apart).isdisjoint(chosen)
            moved = (
                weights[:, _orders(len(rows))].swapaxes(0, 1) if is_between else weights * _signs(len(rows))[:, None]
            )
            difference, low, high, p = _test(moved @ contrasts, moved @ shift)
            effects.append(
                Effect(
                    measure=measure,
                    effect=" x ".join(chosen),
                    kind="effect",
                    participants=len(rows),
                    degrees=inner.shape[1] * outer.shape[1],
                    difference=difference,
                    low=low,
                    high=high,
                    p=p,
                )
            )
    return effects


def _contrasts(factors: Sequence[tuple[int, bool]]) -> Array:
    """Return an effect's contrasts (cells, degrees); each factor is a number of levels, and True if it is part of it.

    Levels of other factors are averaged. Two levels are subtracted; more have orthonormal contrasts (Helmert).
    """
    helmert = require_extra("scipy.linalg", "cli").helmert
    contrasts = np.ones((1, 1))
    for count, is_meant in factors:
        own = np.array([[-1.0], [1.0]]) if count == 2 else helmert(count).T
        contrasts = np.kron(contrasts, own if is_meant else np.full((count, 1), 1.0 / count))
    return contrasts


def _test(effects: Array, shifted: Array) -> tuple[float | None, float | None, float | None, float]:
    """Return difference, interval and p of an effect.

    `effects` (K, r, m) are its values in K permutations, the first being the measured one; `shifted` (K, r) are those
    of an effect of 1. p is the share of sums of squares that are as large. The interval leaves out a shift d if at most
    5 % of `effects - d * shifted` are as far from 0 as the first (Hartigan, J. Am. Stat. Assoc. 64, 1969).
    """
    size = (effects**2).sum(axis=(1, 2))
    p = float((size >= size[0] * (1.0 - 2e-9)).mean())
    if effects[0].size > 1:
        return None, None, None, p
    own, one = effects[:, 0, 0], shifted[:, 0]
    is_open = np.abs(one) > 1.0 - 1e-9
    one = np.where(is_open, 0.0, one)
    ends = np.array([(own[0] - own) / (1.0 - one), (own[0] + own) / (1.0 + one)])
    low, high = np.where(is_open, -np.inf, ends.min(axis=0)), np.where(is_open, np.inf, ends.max(axis=0))
    refused = int((1.0 - LEVEL) * len(own))
    return float(own[0]), float(np.sort(low)[refused]), float(np.sort(high)[-1 - refused]), p


@functools.lru_cache(maxsize=4)
def _signs(count: int) -> Array:
    """Return signs (K, count) of people's contrasts: all combinations, or random ones; the first flips none."""
    if count <= _EXACT_FLIPS:
        return np.array(list(itertools.product((1.0, -1.0), repeat=count)))
    signs = np.random.default_rng(0).choice((1.0, -1.0), size=(_DRAWS, count))
    signs[0] = 1.0
    return signs


@functools.lru_cache(maxsize=4)
def _orders(count: int) -> NDArray[np.int64]:
    """Return orders (K, count) of people: all permutations, or random ones; the first moves nobody."""
    if count <= _EXACT_ORDERS:
        return np.array(list(itertools.permutations(range(count))))
    orders = np.random.default_rng(0).permuted(np.tile(np.arange(count), (_DRAWS, 1)), axis=1)
    orders[0] = np.arange(count)
    return orders
