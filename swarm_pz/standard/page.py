"""The report as one HTML page that fetches nothing, and can be read on a phone."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import Any

from swarm_pz.standard.figures import forfeits_of
from swarm_pz.standard.report import is_try

_STYLE = """
:root { color-scheme: light; }
body { font: 1rem/1.5 system-ui, sans-serif; color: #1b1b1b; background: #fff; margin: 0 auto; max-width: 46rem;
  padding: 0 1rem 3rem; overflow-wrap: anywhere; }
h1 { font-size: 1.5rem; line-height: 1.25; } h2 { font-size: 1.15rem; margin-top: 2rem; }
.score { font-size: 2.2rem; font-weight: 700; margin: 0; }
.try { background: #fff1c2; padding: .5rem .75rem; font-weight: 600; }
table { border-collapse: collapse; width: 100%; font-size: .9rem; }
th, td { text-align: right; padding: .25rem .4rem; border-bottom: 1px solid #d4d4d4;
  font-variant-numeric: tabular-nums; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; } caption { text-align: left; padding: 1rem 0 .25rem; }
.wide { overflow-x: auto; }
svg { width: 100%; max-width: 34rem; height: auto; display: block; } svg text { font-size: 12px; fill: #1b1b1b; }
dt { font-weight: 600; } dd { margin: 0 0 .5rem; }
"""
_LEFT, _TOP, _WIDTH, _HEIGHT = 42, 10, 300, 170


def render(report: dict[str, Any], head: str = "") -> str:
    """Return the page of a report: the same for the same report; `head` is HTML that is put into its head."""
    said = report["figures"]
    name = escape(str(report["name"]))
    version = escape(str(report["protocol"]["version"]))
    parts = [
        f"<h1>{name}: swarm-pz benchmark, protocol {version}</h1>",
        _note(report),
        f'<p class="score">{_number(said["score"])}</p>',
        f"<p>Mean of the tracks' scores, 95 % interval {_ends(said['score_ci95'])}, over "
        f"{escape(said['interval_over'])}. 1 is every game won, a draw counts half.</p>",
        _tracks(said["tracks"]),
        _soon(said["uniform"]),
        _profile(said["profile"]),
        _improvement(said.get("improvement")),
        "<h2>Every opponent</h2>",
        *(_opponents(track, figures["opponents"]) for track, figures in said["tracks"].items()),
        _cost(report["policies"], report["cost"]),
        _origin(report),
    ]
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n{head}'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{name}: swarm-pz benchmark</title>\n<style>{_STYLE}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(part for part in parts if part)
        + "\n</main>\n</body>\n</html>\n"
    )


def _number(value: Any, digits: int = 3) -> str:
    return "never" if value is None else f"{float(value):.{digits}f}"


def _ends(values: Sequence[float]) -> str:
    return f"{_number(values[0])} to {_number(values[1])}"


def _note(report: dict[str, Any]) -> str:
    notes = []
    if is_try(report):
        notes.append("A try with few and short games: it says nothing about the entry, and cannot be sent in.")
    if any(policy.get("privileged") for policy in report["policies"]):
        notes.append("The entry sees the simulator itself, which no side may.")
    forfeited, games, reason = forfeits_of(report["figures"])
    if forfeited:
        notes.append(f"{forfeited} of {games} games are forfeits, the first since {escape(reason)}")
    return "".join(f'<p class="try">{note}</p>' for note in notes)


def _table(caption: str, headings: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head = "".join(f'<th scope="col">{heading}</th>' for heading in headings)
    body = "".join(
        "<tr>" + f'<th scope="row">{row[0]}</th>' + "".join(f"<td>{cell}</td>" for cell in row[1:]) + "</tr>\n"
        for row in rows
    )
    return (
        f'<div class="wide" tabindex="0" role="region" aria-label="{caption}"><table><caption>{caption}</caption>'
        f"<thead><tr>{head}</tr></thead>\n<tbody>{body}</tbody></table></div>"
    )


def _tracks(tracks: dict[str, Any]) -> str:
    about = {"robust": "worse of two attacks"}
    rows = [
        (
            escape(name),
            _number(track["score"]),
            _ends(track["score_ci95"]),
            about.get(name, "interquartile mean"),
        )
        for name, track in tracks.items()
    ]
    return "<h2>Tracks</h2>" + _table("Score of each track", ("track", "score", "95 %", "made as"), rows)


def _opponents(track: str, opponents: Sequence[dict[str, Any]]) -> str:
    rows = [
        (
            escape(one["opponent"]),
            *(str(one[name]) for name in ("wins", "draws", "losses")),
            ", ".join(_number(points, 2) for points in one["points"]),
            _number(one["mean_share"], 2),
        )
        for one in opponents
    ]
    headings = ("opponent", "won", "drawn", "lost", "points", "drones")
    return _table(f"Track {escape(track)}: games, shares of the points and of the drones", headings, rows)


def _soon(uniform: dict[str, Any]) -> str:
    curve = uniform["curve"]
    longest = max(curve["seconds"][-1], 1.0)
    steps = [(curve["seconds"][0], curve["not_won"][0])]
    for seconds, share in zip(curve["seconds"][1:], curve["not_won"][1:], strict=True):
        steps += [(seconds, steps[-1][1]), (seconds, share)]
    points = [(seconds / longest, share) for seconds, share in steps]
    low, high = uniform["restricted_mean_seconds_ci95"]
    median = "never" if uniform["median_seconds"] is None else f"after {_number(uniform['median_seconds'], 0)} s"
    return (
        "<h2>Against uniform coverage</h2>"
        f"<p>Won {uniform['won']} of {uniform['games']} games ({_ends(uniform['won_share_ci95'])}), the median "
        f"{median} (Kaplan-Meier). "
        f"Games that are not won count {_number(longest, 0)} s at most in the mean, "
        f"{_number(uniform['restricted_mean_seconds'], 0)} s ({_number(low, 0)} to {_number(high, 0)}).</p>"
        + _plot("Share of games not won yet, over the time", (f"{longest / 2:.0f} s", f"{longest:.0f} s"), points)
    )


def _profile(profile: dict[str, Any]) -> str:
    def curve(name: str) -> list[tuple[float, float]]:
        return list(zip(profile["score_above"], profile[name], strict=True))

    band = [*curve("low"), *reversed(curve("high"))]
    return (
        "<h2>Performance profile</h2><p>The share of training seeds and opponents with more than so many of the "
        "points; the band is the 95 % interval.</p>"
        + _plot("Performance profile: share of opponents above a score", ("0.5", "score above 1"), curve("share"), band)
    )


def _plot(
    title: str, along: tuple[str, str], points: Sequence[tuple[float, float]], band: Sequence[tuple[float, float]] = ()
) -> str:
    """Return a curve over an axis that has these words in its middle and at its end."""

    def path(places: Sequence[tuple[float, float]]) -> str:
        return " ".join(f"{_LEFT + _WIDTH * x:.1f},{_TOP + _HEIGHT * (1 - y):.1f}" for x, y in places)

    base, side = _TOP + _HEIGHT, _LEFT + _WIDTH
    half, centre = _TOP + _HEIGHT / 2, _LEFT + _WIDTH / 2
    return (
        f'<svg viewBox="0 0 {side + 12} {base + 24}" role="img" aria-label="{title}">'
        f'<path d="M{_LEFT},{_TOP}V{base}H{side}M{_LEFT - 4},{half}h4M{centre},{base}v4" fill="none" stroke="#555"/>'
        f'<text x="{_LEFT - 6}" y="{_TOP + 8}" text-anchor="end">1</text>'
        f'<text x="{_LEFT - 6}" y="{half + 4}" text-anchor="end">0.5</text>'
        f'<text x="{_LEFT - 6}" y="{base}" text-anchor="end">0</text>'
        f'<text x="{_LEFT}" y="{base + 17}">0</text>'
        f'<text x="{centre}" y="{base + 17}" text-anchor="middle">{along[0]}</text>'
        f'<text x="{side}" y="{base + 17}" text-anchor="end">{along[1]}</text>'
        + (f'<polygon points="{path(band)}" fill="#9ec5e8"/>' if band else "")
        + f'<polyline points="{path(points)}" fill="none" stroke="#0b4f8a" stroke-width="2"/></svg>'
    )


def _improvement(found: dict[str, Any] | None) -> str:
    if found is None:
        return ""
    over = escape(str(found["over"]))
    return (
        f"<h2>Compared with {over}</h2><p>Probability that a training seed of this entry has more of the points than "
        f"one of {over}, the mean over opponents: {_number(found['probability'])} ({_ends(found['ci95'])}).</p>"
    )


def _cost(policies: Sequence[dict[str, Any]], cost: dict[str, Any]) -> str:
    def told(value: Any) -> str:
        return "not said" if value is None else f"{value:,}" if isinstance(value, (int, float)) else escape(str(value))

    rows = [
        (escape(str(policy["name"])), *(told(one[name]) for name in ("commands", "seconds", "processor", "parameters")))
        for policy, one in zip(policies, cost["policies"], strict=True)
    ]
    headings = ("policy", "commands seen", "seconds", "processor", "parameters")
    return (
        "<h2>Cost</h2>"
        + _table("Training, as the cards of the policies say", headings, rows)
        + f"<p>{_number(cost['ms_a_command'])} ms a command, on {escape(str(cost['measured_on']))}"
        f"{escape(f' ({kind})') if (kind := cost.get('processor')) else ''}, "
        f"{'a cluster' if cost['processes'] is None else escape(str(cost['processes'])) + ' processes'}.</p>"
    )


def _origin(report: dict[str, Any]) -> str:
    rows = {
        "protocol": f"{report['protocol']['version']}, {report['protocol']['digest']}",
        "policies": ", ".join(f"{policy['name']} ({policy['digest']})" for policy in report["policies"]),
        "rules": report["rules_hash"],
        "configuration": report["config_hash"],
        "seeds": ", ".join(f"{name} {seed}" for name, seed in report["seeds"].items()),
        "versions": ", ".join(f"{name} {version}" for name, version in report["versions"].items()),
        "games": f"{report['games']['count']:,} in {report['games']['file']}, {report['games']['sha256']}",
        "signature": report["signature"],
        "made by": report["cost"]["command"],
    }
    listed = "".join(f"<dt>{name}</dt><dd>{escape(str(value))}</dd>\n" for name, value in rows.items())
    return (
        f"<h2>Origin</h2><dl>{listed}</dl><p>The signature is a checksum against edits, over all but costs. It "
        "does not prove who made the report: <code>swarm-pz benchmark --verify</code> plays a sample of them "
        "again.</p>"
    )
