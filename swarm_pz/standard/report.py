"""The files of a report: ``report.json`` (figures, digests, seeds, versions), ``games.jsonl`` and ``index.html``."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from swarm_pz.errors import ConfigError, ResultsError
from swarm_pz.files import draft_of, read_bytes
from swarm_pz.standard.games import Line

REPORT, GAMES, PAGE = "report.json", "games.jsonl", "index.html"
FORMAT = 3
COST = "cost"
_MOST_BYTES = 2**24
"""Maximum size of a report to read."""


def is_try(report: dict[str, Any]) -> bool:
    """Return True for a report on few and short games, by `Protocol.quick`."""
    return str(report["protocol"]["version"]).endswith("-quick")


def encode(report: dict[str, Any]) -> str:
    """Return the text of ``report.json``."""
    return json.dumps(report, indent=1, allow_nan=False) + "\n"


def write(folder: Path, report: dict[str, Any], lines: Sequence[Line], page: str) -> None:
    """Write a report, its JSON last, so that it never exists without its games."""
    games = "".join(json.dumps(line._asdict()) + "\n" for line in lines)
    for name, text in ((GAMES, games), (PAGE, page), (REPORT, encode(report))):
        with draft_of(folder / name) as draft:
            draft.write_text(text, encoding="utf-8")


def read_report(folder: Path) -> dict[str, Any]:
    """Return the report in a folder; raise a ResultsError if it is missing, too large, corrupt or foreign."""
    path = folder / REPORT
    if not path.is_file():
        raise ResultsError(f"there is no report in {folder}: {REPORT} is missing")
    try:
        report = json.loads(read_bytes(path, _MOST_BYTES))
    except ConfigError as error:
        raise ResultsError(f"{path} {error}") from error
    except (ValueError, RecursionError) as error:
        raise ResultsError(f"{path} is corrupt: {error}") from error
    if not isinstance(report, dict) or report.get("format") != FORMAT:
        raise ResultsError(f"{path} is no report of format {FORMAT}: make it again with `swarm-pz benchmark`")
    return report
