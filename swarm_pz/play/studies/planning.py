"""Plan of a study, to be registered before it begins, and the power of its tests, by simulation."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from swarm_pz.errors import ConfigError
from swarm_pz.evaluation.intervals import LEVEL, wilson
from swarm_pz.play.studies.analysis import Values, compare_pairs, factor_effects
from swarm_pz.play.studies.design import Study


def plan_of(study: Study, file: Path) -> str:
    """Return the plan of a study as Markdown: hypotheses, factors, tests, exclusions, and when it stops."""
    plan, games = study.plan, f"{study.games} games a condition, {len(study.conditions)} conditions"
    lines = [f"# Plan: {study.title}", "", "## Hypotheses", "", *_listed(plan.hypotheses), "", "## Design", ""]
    lines += [f"- {study.participants} participants, {games}; order: {_order(study)}."]
    for name, of in study.factors.items():
        kind = "between" if name in study.between else "within"
        lines.append(f"- {name}, {kind} people: {', '.join(dict.fromkeys(of.values()))}.")
    for condition in study.conditions:
        lines.append(f"- Condition {condition.title!r}: {condition.system} against {condition.opponent}.")
    lines += ["", "## Tests", "", *_listed(plan.tests), ""]
    lines += ["Two-sided permutation tests at 5 %; pairs are corrected by Holm. All other tests are exploratory."]
    lines += ["", "## Exclusions", ""]
    for form in study.forms:
        if rights := [item.id for item in form.items if item.correct is not None]:
            tries = f"within {form.tries} tries" if form.tries > 1 else "at once"
            lines.append(f"- Participants who do not answer {', '.join(rights)} of {form.name} right {tries}.")
    lines += ["- Games of practice, and games that a fault of the server or of a control system ended.", ""]
    lines += ["## Stopping", "", plan.stopping or "None is planned.", ""]
    digest = hashlib.sha256(file.read_bytes()).hexdigest()
    return "\n".join([*lines, f"SHA-256 of the study's file: `{digest}`", ""])


def _listed(lines: tuple[str, ...]) -> list[str]:
    return [f"- {line}" for line in lines] or ["None is planned."]


def _order(study: Study) -> str:
    return study.order if isinstance(study.order, str) else "; ".join(" > ".join(row) for row in study.order)


@dataclass(frozen=True)
class PowerRow:
    """Shares of simulated studies that find an effect.

    `power` is the share if the effect exists, with its interval; `false_alarms` is the share if it does not. `pairs` is
    the share of studies with the effect in which any pair of conditions differs, after Holm's correction.
    """

    effect: str
    participants: int
    power: float
    low: float
    high: float
    pairs: float
    false_alarms: float


def power(
    study: Study,
    participants: int,
    *,
    difference: float,
    share: float,
    spread: float,
    runs: int,
    progress: Callable[[float, float], None] | None = None,
) -> list[PowerRow]:
    """Return the power of a factorial design's tests: a row for each effect, simulated without other effects.

    Participants win a `share` of games on average, with a standard deviation of `spread` among them. `difference` is
    the last level's share less the first level's; of an interaction, the difference of such differences. Raises
    ConfigError if the study has no factorial design.
    """
    if not study.crossed:
        raise ConfigError("the study has no factorial design: expected conditions that are all combinations of levels")
    chance = np.random.default_rng(0)
    rows: list[PowerRow] = []
    for effect in study.effects:
        counts = np.zeros(3, int)
        for run in range(runs):
            values = _simulated(study, participants, chance, share, spread, effect, difference)
            counts[0] += _finds(study, values, effect)
            counts[1] += any((one.p_holm or 0.0) <= 1.0 - LEVEL for one in compare_pairs("win_rate", values))
            counts[2] += _finds(study, _simulated(study, participants, chance, share, spread, effect, 0.0), effect)
            if progress is not None:
                progress(len(rows) * runs + run + 1, len(study.effects) * runs)
        low, high = wilson(int(counts[0]), runs)
        rows.append(PowerRow(effect, participants, counts[0] / runs, low, high, counts[1] / runs, counts[2] / runs))
    return rows


def _finds(study: Study, values: Values, effect: str) -> bool:
    effects = factor_effects("win_rate", values, study.crossed, study.between)
    return any(one.effect == effect and one.p <= 1.0 - LEVEL for one in effects)


def _simulated(
    study: Study, count: int, chance: np.random.Generator, share: float, spread: float, effect: str, difference: float
) -> dict[str, dict[str, float]]:
    """Return the share of games that each simulated participant wins, by condition."""
    gain = {condition.title: difference for condition in study.conditions}
    for name in effect.split(" x "):
        levels = list(dict.fromkeys(study.crossed[name].values()))
        for title, level in study.crossed[name].items():
            gain[title] *= levels.index(level) / (len(levels) - 1) - 0.5
    values: dict[str, dict[str, float]] = {condition.title: {} for condition in study.conditions}
    for number, skill in enumerate(chance.normal(share, spread, count)):
        for condition in study.order_of(number):
            won = chance.binomial(study.games, min(max(skill + gain[condition.title], 0.0), 1.0))
            values[condition.title][f"{number:05d}"] = won / study.games
    return values
