"""What a study found, as a page and a picture: conditions, and how they differ within participants."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from swarm_pz.errors import require_extra
from swarm_pz.evaluation.survival import survival_curve
from swarm_pz.play.studies.analysis import (
    Comparison,
    ConditionRow,
    StudyGame,
    compare,
    compare_values,
    conditions,
)
from swarm_pz.play.studies.reading import StudyData
from swarm_pz.play.studies.tables import markdown

PICTURE = "comparison.png"
_FAULTS = ("server", "forfeit")
"""What ends games that are nobody's."""
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Okabe and Ito's, which most people tell apart."""
_MEASURES = {"win_rate": ("share won", 100.0, " %"), "restricted_mean_s": ("mean length", 1.0, " s")}


def counted_games(data: StudyData) -> list[StudyGame]:
    """Return the games that count, by the study's order of conditions: no practice, and none that a fault ended."""
    places = [condition.title for condition in data.study.conditions]
    games = [
        StudyGame(
            participant=game.participant,
            condition=game.condition,
            won=game.won,
            seconds=game.seconds,
            decided=game.decided,
        )
        for game in data.games
        if not game.practice and game.ended_by not in _FAULTS and game.outcome in ("win", "draw", "loss")
    ]
    return sorted(games, key=lambda game: places.index(game.condition))


@dataclass(frozen=True)
class ScoreRow:
    """A score of a form that was asked after blocks: its mean by condition, and these compared."""

    score: str
    means: dict[str, float]
    pairs: list[Comparison]


def compare_scores(data: StudyData) -> list[ScoreRow]:
    """Return all scores of forms that were asked after blocks."""
    values: dict[str, dict[str, dict[str, float]]] = {}
    for row in data.forms:
        if row.kind == "score" and row.condition and row.value is not None:
            values.setdefault(row.item, {}).setdefault(row.condition, {})[row.participant] = row.value
    found = []
    for score, by_condition in values.items():
        names = [one.title for one in data.study.conditions if one.title in by_condition]
        means = {name: math.fsum(by_condition[name].values()) / len(by_condition[name]) for name in names}
        pairs = [
            compare_values(score, (first, second), (by_condition[first], by_condition[second]))
            for first, second in itertools.combinations(names, 2)
        ]
        found.append(ScoreRow(score, means, [pair for pair in pairs if pair is not None]))
    return found


def write_report(data: StudyData, folder: Path, command: str = "") -> list[Comparison]:
    """Write `report.md` and its picture into a folder, and return what was compared.

    Raises
    ------
    MissingExtraError
        If matplotlib is not installed.
    """
    games = counted_games(data)
    comparisons = compare(games)
    scores = compare_scores(data)
    parts = [f"# {markdown(data.study.title)}\n", _summary(data, len(games)), "\n## Conditions\n"]
    parts += [_conditions(conditions(games)) if games else "No game that counts is over yet."]
    if games:
        parts.append(f"\n![shares won and lengths of games, by condition]({PICTURE})")
        _draw(games, folder / PICTURE)
    if comparisons:
        parts += ["\n## Compared within participants\n", _comparisons(comparisons)]
    if scores:
        parts += ["\n## Scores of forms\n", _scores(scores)]
        comparisons = comparisons + [pair for row in scores for pair in row.pairs]
    parts += ["\n## How\n", _METHODS.format(count=len(comparisons))]
    if data.faults:
        parts += ["\n## What could not be read\n", *(f"- {markdown(fault)}" for fault in data.faults)]
    if command:
        parts.append(f"\nWritten by `{command}`.")
    (folder / "report.md").write_text("\n".join(parts) + "\n", encoding="utf-8")
    return comparisons


_METHODS = """\
- Intervals are of 95 %. That of a share is Wilson's, of as many independent games as these are worth: games of one
  participant are alike (Korn and Graubard 1998).
- Lengths are Kaplan-Meier's (1958): a game that nobody won would have lasted longer. The mean is restricted to the
  longest game.
- Conditions are compared within participants: each participant's games under a condition are averaged, and a
  participant's means are subtracted. In the mean length a game that nobody won counts as the longest of all. p is the
  chance of a mean difference as large or larger if each had either sign by chance (Fisher 1935), from all signs up to
  14 participants and from 20,000 draws beyond; the interval holds all differences that this test does not refuse.
- {count} comparisons are made here, and none of their p is corrected for that.
- Practice counts nowhere; neither do games that a fault of the server or of a control system ended. Games that a
  participant left, or gave no command in, do count: a condition may be the reason. The column `left_out` of the games
  names them."""


def _summary(data: StudyData, counted: int) -> str:
    finished = sum(one.finished for one in data.remaining)
    practice = sum(game.practice for game in data.games)
    reasons = Counter(game.left_out for game in data.games if game.left_out and not game.practice)
    told = (
        f"{len(data.remaining)} of {data.study.participants} participants, of whom {finished} did all of it; "
        f"{counted} games count, and {practice} of practice do not."
    )
    gone = ", ".join(one.participant for one in data.participants if one.withdrawn)
    if gone:
        told += f" Withdrawn, and deleted: {gone}."
    if reasons:
        told += " Of all but practice: " + ", ".join(f"{count} {reason}" for reason, count in reasons.items()) + "."
    return told


def _conditions(rows: Sequence[ConditionRow]) -> str:
    lines = ["| condition | participants | games | won | 95 % interval | median length | mean length |"]
    lines.append("|---|---|---|---|---|---|---|")
    for row in rows:
        median = f"{row.median_s:.1f} s" if row.median_s is not None else "longer than all"
        lines.append(
            f"| {markdown(row.condition)} | {row.participants} | {row.games} | {100 * row.win_rate:.0f} % "
            f"| {100 * row.low:.0f} to {100 * row.high:.0f} % | {median} | {row.restricted_mean_s:.1f} s |"
        )
    return "\n".join(lines)


def _comparisons(rows: Sequence[Comparison]) -> str:
    lines = ["| measure | conditions | participants | difference | 95 % interval | p |", "|---|---|---|---|---|---|"]
    for row in rows:
        name, scale, unit = _MEASURES.get(row.measure, (f"`{row.measure}`", 1.0, ""))
        ends = [f"{scale * end:+.1f}" if math.isfinite(end) else "any" for end in (row.low, row.high)]
        within = f"{ends[0]} to {ends[1]}{unit}" if ends != ["any", "any"] else "any: too few participants"
        p = "< 0.001" if row.p < 0.001 else f"{row.p:.3f}"
        lines.append(
            f"| {name} | {markdown(row.first)} less {markdown(row.second)} | {row.participants} "
            f"| {scale * row.difference:+.1f}{unit} | {within} | {p} |"
        )
    return "\n".join(lines)


def _scores(rows: Sequence[ScoreRow]) -> str:
    lines = [
        f"- `{row.score}`: " + ", ".join(f"{markdown(name)} {mean:.1f}" for name, mean in row.means.items())
        for row in rows
    ]
    pairs = [pair for row in rows for pair in row.pairs]
    return "\n".join([*lines, "", _comparisons(pairs)] if pairs else lines)


def _draw(games: Sequence[StudyGame], path: Path) -> None:
    """Draw shares won, with their intervals and each participant's own, and how long games last."""
    figure = require_extra("matplotlib.figure", "cli").Figure(figsize=(9.0, 3.8), layout="constrained")
    wins, lengths = figure.subplots(1, 2, width_ratios=(1.0, 1.3))
    rows = conditions(games)
    _draw_wins(wins, games, rows)
    _draw_lengths(lengths, games, rows)
    figure.savefig(path, dpi=150, metadata={"Software": None})


def _draw_wins(axes: Any, games: Sequence[StudyGame], rows: Sequence[ConditionRow]) -> None:
    for person in dict.fromkeys(game.participant for game in games):
        own = [
            [game.won for game in games if (game.participant, game.condition) == (person, row.condition)]
            for row in rows
        ]
        met = [(place, 100.0 * sum(won) / len(won)) for place, won in enumerate(own) if won]
        axes.plot(*zip(*met, strict=True), color="#999999", marker=".", linewidth=0.8, alpha=0.6, zorder=1)
    for place, row in enumerate(rows):
        share = 100.0 * row.win_rate
        reach = [[share - 100.0 * row.low], [100.0 * row.high - share]]
        colour = _COLOURS[place % len(_COLOURS)]
        axes.errorbar(place, share, yerr=reach, color=colour, marker="o", markersize=8, capsize=5, linewidth=2.0)
    many = {"rotation": 20, "ha": "right", "rotation_mode": "anchor"} if len(rows) > 3 else {}
    axes.set_xticks(range(len(rows)), [_ticks(row.condition) for row in rows], **many)
    axes.set_xlim(-0.5, len(rows) - 0.5)
    axes.set_ylim(-4, 104)
    axes.set_ylabel("games won, %")
    axes.set_title("Wins: 95 % intervals; grey: participants", fontsize=10)


def _draw_lengths(axes: Any, games: Sequence[StudyGame], rows: Sequence[ConditionRow]) -> None:
    for place, row in enumerate(rows):
        own = [game for game in games if game.condition == row.condition]
        times, shares = survival_curve([game.seconds for game in own], [game.decided for game in own])
        percent, colour = [100.0 * share for share in shares], _COLOURS[place % len(_COLOURS)]
        style = ("-", "--", "-.", ":")[place % 4]
        axes.step(
            times, percent, where="post", color=colour, linestyle=style, linewidth=2.0, label=_ticks(row.condition)
        )
        open_at = [game.seconds for game in own if not game.decided]
        level = [percent[max(i for i, time in enumerate(times) if time <= end)] for end in open_at]
        axes.plot(open_at, level, color=colour, linestyle="", marker="|", markersize=9)
    axes.set_xlim(left=0.0)
    axes.set_ylim(-4, 104)
    axes.set_xlabel("s of game")
    axes.set_ylabel("games undecided, %")
    axes.set_title("Lengths (Kaplan-Meier); |: ended undecided", fontsize=10)
    axes.legend(frameon=False)


def _ticks(title: str) -> str:
    """Return a title as a picture shows it: short, and no formula."""
    short = title if len(title) <= 24 else title[:23] + "…"
    return short.replace("$", r"\$")
