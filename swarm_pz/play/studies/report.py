"""Report of a study: its plan, its conditions, and their differences."""

from __future__ import annotations

import functools
import math
import re
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

from swarm_pz.errors import require_extra
from swarm_pz.play.studies.analysis import Effect, compare_pairs, conditions, factor_effects, values_of
from swarm_pz.play.studies.reading import StudyData
from swarm_pz.play.studies.rows import GameRow

_FAULTS = ("server", "forfeit")
"""Values of `ended_by` that are no player's fault."""
_MEASURES = {"win_rate": ("share won", 100.0, " %"), "restricted_mean_s": ("mean length", 1.0, " s")}
"""Name, factor and unit of each measure."""


def markdown(text: str) -> str:
    """Return user text as one line of Markdown, escaped so that it makes no link, table cell or HTML."""
    return re.sub(r"([\\`*_{}\[\]<>#|!~&])", r"\\\1", " ".join(text.split()))


def signed(value: float | None, scale: float) -> str:
    """Return a difference, or an end of its interval, as the report shows it."""
    return "" if value is None else f"{scale * value:+.1f}" if math.isfinite(value) else "any"


def chance(p: float) -> str:
    """Return a p-value as the report shows it."""
    return "< 0.001" if p < 0.001 else f"{p:.3f}"


@functools.cache
def _template() -> Any:
    jinja2 = require_extra("jinja2", "lab")
    # Without autoescape: the template makes Markdown, and its filter `markdown` escapes user text.
    environment = jinja2.Environment(
        undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True
    )
    environment.filters |= {"markdown": markdown, "signed": signed, "chance": chance}
    return environment.from_string(Path(__file__).with_name("report.md.jinja").read_text())


def counted_games(data: StudyData) -> list[GameRow]:
    """Return the games that count, sorted by the study's order of conditions.

    Practice, games that a fault ended, and games of participants who failed a form do not count.
    """
    places, failed = [condition.title for condition in data.study.conditions], data.failed
    games = [
        game
        for game in data.games
        if not game.practice
        and game.ended_by not in _FAULTS
        and game.outcome in ("win", "draw", "loss")
        and game.participant not in failed
    ]
    return sorted(games, key=lambda game: places.index(game.condition))


def values_of_scores(data: StudyData) -> dict[str, dict[str, dict[str, float]]]:
    """Return the scores of forms that were asked after blocks, by score, condition and participant."""
    values: dict[str, dict[str, dict[str, float]]] = {}
    failed = data.failed
    for condition in data.study.conditions:
        for row in data.forms:
            is_own = (row.kind, row.condition) == ("score", condition.title) and row.participant not in failed
            if is_own and row.value is not None:
                values.setdefault(row.item, {}).setdefault(row.condition, {})[row.participant] = row.value
    return values


def write_report(data: StudyData, folder: Path, command: str = "") -> list[Effect]:
    """Write `report.md` into a folder, and return its effects and pairs of conditions."""
    games, scores = counted_games(data), values_of_scores(data)
    rows, measures = conditions(games), values_of(games) | scores
    of = measures if data.study.crossed else {}
    effects = [
        one for measure in of for one in factor_effects(measure, of[measure], data.study.crossed, data.study.between)
    ]
    pairs = [pair for measure, values in measures.items() for pair in compare_pairs(measure, values)]
    tests = [
        replace(one, planned=f"{one.measure}: {one.effect}" in data.study.plan.tests) for one in (*effects, *pairs)
    ]
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
