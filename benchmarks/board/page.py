"""The board's pages: a table of all entries, and of each entry its report and a game.

Each is one file that fetches nothing, so that it works where it is opened as a file, too. Nothing in it runs but our
own script, which its security policy names by digest: entries are written by others.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.board import replay
from benchmarks.board.entries import Entry, folders, read
from swarm_pz.config import TEAM_NAMES
from swarm_pz.standard import Protocol
from swarm_pz.standard import report as reports
from swarm_pz.standard.page import render

HERE = Path(__file__).parent
_REPORTS = "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n"
"""What the page of a report may do."""
_SEND = """<h2>Send in an entry</h2>
<ol>
<li>Train with whatever you like, three seeds or more (one is taken, and said to be one), and write each policy into
a folder:
<code>swarm-pz train</code> does, <code>swarm-pz export</code> makes ONNX of others.</li>
<li><code>swarm-pz benchmark FOLDER ... --name METHOD --out runs/report</code> plays the protocol.</li>
<li><code>scripts/board add runs/report NAME --by "WHO YOU ARE"</code> checks it, plays a sample of it again, and
puts it into <code>docs/board/entries/NAME</code>.</li>
<li>Send that folder as a pull request. <code>CONTRIBUTING.md</code> says what is checked there.</li>
</ol>"""


@dataclass(frozen=True)
class _Column:
    """A column: its heading, which order comes first, and whether it is sorted as text."""

    title: str
    first: str = "ascending"
    is_text: bool = False

    def head(self, sort: str = "") -> str:
        """Return the cell of its heading."""
        text = " data-text" if self.is_text else ""
        return f'<th scope="col" data-first="{self.first}"{text}{sort}>{self.title}</th>'


def build(place: Path, protocol: Protocol | None = None) -> dict[str, str]:
    """Return the pages by their paths: ``index.html``, and two of each entry.

    Raises
    ------
    ResultsError
        If an entry is none: see `benchmarks.board.entries.read`.
    """
    protocol = protocol if protocol is not None else Protocol.read()
    entries = [read(folder, protocol) for folder in folders(place)]
    entries.sort(key=lambda entry: (-entry.report["figures"]["score"], entry.name))
    pages = {"index.html": _board(entries, protocol)}
    for entry in entries:
        pages[f"{entry.name}/report.html"] = render(entry.report, _REPORTS)
        pages[f"{entry.name}/replay.html"] = _game(entry, protocol)
    return pages


def _page(title: str, body: str, script: str) -> str:
    style, code = (HERE / "style.css").read_text(), (HERE / script).read_text()
    digests = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in (style, code)]
    policy = (
        f"default-src 'none'; style-src 'sha256-{digests[0]}'; script-src 'sha256-{digests[1]}'; "
        "base-uri 'none'; form-action 'none'"
    )
    return (
        '<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{policy}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{style}</style>\n</head>\n<body>\n<main>\n{body}\n</main>\n"
        f"<script>{code}</script>\n</body>\n</html>\n"
    )


def _board(entries: Sequence[Entry], protocol: Protocol) -> str:
    about = (
        f"<h1>swarm-pz: the board of protocol {escape(protocol.version)}</h1>\n"
        '<p><a href="../index.html">Documentation</a> · <a href="../benchmark.html">The benchmark</a></p>\n'
        "<p>Methods by one frozen protocol. The score is the mean of the tracks: 1 is every game won, a draw counts "
        "half. Small numbers below a score are its 95 % interval.</p>"
    )
    if not entries:
        about += "\n<p><strong>There is no entry yet.</strong></p>"
        return _page("swarm-pz: the board", f"{about}\n{_SEND}", "board.js")
    tracks = list(entries[0].report["figures"]["tracks"])
    columns = [
        _Column("method", is_text=True),
        _Column("score", "descending"),
        *(_Column(escape(track), "descending") for track in tracks),
        _Column("training<br>seeds", "descending"),
        _Column("commands<br>seen"),
        _Column("hours of<br>training"),
        _Column("parameters"),
        _Column("ms a<br>command"),
    ]
    sorts = ["", ' aria-sort="descending"']
    heads = "".join(column.head(sorts[number] if number < len(sorts) else "") for number, column in enumerate(columns))
    rows = "\n".join(f"<tr>{_row(entry, tracks)}</tr>" for entry in entries)
    table = (
        '<div class="wide" tabindex="0" role="region" aria-label="The board"><table>'
        "<caption>All entries; a heading sorts by its column.</caption>"
        f"<thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}\n</tbody></table></div>"
    )
    notes = (
        '<p class="quiet">The scores of <code>field</code>, <code>held-out</code> and <code>systems</code> are '
        "interquartile means over seeds and opponents: their worst quarter is left out, and their best. A score of 1 "
        "may hide opponents that win; the report lists every one.</p>\n"
        '<p class="quiet">Of a method with one training seed intervals are over its games alone, and say nothing of '
        "another training. Commands, hours and parameters are the means of all training seeds, as the cards of the "
        "policies say: nobody can check them. Milliseconds were measured by the sender. Tests verify every entry: "
        "figures follow from the games, and a sample of these is played again.</p>"
    )
    return _page("swarm-pz: the board", "\n".join([about, table, notes, _SEND]), "board.js")


def _row(entry: Entry, tracks: Sequence[str]) -> str:
    report, card, cost = entry.report, entry.card, entry.report["cost"]
    said = report["figures"]
    seeds, costs = len(report["policies"]), cost["policies"]
    name = escape(report["name"])
    by = escape(card["by"])
    if card["link"]:
        by = f'<a href="{escape(card["link"])}" rel="nofollow noopener noreferrer">{by}</a>'
    extra = [f"<small>{escape(card['notes'])}</small>"] if card["notes"] else []
    if any(policy.get("privileged") for policy in report["policies"]):
        extra.append("<small>sees the simulator itself, which no side may</small>")
    hours = [None if one["seconds"] is None else one["seconds"] / 3600 for one in costs]
    where = sorted({escape(str(one["processor"])[:60]) for one in costs if one["processor"] is not None})
    cells = [
        f'<th scope="row" data-value="{name}"><a href="{entry.name}/report.html">{name}</a>'
        f"<small>{by}</small>{''.join(extra)}"
        f'<small><a href="{entry.name}/replay.html" aria-label="watch a game of {name}">watch a game</a></small></th>',
        _scored(said, bar=True),
        *(_scored(said["tracks"][track]) for track in tracks),
        _cell(seeds, str(seeds), "games alone" if seeds == 1 else ""),
        _mean((one["commands"] for one in costs), ",.0f"),
        _mean(hours, ".2f", ", ".join(where)),
        _mean((one["parameters"] for one in costs), ",.0f"),
        _mean([cost["ms_a_command"]], ".2f", escape(cost["measured_on"][:60])),
    ]
    return "".join(cells)


def _cell(value: float | None, text: str, small: str = "") -> str:
    below = f"<small>{small}</small>" if small else ""
    return f'<td data-value="{"" if value is None else value}">{text}{below}</td>'


def _mean(values: Iterable[float | None], form: str, where: str = "") -> str:
    """Return the cell of a mean cost, and where it was measured."""
    known = [value for value in values if value is not None]
    if not known:
        return _cell(None, '<span class="quiet">not said</span>')
    mean = float(np.mean(known))
    return _cell(mean, format(mean, form) + (f'<small class="where">{where}</small>' if where else ""))


def _scored(said: dict[str, Any], *, bar: bool = False) -> str:
    score, (low, high) = said["score"], said["score_ci95"]
    text = f"{score:.3f}"
    if bar:
        text = (
            f'<span class="score">{text}</span><svg class="bar" viewBox="0 0 100 10" aria-hidden="true">'
            f'<line x1="0" x2="100" y1="5" y2="5"/><rect x="{100 * low:.1f}" width="{100 * (high - low):.1f}" y="2" '
            f'height="6"/><circle cx="{100 * score:.1f}" cy="5" r="3"/></svg>'
        )
    digits = 3 if bar else 2
    return _cell(score, text, f"{low:.{digits}f} to {high:.{digits}f}")


def _game(entry: Entry, protocol: Protocol) -> str:
    shown, lines = entry.replay, reports.read(entry.folder)[1]
    line = replay.line_of_game(shown, lines)
    side = line.number % 2
    name, opponent = escape(entry.report["name"]), escape(line.opponent)
    players = {TEAM_NAMES[side]: name, TEAM_NAMES[1 - side]: opponent}
    ended = {"win": f"{name} won", "loss": f"{opponent} won", "draw": "a draw"}[line.outcome]
    data = json.dumps(shown).replace("<", "\\u003c")
    text = (
        f"<h1>{name} against {opponent}</h1>\n"
        f'<p><a href="../index.html">The board</a> · <a href="report.html">Report</a></p>\n'
        f'<p><span class="red">● red</span> {players["red"]}, <span class="blue">◆ blue</span> {players["blue"]}. '
        f"After {line.seconds:.1f} s: {ended}, with {line.share:.0%} of the drones for {name}.</p>\n"
    )
    player = (
        '<div id="player" hidden>\n'
        '<canvas id="arena" width="1152" height="1152" role="img" aria-label="The arena"></canvas>\n'
        '<div class="controls"><button id="play" type="button">Play</button>'
        '<input id="seek" type="range" min="0" max="1" value="0" aria-label="Moment of the game">'
        '<select id="speed" aria-label="Speed"><option value="1">1 x</option><option value="2" selected>2 x</option>'
        '<option value="4">4 x</option><option value="8">8 x</option></select></div>\n'
        '<p id="told"></p>\n</div>\n'
        "<noscript><p>To see the game here, allow this page its script.</p></noscript>\n"
    )
    film = (
        "<p>It is the first game of the first training seed against this opponent: of every entry the same, so that "
        "nobody chooses. This films it anew, and the same on the kind of processor that the report names:</p>\n"
        f"<pre><code>{escape(replay.command_of(entry.name, line, entry.report, protocol))}</code></pre>\n"
        f'<script type="application/json" id="game">{data}</script>'
    )
    return _page(f"{entry.report['name']} against {line.opponent}: swarm-pz", text + player + film, "replay.js")
