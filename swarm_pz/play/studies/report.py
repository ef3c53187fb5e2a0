"""Report of a study: a page and a picture of the conditions and their differences within participants."""

from __future__ import annotations

import functools
import math
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from swarm_pz.errors import require_extra
from swarm_pz.evaluation.survival import survival_curve
from swarm_pz.play.studies.analysis import ConditionRow, Effect, compare_pairs, conditions, factor_effects, values_of
from swarm_pz.play.studies.reading import StudyData
from swarm_pz.play.studies.rows import GameRow

PICTURE = "comparison.png"
_FAULTS = ("server", "forfeit")
"""Causes of an end that are no player's."""
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000")
"""Okabe and Ito's, which most people tell apart."""
_MEASURES = {"win_rate": ("share won", 100.0, " %"), "restricted_mean_s": ("mean length", 1.0, " s")}
"""Name, factor and unit of each measure."""


def markdown(text: str) -> str:
    """Return a line of somebody's text as Markdown shows it: no sign of it makes a link, a table's edge or HTML."""
    return re.sub(r"([\\`*_{}\[\]<>#|!~&])", r"\\\1", " ".join(text.split()))


def signed(value: float | None, scale: float) -> str:
    """Return a difference, or an end of its interval, as the report shows it."""
    return "" if value is None else f"{scale * value:+.1f}" if math.isfinite(value) else "any"


def chance(p: float) -> str:
    """Return a p as the report shows it."""
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


@functools.cache
def _template() -> Any:
    jinja2 = require_extra("jinja2", "lab")
    # Of Markdown: not HTML, but the filter `markdown` escapes what somebody wrote.
    found = jinja2.Environment(
        loader=jinja2.FileSystemLoader(Path(__file__).parent),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    found.filters |= {"markdown": markdown, "signed": signed, "chance": chance}
    return found.get_template("report.md.jinja")


def counted_games(data: StudyData) -> list[GameRow]:
    """Return the games that count, by the study's order of conditions.

    No practice, none that a fault ended, and none of who failed a form.
    """
    places = [condition.title for condition in data.study.conditions]
    games = [
        game
        for game in data.games
        if not game.practice
        and game.ended_by not in _FAULTS
        and game.outcome in ("win", "draw", "loss")
        and game.participant not in data.failed
    ]
    return sorted(games, key=lambda game: places.index(game.condition))


def values_of_scores(data: StudyData) -> dict[str, dict[str, dict[str, float]]]:
    """Return each participant's scores under each condition, by score: those of forms that were asked after blocks."""
    found: dict[str, dict[str, dict[str, float]]] = {}
    for condition in data.study.conditions:
        for row in data.forms:
            is_own = (row.kind, row.condition) == ("score", condition.title) and row.participant not in data.failed
            if is_own and row.value is not None:
                found.setdefault(row.item, {}).setdefault(row.condition, {})[row.participant] = row.value
    return found


def write_report(data: StudyData, folder: Path, command: str = "") -> list[Effect]:
    """Write `report.md` and its picture into a folder, and return all that was compared."""
    games, scores = counted_games(data), values_of_scores(data)
    rows, measures = conditions(games), values_of(games) | scores
    effects: list[Effect] = []
    if len(data.study.conditions) > 2 and data.study.crossed:
        for measure, values in measures.items():
            effects += factor_effects(measure, values, data.study.crossed, data.study.between)
    pairs = [pair for measure, values in measures.items() for pair in compare_pairs(measure, values)]
    tests = [
        replace(one, planned=f"{one.measure}: {one.effect}" in data.study.plan.tests) for one in (*effects, *pairs)
    ]
    if games:
        _draw(games, rows, folder / PICTURE)
    reasons = Counter(game.left_out for game in data.games if game.left_out and not game.practice)
    text = _template().render(
        data=data,
        command=command,
        games=games,
        finished=sum(one.finished for one in data.remaining),
        practice=sum(game.practice for game in data.games),
        gone=[one.participant for one in data.participants if one.withdrawn],
        stopped=[one.participant for one in data.participants if one.stopped],
        failed=[f"{one.participant} ({one.failed})" for one in data.participants if one.failed],
        left_out=[f"{count} {reason}" for reason, count in reasons.items()],
        conditions=rows,
        picture=PICTURE,
        measures=_MEASURES,
        planned=[one for one in tests if one.planned],
        effects=effects,
        pairs=pairs,
        means={
            score: {name: math.fsum(of.values()) / len(of) for name, of in values.items()}
            for score, values in scores.items()
        },
    )
    (folder / "report.md").write_text(text, encoding="utf-8")
    return tests


def _draw(games: Sequence[GameRow], rows: Sequence[ConditionRow], path: Path) -> None:
    """Draw shares won, with their intervals and each participant's own, and how long games last."""
    figure = require_extra("matplotlib.figure", "cli").Figure(figsize=(9.0, 3.8), layout="constrained")
    wins, lengths = figure.subplots(1, 2, width_ratios=(1.0, 1.3))
    _draw_wins(wins, games, rows)
    _draw_lengths(lengths, games, rows)
    figure.savefig(path, dpi=150, metadata={"Software": None})


def _draw_wins(axes: Any, games: Sequence[GameRow], rows: Sequence[ConditionRow]) -> None:
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
    axes.set_xticks(range(len(rows)), [_label(row.condition) for row in rows], **many)
    axes.set_xlim(-0.5, len(rows) - 0.5)
    axes.set_ylim(-4, 104)
    axes.set_ylabel("games won, %")
    axes.set_title("Wins: 95 % intervals; grey: participants", fontsize=10)


def _draw_lengths(axes: Any, games: Sequence[GameRow], rows: Sequence[ConditionRow]) -> None:
    for place, row in enumerate(rows):
        own = [game for game in games if game.condition == row.condition]
        times, shares = survival_curve([game.seconds for game in own], [game.decided for game in own])
        percent, colour = [100.0 * share for share in shares], _COLOURS[place % len(_COLOURS)]
        style = {"color": colour, "linestyle": ("-", "--", "-.", ":")[place % 4], "linewidth": 2.0}
        axes.step(times, percent, where="post", label=_label(row.condition), **style)
        open_at = [game.seconds for game in own if not game.decided]
        level = [percent[max(i for i, time in enumerate(times) if time <= end)] for end in open_at]
        axes.plot(open_at, level, color=colour, linestyle="", marker="|", markersize=9)
    axes.set_xlim(left=0.0)
    axes.set_ylim(-4, 104)
    axes.set_xlabel("s of game")
    axes.set_ylabel("games undecided, %")
    axes.set_title("Lengths (Kaplan-Meier); |: ended undecided", fontsize=10)
    axes.legend(frameon=False)


def _label(title: str) -> str:
    """Return a title as a picture shows it: short, and no formula."""
    short = title if len(title) <= 24 else title[:23] + "…"
    return short.replace("$", r"\$")
