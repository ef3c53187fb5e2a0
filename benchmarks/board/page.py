"""The board's pages: a table of all entries, and the report of each.

Each page is one file that fetches nothing, so it also works when opened from disk. Templates escape every text, and
the index page's content security policy allows only its own style and script, by digest.
"""

from __future__ import annotations

import base64
import functools
import hashlib
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from benchmarks.board.entries import folders, read
from swarm_pz.standard import Protocol
from swarm_pz.standard.page import kinds_of, render

HERE = Path(__file__).parent
_REPORTS = "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src 'unsafe-inline'\">\n"
"""The security policy of a report's page."""


def build(place: Path, protocol: Protocol | None = None) -> dict[str, str]:
    """Return the pages by their paths: ``index.html``, and a report of each entry."""
    protocol = protocol if protocol is not None else Protocol.read()
    entries = [read(folder) for folder in folders(place)]
    for entry in entries:
        entry.check(protocol)
    entries.sort(key=lambda entry: (-entry.report["figures"]["score"], entry.name))
    tracks = list(entries[0].report["figures"]["tracks"]) if entries else []
    style, code = (HERE / "style.css").read_text(), (HERE / "board.js").read_text()
    digests = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in (style, code)]
    template = _templates().get_template("index.html.jinja")
    context = {"style": style, "code": code, "digests": digests, "protocol": protocol, "tracks": tracks}
    return {"index.html": template.render(entries=entries, **context)} | {
        f"{entry.name}/report.html": render(entry.report, _REPORTS) for entry in entries
    }


@functools.cache
def _templates() -> Environment:
    templates = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True
    )
    templates.filters |= {"mean": lambda values: float(np.mean(values)), "form": format}
    templates.filters |= {"hours": _hours, "where": _where, "kinds": kinds_of}
    return templates


def _hours(costs: list[dict[str, Any]]) -> list[float | None]:
    return [None if one["seconds"] is None else one["seconds"] / 3600 for one in costs]


def _where(costs: list[dict[str, Any]]) -> str:
    return ", ".join(sorted({str(one["processor"])[:60] for one in costs if one["processor"] is not None}))
