"""Figures: settings, questions, results and estimates."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from swarm_pz.config import GameConfig
from swarm_pz.evaluation.intervals import bootstrap, wilson
from swarm_pz.evaluation.rollout import Game, game_number
from swarm_pz.play.strokes import Mapping, mapping_of

PRESETS = ("paper", "released")
"""The rules of the paper, and those of its authors' code."""
Interval = tuple[float, float]
Number = tuple[float, Interval]
"""A value, infinite for "never", and its 95 % interval."""


@dataclass(frozen=True)
class Setting:
    """Rules, seed and size of a figure; a size below 1 is the share of the games that a trial plays."""

    preset: str = "paper"
    seed: int = 0
    size: float = 1.0

    @property
    def config(self) -> GameConfig:
        """The rules."""
        return GameConfig.preset(self.preset)

    @property
    def mapping(self) -> Mapping:
        """The mapping from drawings to commands."""
        return mapping_of(self.config)

    def many(self, count: int) -> int:
        """Return the number of games played in place of `count`."""
        return max(2, round(self.size * count))

    def seeds(self, count: int) -> list[int]:
        """Return seeds of flights without an opponent, as `game_seeds`."""
        return game_seeds(self.seed, self.many(count))

    def games(self, count: int) -> list[int]:
        """Return the numbers of a match's first games with the policy as red, each with a different start."""
        return [game_number(pair) for pair in range(self.many(count))]


class Part(NamedTuple):
    """One question of a claim: its text, the value and its 95 % interval (None if exact), and the answer.

    `answer` is "yes", "no" or "undecided", and empty for a number that decides nothing. Parts that are `ours` are not
    in the paper and do not count. `seen` is k of n games, where the paper says only that something may happen.
    """

    asked: str
    value: float
    interval: Interval | None
    answer: str
    ours: bool = False
    seen: tuple[int, int] | None = None


Test = Callable[[float, float], str]
"""Maps the two ends of an interval to an answer."""


def asked(text: str, number: Number, test: Test | None = None, *, ours: bool = False) -> Part:
    """Return a part that is answered by the two ends of its interval."""
    value, ends = number
    return Part(text, value, ends, "" if test is None else test(*ends), ours)


def exactly(text: str, value: float, holds: object, *, ours: bool = False) -> Part:
    """Return a part whose value is exact."""
    return Part(text, value, None, "yes" if holds else "no", ours)


def seen(text: str, games: ArrayLike, *, ours: bool = False) -> Part:
    """Return a part about what may happen: it holds if it happens in at least one of the games (n,)."""
    value, ends = share(games)
    k, n = int(np.sum(games)), len(games)  # type: ignore[arg-type]
    return Part(text, value, ends, "yes" if k else "no", ours, (k, n))


CONVERGED = 0.1
"""A team "converges" if its metric falls below this part of its value after a second. The paper has no number. Our
first bound was 1, and teams met it that hardly came closer."""


def below(bound: float) -> Test:
    """Return the test that the whole interval is below a bound; "undecided" if the bound is in it."""
    return lambda low, high: "yes" if high < bound else "no" if low >= bound else "undecided"


def above(bound: float) -> Test:
    """Return the test that the whole interval is above a bound; "undecided" if the bound is in it."""
    return lambda low, high: "yes" if low > bound else "no" if high <= bound else "undecided"


def within(bound: float) -> Test:
    """Return the test that the whole interval is within a bound of 0; "undecided" if only a part of it is."""
    return lambda low, high: (
        "yes" if max(-low, high) <= bound else "no" if low > bound or high < -bound else "undecided"
    )


@dataclass(frozen=True, kw_only=True)
class Finding:
    """Results of a figure: its parts, the method of its intervals, rules by name, seeds, and plain values to draw."""

    parts: list[Part]
    method: str
    configs: dict[str, GameConfig]
    seeds: list[int]
    series: dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A claim of the paper, its measurement and its picture.

    `measure` returns the parts. `first` is the criterion first written, `first_held` its verdict, and `revised` the
    reason for its change. `draw` draws `Finding.series` into an empty matplotlib figure. `height` is in inches.
    `section` and `quote` are the paper's.
    """

    name: str
    claim: str
    measure: Callable[[Setting], Finding]
    draw: Callable[[Any, dict[str, Any]], None]
    height: float
    section: str
    quote: str
    first: str
    first_held: bool
    revised: str
    note: str = ""


def verdict(parts: Sequence[Part]) -> str:
    """Return the verdict on a claim, by the paper's parts alone.

    If all of these are about what may happen, it says how often the rarest was seen.
    """
    judged = [part for part in parts if not part.ours and part.answer]
    answers, counts = {part.answer for part in judged}, [part.seen for part in judged if part.seen]
    if "yes" in answers and len(answers) > 1:
        return "partly"
    if len(counts) == len(judged):
        k, n = min(counts, key=lambda count: count[0] / count[1])
        return f"seen at least once ({k} of {n})" if k else f"never seen (0 of {n})"
    return {"yes": "reproduced", "no": "not reproduced"}.get("".join(answers), "undecided")


def estimate(values: ArrayLike, statistic: Callable[[Any], Any] | None = None) -> Number:
    """Return a statistic of samples, by default the mean, and its bootstrap interval."""
    value, low, high = map(float, bootstrap(values, statistic))
    return value, (low, high)


def estimates(names: Sequence[str], values: ArrayLike, statistic: Callable[[Any], Any]) -> dict[str, Number]:
    """Return the values (len(names),) of a statistic by name, with their bootstrap intervals."""
    ends = zip(*(array.tolist() for array in bootstrap(values, statistic)), strict=True)
    return {name: (value, (low, high)) for name, (value, low, high) in zip(names, ends, strict=True)}


def share(which: ArrayLike) -> Number:
    """Return the share of true values (n,), and Wilson's interval."""
    games = [bool(one) for one in which]  # type: ignore[union-attr]
    return sum(games) / len(games), wilson(sum(games), len(games))


def standing(name: str, games: list[Game]) -> dict[str, Any]:
    """Return a player's row of won, drawn and lost games for `style.bars`."""
    outcomes = [game.outcome for game in games]
    counts = {key: outcomes.count(key) for key in ("win", "draw", "loss")}
    return {"policy": name, "games": len(games), **counts, "win_ci95": wilson(counts["win"], len(games))}


def game_seeds(seed: int, count: int) -> list[int]:
    """Return seeds of flights without an opponent: 0, 1, 2, ... for seed 0; other seeds share none of them."""
    return [1000 * seed + number for number in range(count)]
