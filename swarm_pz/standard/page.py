"""The report as one HTML page, from the template beside this module; it loads no other file and fits a phone."""

from __future__ import annotations

import functools
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from swarm_pz.errors import require_extra
from swarm_pz.policies import open_loop
from swarm_pz.standard.figures import forfeits_of
from swarm_pz.standard.report import is_try

Point = tuple[float, float]


def render(report: dict[str, Any], head: str = "") -> str:
    """Return the page of a report; `head` is HTML for its head element."""
    figures, cost = report["figures"], report["cost"]
    uniform = figures["uniform"]
    longest = 1.0 if uniform is None else max(uniform["curve"]["seconds"][-1], 1.0)
    page: str = _template().render(
        report=report,
        head=head,
        notes=_notes(report),
        tracks=[
            (
                name,
                _number(track["score"]),
                _ends(track["score_ci95"]),
                f"{_number(track['worst']['score'])} ({track['worst']['opponent']})",
                "" if track["late"] is None else _number(track["late"]),
            )
            for name, track in figures["tracks"].items()
        ],
        longest=longest,
        not_won=[] if uniform is None else _steps(uniform["curve"], longest),
        attacks=[
            (policy["name"], *_opponent(one["worst"]), *_opponent(one["itself"] | {"opponent": ""})[-1:])
            for policy, one in zip(report["policies"], figures["attacks"], strict=True)
        ],
        open_loop=[
            (name, *(_open_loop(scores[kind]) for kind in open_loop.KINDS), f"{scores['gain']:+.3f}")
            for name, track in figures["tracks"].items()
            if (scores := track["open_loop"])
        ],
        kinds=kinds_of(report),
        field_seed=None if is_try(report) else report["seeds"].get("field"),
        opponents={name: list(map(_opponent, track["opponents"])) for name, track in figures["tracks"].items()},
        costs=[
            (policy["name"], *(_cost(one, name) for name in ("commands", "seconds", "processor", "parameters")))
            for policy, one in zip(report["policies"], cost["policies"], strict=True)
        ],
        origin=_origin(report),
    )
    return page


KINDS = {"learned": "learned", "scripted": "scripted", "planned": "planned (sees the simulator)", "program": "program"}


def kinds_of(report: dict[str, Any]) -> str:
    """Return the kinds of a report's policies, in words."""
    return ", ".join(sorted({KINDS[policy["kind"]] for policy in report["policies"]}))


@functools.cache
def _template() -> Any:
    jinja = require_extra("jinja2", "train")
    environment = jinja.Environment(autoescape=True, undefined=jinja.StrictUndefined, keep_trailing_newline=True)
    environment.filters |= {"number": _number, "ends": _ends, "places": _places}
    return environment.from_string(Path(__file__).with_name("report.html.jinja").read_text())


def _number(value: float, digits: int = 3) -> str:
    return f"{float(value):.{digits}f}"


def _ends(values: Sequence[float], digits: int = 3) -> str:
    return f"{_number(values[0], digits)} to {_number(values[1], digits)}"


def _places(points: Iterable[Point]) -> str:
    """Return points of the unit square as coordinates of the plot's SVG."""
    return " ".join(f"{42 + 300 * x:.1f},{10 + 170 * (1 - y):.1f}" for x, y in points)


def _open_loop(one: dict[str, Any]) -> str:
    return f"{_number(one['score'])} ({_ends(one['score_ci95'])})"


def _cost(costs: dict[str, Any], name: str) -> str:
    value = costs[name]
    if not isinstance(value, (int, float)):
        return "not said" if value is None else str(value)
    return f"{'at least ' if name in costs['at_least'] else ''}{value:,}"


def _notes(report: dict[str, Any]) -> list[str]:
    notes = []
    if is_try(report):
        notes.append("A try with few and short games: it says nothing about the entry, and cannot be sent in.")
    forfeited, games, reason = forfeits_of(report["figures"])
    if forfeited:
        notes.append(f"{forfeited} of {games} games are forfeits, the first since {reason}")
    return notes


def _opponent(one: dict[str, Any]) -> tuple[str, ...]:
    counts = (str(one[name]) for name in ("wins", "draws", "losses"))
    scores = one.get("scores", [one["score"]])
    return one["opponent"], *counts, ", ".join("" if score is None else _number(score, 2) for score in scores)


def _steps(curve: dict[str, list[float]], longest: float) -> list[Point]:
    """Return the corners of the step curve, which falls where games are won."""
    shares = curve["not_won"]
    steps = [(curve["seconds"][0] / longest, shares[0])]
    for seconds, share in zip(curve["seconds"][1:], shares[1:], strict=True):
        steps += [(seconds / longest, steps[-1][1]), (seconds / longest, share)]
    return steps


def _origin(report: dict[str, Any]) -> dict[str, str]:
    return {
        "protocol": f"{report['protocol']['version']}, {report['protocol']['digest']}",
        "policies": ", ".join(f"{policy['name']} ({policy['digest']})" for policy in report["policies"]),
        "rules": report["rules_hash"],
        "configuration": report["config_hash"],
        "seeds": ", ".join(f"{name} {seed}" for name, seed in report["seeds"].items()),
        "versions": ", ".join(f"{name} {version}" for name, version in report["versions"].items()),
        "games": f"{report['games']:,}",
        "made by": report["cost"]["command"],
    }
