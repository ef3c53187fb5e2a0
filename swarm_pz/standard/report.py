"""The files of a report: ``report.json`` (figures, digests, seeds, versions), ``games.jsonl`` and ``index.html``.

The signature is a digest of all but costs, so the same entry has the same signature twice; the checksum is a digest of
all. Both find edits, but anybody can compute them: only playing games again shows that a report is true.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from swarm_pz.errors import ConfigError, ResultsError
from swarm_pz.files import draft_of, read_bytes
from swarm_pz.standard.games import Line

REPORT, GAMES, PAGE = "report.json", "games.jsonl", "index.html"
FORMAT = 1
COST = "cost"
_MOST = {REPORT: 2**24, GAMES: 2**28, PAGE: 2**24}
"""Bytes of each file that are read."""
MOST_POLICIES = 100
_MOST_NUMBERS = {"policy": MOST_POLICIES, "number": 10**6}


def _digest(plain: Any) -> str:
    text = json.dumps(plain, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def signed(report: dict[str, Any]) -> dict[str, Any]:
    """Return a report with its signature, over all but costs, and its checksum, over all."""
    bare = {name: value for name, value in report.items() if name not in ("signature", "checksum")}
    whole = bare | {"signature": _digest({name: value for name, value in bare.items() if name != COST})}
    return whole | {"checksum": _digest(whole)}


def is_try(report: dict[str, Any]) -> bool:
    """Return whether a report is a try, with few and short games."""
    return str(report["protocol"]["version"]).endswith("-quick")


def encode_games(lines: Sequence[Line]) -> bytes:
    """Return the lines of games as ``games.jsonl`` holds them."""
    return "".join(json.dumps(line._asdict()) + "\n" for line in lines).encode()


def write(folder: Path, report: dict[str, Any], lines: Sequence[Line], page: str) -> None:
    """Write a report, its JSON last, so that none stands there without its games."""
    text = json.dumps(report, indent=1, allow_nan=False) + "\n"
    for name, data in ((GAMES, encode_games(lines)), (PAGE, page.encode()), (REPORT, text.encode())):
        with draft_of(folder / name) as draft:
            draft.write_bytes(data)


def read(folder: Path) -> tuple[dict[str, Any], list[Line]]:
    """Read a report and its games; raise a ResultsError if a file is missing, too large, corrupt, or was changed."""
    report = _parse(_bytes(folder / REPORT), folder / REPORT)
    if not isinstance(report, dict) or report.get("format") != FORMAT:
        raise ResultsError(
            f"{folder / REPORT} is no report of format {FORMAT}: make it again with `swarm-pz benchmark`"
        )
    try:
        again = signed(report)
    except (ValueError, RecursionError) as error:  # a number without end, or what is too deep to be written
        raise ResultsError(f"{folder / REPORT} is corrupt: {error}") from error
    for name in ("checksum", "signature"):
        if report.get(name) != again[name]:
            raise ResultsError(
                f"{folder / REPORT} was changed after it was written: its {name} is {str(report.get(name))[:70]!r}, "
                f"its content has {again[name]!r}"
            )
    data = _bytes(folder / GAMES)
    try:
        expected = report["games"]["sha256"]
        if hashlib.sha256(data).hexdigest() != expected:
            raise ResultsError(
                f"{folder / GAMES} was changed after it was written: it is not the file that {REPORT} names"
            )
        lines = [Line(**_parse(row, folder / GAMES)) for row in data.splitlines()]
    except (LookupError, TypeError) as error:
        raise ResultsError(f"{folder} holds no whole report: {error!r}") from error
    _check_lines(lines, folder / GAMES)
    return report, lines


def _bytes(path: Path) -> bytes:
    if not path.is_file():
        raise ResultsError(f"there is no report in {path.parent}: {path.name} is missing")
    try:
        return read_bytes(path, _MOST[path.name])
    except ConfigError as error:
        raise ResultsError(f"{path} {error}") from error


def _parse(data: bytes, path: Path) -> Any:
    """Return a file's JSON; refuse a name that stands twice, since other readers might take the first."""

    def refuse(word: str) -> Any:
        raise ValueError(f"{word} is no number of JSON")

    def distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(found := dict(pairs)) < len(pairs):
            raise ValueError(f"a name stands twice in an object of {str(list(found))[:70]}")
        return found

    try:
        return json.loads(data, parse_constant=refuse, object_pairs_hook=distinct)
    except (ValueError, RecursionError) as error:
        raise ResultsError(f"{path} is corrupt: {error}") from error


def _check_lines(lines: Sequence[Line], path: Path) -> None:
    kinds: dict[str, type] = dict.fromkeys(Line._fields, str)
    kinds |= {"policy": int, "number": int, "share": float, "seconds": float}
    for number, line in enumerate(lines, 1):
        for name, kind in kinds.items():
            value: Any = getattr(line, name)
            holds = type(value) is kind
            if kind is int:
                holds = holds and 0 <= value < _MOST_NUMBERS[name]
            if not holds or (name == "outcome" and value not in ("win", "draw", "loss")):
                raise ResultsError(f"line {number} of {path} is no game: {name} is {str(value)[:70]!r}")


def page_of(folder: Path) -> str:
    """Return the page of a report as it lies there."""
    return _bytes(folder / PAGE).decode("utf-8", "replace")
