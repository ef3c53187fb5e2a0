"""What a figure is, what was found when it was made, and how its numbers are estimated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from swarm_pz.config import GameConfig
from swarm_pz.evaluation.intervals import bootstrap, wilson
from swarm_pz.evaluation.rollout import Game, game_number

Interval = tuple[float, float]
Number = tuple[float, Interval | None]
"""A value, infinite for "never", and its 95 % interval, if it has one."""


@dataclass(frozen=True, kw_only=True)
class Finding:
    """What the games of a figure say.

    Attributes
    ----------
    numbers : dict of str to Number
        What decides about the claim, by name.
    method : str
        How the intervals were made.
    holds : bool, or dict of str to bool
        Whether the claim holds, by the figure's rule; of several parts, in words, whether each does.
    seen : str
        What we see, in sentences.
    configs : dict of str to GameConfig
        The rules that were played, by a name for each.
    seeds : list of int
    series : dict
        What is drawn, as plain values.
    """

    numbers: dict[str, Number]
    method: str
    holds: bool | dict[str, bool]
    seen: str
    configs: dict[str, GameConfig]
    seeds: list[int]
    series: dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A claim of the paper or of ours, how it is measured, when it holds, and how it is drawn.

    Attributes
    ----------
    name, title : str
        Of the files and of the module; and what stands above the picture.
    claim, paper, rule : str
        The sense of the paper's words, or ours; what the paper shows; when the claim holds.
    measure : callable
        From a seed to a `Finding`.
    draw : callable
        Draws `Finding.series` into an empty matplotlib figure.
    size : (float, float)
        Of the picture, in inches.
    seconds : float
        How long it takes, about: long ones begin first.
    section, quote : str
        Where the paper says it, as "IV-B", and its own words; empty for what is ours.
    revised : str
        What was changed in the claim or the rule after the first look, and why.
    """

    name: str
    title: str
    claim: str
    paper: str
    rule: str
    measure: Callable[[int], Finding]
    draw: Callable[[Any, dict[str, Any]], None]
    size: tuple[float, float]
    seconds: float
    section: str = ""
    quote: str = ""
    revised: str = ""


def estimate(values: ArrayLike, statistic: Callable[[Any], Any] | None = None) -> tuple[float, Interval]:
    """Return a statistic of samples, their mean if none is given, and its interval, as `bootstrap` has them."""
    value, low, high = map(float, bootstrap(values, statistic))
    return value, (low, high)


def estimates(
    names: Sequence[str], values: ArrayLike, statistic: Callable[[Any], Any]
) -> dict[str, tuple[float, Interval]]:
    """Return the same of a statistic that is an array (len(names),), by name."""
    ends = zip(*(found.tolist() for found in bootstrap(values, statistic)), strict=True)
    return {name: (value, (low, high)) for name, (value, low, high) in zip(names, ends, strict=True)}


def standing(name: str, games: list[Game]) -> dict[str, Any]:
    """Return a player's row of won, drawn and lost games, as `style.bars` takes it."""
    outcomes = [game.outcome for game in games]
    counts = {key: outcomes.count(key) for key in ("win", "draw", "loss")}
    return {"policy": name, "games": len(games), **counts, "win_ci95": wilson(counts["win"], len(games))}


def games_as_red(count: int) -> list[int]:
    """Return the numbers of a match's first games with the policy as red: every one starts as no other does."""
    return [game_number(pair) for pair in range(count)]


def game_seeds(seed: int, count: int) -> list[int]:
    """Return seeds of flights without an opponent that no other figure's seed shares: 0, 1, 2, ... for seed 0."""
    return [1000 * seed + number for number in range(count)]
