"""What a figure is, under which rules it is made, what was found, and how its numbers are estimated."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from numpy.typing import ArrayLike

from swarm_pz.config import GameConfig
from swarm_pz.evaluation.intervals import bootstrap, wilson
from swarm_pz.evaluation.rollout import Game, game_number
from swarm_pz.play.strokes import Mapping, mapping_of

Interval = tuple[float, float]
Number = tuple[float, Interval]
"""A value, infinite for "never", and its 95 % interval."""


@dataclass(frozen=True)
class Setting:
    """The rules by which a figure is made, and how large.

    Attributes
    ----------
    preset : str
    seed : int
    size : float
        Share of the games that are played; below 1 it is a trial.
    """

    preset: str = "paper"
    seed: int = 0
    size: float = 1.0

    @property
    def config(self) -> GameConfig:
        """The rules."""
        return GameConfig.preset(self.preset)

    @property
    def mapping(self) -> Mapping:
        """How a drawing becomes a command."""
        return mapping_of(self.config)

    def many(self, count: int) -> int:
        """Return how many games are played in place of `count`."""
        return max(2, round(self.size * count))

    def seeds(self, count: int) -> list[int]:
        """Return seeds of flights without an opponent, as `game_seeds`."""
        return game_seeds(self.seed, self.many(count))

    def games(self, count: int) -> list[int]:
        """Return the numbers of a match's first games with the policy as red: every one starts as no other does."""
        return [game_number(pair) for pair in range(self.many(count))]


class Part(NamedTuple):
    """One thing that is asked, and what was found.

    Attributes
    ----------
    asked : str
        What is counted or measured, and when it holds.
    value : float
    interval : (float, float), optional
        At 95 %; None where nothing is random.
    holds : bool, optional
        None for a number that decides nothing.
    ours : bool
        Whether we ask it and the paper does not: it is no part of the verdict.
    """

    asked: str
    value: float
    interval: Interval | None
    holds: bool | None
    ours: bool = False


def asked(
    text: str, number: Number, holds: Callable[[float, float], bool] | None = None, *, ours: bool = False
) -> Part:
    """Make a part, which holds if a function of its interval's two ends says so."""
    value, ends = number
    return Part(text, value, ends, None if holds is None else bool(holds(*ends)), ours)


CONVERGED = 0.1
"""What the metric falls to, over its value after a second, where a team "converges". The paper has no number: this one
is ours, and was set when a first look at 1 had passed teams that hardly come closer."""


def below(bound: float) -> Callable[[float, float], bool]:
    """Return what holds where the whole interval is below a bound."""
    return lambda _, high: high < bound


def above(bound: float) -> Callable[[float, float], bool]:
    """Return what holds where the whole interval is above a bound; above 0 a share says that there is such a game."""
    return lambda low, _: low > bound


@dataclass(frozen=True, kw_only=True)
class Finding:
    """What the games of a figure say.

    Attributes
    ----------
    parts : list of Part
    method : str
        How the intervals were made.
    configs : dict of str to GameConfig
        The rules that were played, by a name for each.
    seeds : list of int
    series : dict
        What is drawn, as plain values.
    """

    parts: list[Part]
    method: str
    configs: dict[str, GameConfig]
    seeds: list[int]
    series: dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A claim of the paper, how it is measured, and how it is drawn.

    Attributes
    ----------
    name, claim : str
        Of the files and of the module; the sense of the paper's words.
    measure : callable
        From a `Setting` to a `Finding`, whose parts are the rule: fixed before the first look, or `revised` says why.
    draw : callable
        Draws `Finding.series` into an empty matplotlib figure, one or two columns wide.
    heights : (float, float)
        Of the picture at one and at two columns, in inches.
    seconds : float
        How long it takes for one preset, about: long ones begin first.
    section, quote : str
        Where the paper says it, as "IV-B", and its own words.
    note : str
        What else a reader must know.
    revised : str
        What was changed in the claim or its parts after the first look, and why.
    """

    name: str
    claim: str
    measure: Callable[[Setting], Finding]
    draw: Callable[[Any, dict[str, Any]], None]
    heights: tuple[float, float]
    seconds: float
    section: str
    quote: str
    note: str = ""
    revised: str = ""


def verdict(parts: Sequence[Part]) -> str:
    """Return in words how much of a claim holds, by the paper's parts alone."""
    judged = [part.holds for part in parts if not part.ours]
    return "reproduced" if all(judged) else "partly" if any(judged) else "not reproduced"


def estimate(values: ArrayLike, statistic: Callable[[Any], Any] | None = None) -> Number:
    """Return a statistic of samples, their mean if none is given, and its interval, as `bootstrap` has them."""
    value, low, high = map(float, bootstrap(values, statistic))
    return value, (low, high)


def estimates(names: Sequence[str], values: ArrayLike, statistic: Callable[[Any], Any]) -> dict[str, Number]:
    """Return the same of a statistic that is an array (len(names),), by name."""
    ends = zip(*(found.tolist() for found in bootstrap(values, statistic)), strict=True)
    return {name: (value, (low, high)) for name, (value, low, high) in zip(names, ends, strict=True)}


def share(which: ArrayLike) -> Number:
    """Return the share of games (n,) of which something is so, and Wilson's interval."""
    games = [bool(one) for one in which]  # type: ignore[union-attr]
    return sum(games) / len(games), wilson(sum(games), len(games))


def standing(name: str, games: list[Game]) -> dict[str, Any]:
    """Return a player's row of won, drawn and lost games, as `style.bars` takes it."""
    outcomes = [game.outcome for game in games]
    counts = {key: outcomes.count(key) for key in ("win", "draw", "loss")}
    return {"policy": name, "games": len(games), **counts, "win_ci95": wilson(counts["win"], len(games))}


def game_seeds(seed: int, count: int) -> list[int]:
    """Return seeds of flights without an opponent that no other figure's seed shares: 0, 1, 2, ... for seed 0."""
    return [1000 * seed + number for number in range(count)]
