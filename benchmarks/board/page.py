"""The board's pages: a table of all entries, and of each entry its report and a game.

Each is one file that fetches nothing, so that it works where it is opened as a file, too. Only our own script runs in
it, which its security policy names by digest: entries are written by others. Templates escape every text.
"""

from __future__ import annotations

import base64
import functools
import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from benchmarks.board import replay
from benchmarks.board.entries import Entry, folders, read
from swarm_pz.config import TEAM_NAMES
from swarm_pz.standard import Protocol
from swarm_pz.standard import report as reports
from swarm_pz.standard.page import kinds_of, render

HERE = Path(__file__).parent
_REPORTS = "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n"
"""What the page of a report may do."""


def build(place: Path, protocol: Protocol | None = None) -> dict[str, str]:
    """Return the pages by their paths: ``index.html``, and two of each entry."""
    protocol = protocol if protocol is not None else Protocol.read()
    entries = [read(folder, protocol) for folder in folders(place)]
    entries.sort(key=lambda entry: (-entry.report["figures"]["score"], entry.name))
    tracks = list(entries[0].report["figures"]["tracks"]) if entries else []
    pages = {"index.html": _page("index.html.jinja", "board.js", protocol=protocol, tracks=tracks, entries=entries)}
    for entry in entries:
        pages[f"{entry.name}/report.html"] = render(entry.report, _REPORTS)
        pages[f"{entry.name}/replay.html"] = _game(entry, protocol)
    return pages


@functools.cache
def _templates() -> Environment:
    templates = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True
    )
    templates.filters |= {"mean": lambda values: float(np.mean(values)), "form": format}
    templates.filters |= {"hours": _hours, "where": _where, "kinds": kinds_of}
    return templates


def _page(template: str, script: str, **given: Any) -> str:
    style, code = (HERE / "style.css").read_text(), (HERE / script).read_text()
    digests = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in (style, code)]
    return _templates().get_template(template).render(style=style, code=code, digests=digests, **given)


def _hours(costs: list[dict[str, Any]]) -> list[float | None]:
    return [None if one["seconds"] is None else one["seconds"] / 3600 for one in costs]


def _where(costs: list[dict[str, Any]]) -> str:
    return ", ".join(sorted({str(one["processor"])[:60] for one in costs if one["processor"] is not None}))


def _game(entry: Entry, protocol: Protocol) -> str:
    line = replay.line_of_game(entry.replay, reports.read(entry.folder)[1])
    side, name = line.number % 2, entry.report["name"]
    return _page(
        "replay.html.jinja",
        "replay.js",
        name=name,
        line=line,
        share=f"{line.share:.0%}",
        players={TEAM_NAMES[side]: name, TEAM_NAMES[1 - side]: line.opponent},
        command=replay.command_of(entry.name, line, entry.report, protocol),
        game=json.dumps(entry.replay).replace("<", "\\u003c"),
    )
