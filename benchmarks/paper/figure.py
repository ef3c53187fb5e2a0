"""What a figure is, and what was found when it was made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from swarm_pz.config import GameConfig
from swarm_pz.evaluation.rollout import game_number

Interval = tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Finding:
    """What the games of a figure say.

    Attributes
    ----------
    statistic : dict of str to float
        Numbers that decide about the claim, by name; infinite ones stand for "never".
    interval : dict of str to (float, float)
        95 % intervals of statistics, by the same names.
    method : str
        How the intervals were made.
    supported : bool
        Whether the claim holds, by the figure's rule.
    parts : dict of str to bool
        Of a claim that has several parts, whether each holds, by what it is in words: the claim holds if all do.
    seen : str
        What we see, in sentences.
    configs : dict of str to GameConfig
        The rules that were played, by a name for each.
    seeds : list of int
    series : dict
        What is drawn, as plain values.
    """

    statistic: dict[str, float]
    interval: dict[str, Interval]
    method: str
    supported: bool
    seen: str
    configs: dict[str, GameConfig]
    seeds: list[int]
    series: dict[str, Any]
    parts: dict[str, bool] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Figure:
    """A claim of the paper or of ours, how it is measured, when it holds, and how it is drawn.

    Attributes
    ----------
    name : str
        Of the files, and of the module that makes it.
    title : str
        Stands above the picture.
    claim : str
        The sense of the paper's words, or what we say.
    paper : str
        What the paper shows.
    section : str
        The paper's section that the claim stands in, as "IV-B"; empty for what is ours.
    quote : str
        The paper's own words, few of them; empty for what is ours.
    rule : str
        When the claim counts as supported, in words.
    revised : str
        What was changed in the claim or the rule after the first look, and why; empty if nothing was.
    measure : callable
        From a seed to a `Finding`.
    draw : callable
        Draws `Finding.series` into an empty matplotlib figure.
    size : (float, float)
        Of the picture, in inches.
    seconds : float
        How long it takes, about: long ones begin first.
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


def games_as_red(count: int) -> list[int]:
    """Return the numbers of a match's first games with the policy as red: every one starts as no other does."""
    return [game_number(pair) for pair in range(count)]


def game_seeds(seed: int, count: int) -> list[int]:
    """Return seeds of flights without an opponent that no other figure's seed shares: 0, 1, 2, ... for seed 0."""
    return [1000 * seed + number for number in range(count)]
