"""Entries: a folder each, with a report, what it needs to be played again, a card, and one recorded game.

All of it was written by others: names of files, sizes and texts are looked at before anything is opened.
"""

from __future__ import annotations

import json
import math
import re
import shutil
import stat
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.board import replay
from swarm_pz.errors import ConfigError, ResultsError
from swarm_pz.files import read_toml
from swarm_pz.standard import Protocol, verify
from swarm_pz.standard import report as reports
from swarm_pz.standard.page import KINDS

CARD = "entry.toml"
KIB, MIB = 2**10, 2**20
WHOLE = 16 * MIB
"""Bytes of an entry."""
LIMITS = {
    CARD: 4 * KIB,
    replay.FILE: MIB // 2,
    reports.REPORT: 2 * MIB,
    reports.GAMES: 8 * MIB,
    reports.PAGE: MIB,
    "policy.json": 64 * KIB,
    "policy.safetensors": 4 * MIB,
    "policy.onnx": 4 * MIB,
}
"""Bytes of each file."""
NEEDED = (CARD, replay.FILE, reports.REPORT, reports.GAMES, reports.PAGE)
_PLACE = re.compile(
    "|".join(map(re.escape, NEEDED))
    + r"|policies/\d{1,2}/policy\.(?:json|safetensors|onnx)|exploiters/\d{1,3}/policy\.(?:json|safetensors)"
)
_NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,39}")
_LINK = re.compile(r"https://[A-Za-z0-9.-]+(?::\d+)?(?:/[A-Za-z0-9._~/?#@!$&()*+,;=%-]*)?")
LETTERS = {"by": 60, "notes": 300, "link": 200}
"""Fields of a card, and the letters that each may have; by whom it is must be said."""
_MOST_LETTERS = 4000
"""Of any text in a report."""
_COSTS = ("commands", "seconds", "parameters")


@dataclass(frozen=True)
class Entry:
    """An entry as its files tell it: its report, its card (what its sender says), and one recorded game."""

    folder: Path
    report: dict[str, Any]
    card: dict[str, str]
    replay: dict[str, Any]

    @property
    def name(self) -> str:
        """Its folder's name."""
        return self.folder.name


def folders(place: Path) -> list[Path]:
    """Return the folders of all entries, in alphabetical order; anything else there is an error."""
    found = sorted(path for path in place.glob("*") if path.name != ".gitkeep")
    for path in found:
        if path.is_symlink() or not path.is_dir() or not _NAME.fullmatch(path.name):
            raise ResultsError(
                f"{path} is no entry: expected a folder named by 1 to 40 of a to z, 0 to 9 and '-', and no link"
            )
    return found


def read(folder: Path, protocol: Protocol | None = None) -> Entry:
    """Read an entry, with all checks that play no games and load no policies."""
    protocol = protocol if protocol is not None else Protocol.read()
    _check_files(folder)
    report, lines = reports.read(folder)
    told = {"version": protocol.version, "digest": protocol.digest}
    if report.get("protocol") != told:
        raise ResultsError(f"{folder} is of protocol {report.get('protocol')!r}, the board is of {told!r}")
    for text in _texts(report):
        if len(text) > _MOST_LETTERS or not text.isprintable():
            raise ResultsError(
                f"{folder / reports.REPORT} holds a text that cannot be shown: expected {_MOST_LETTERS} letters or "
                f"fewer, without control characters, got {text[:70]!r}"
            )
    try:
        _check_report(report)
        played = replay.read(folder, protocol, report, lines)
    except ResultsError:
        raise
    except (AttributeError, LookupError, TypeError, ValueError) as error:
        raise ResultsError(f"{folder} cannot be shown: {error}") from error
    return Entry(folder, report, read_card(folder / CARD), played)


def check(folder: Path, *, games: int, seed: int | None = None, protocol: Protocol | None = None) -> str:
    """Check an entry: files, report (as ``swarm-pz benchmark --verify`` does) and game; return what, in words."""
    protocol = protocol if protocol is not None else Protocol.read()
    entry = read(folder, protocol)
    verdict = verify(folder, games=games, seed=seed, protocol=protocol)
    line = replay.line_of_game(entry.replay, reports.read(folder)[1])
    again, fingerprint = replay.record(folder, entry.report, line, protocol)
    # Elsewhere chaotic games go another way, and say nothing.
    if fingerprint == line.fingerprint and again != entry.replay:
        raise ResultsError(f"{folder / replay.FILE} does not show the game that it names")
    return f"{verdict.check} (sample of seed {verdict.seed})"


def add(
    report: Path, place: Path, name: str, card: dict[str, str], *, games: int, protocol: Protocol | None = None
) -> Entry:
    """Make an entry from a report; it is there when it has been checked."""
    protocol = protocol if protocol is not None else Protocol.read()
    if not _NAME.fullmatch(name):
        raise ResultsError(f"an entry's name must be 1 to 40 of a to z, 0 to 9 and '-', got {name!r}")
    if (place / name).exists():
        raise ResultsError(f"there is an entry {name!r} already: choose another name, or remove {place / name}")
    told, lines = reports.read(report)
    with tempfile.TemporaryDirectory() as room:
        folder = Path(room, name)
        folder.mkdir()
        for path in _files(report):
            inside = path.relative_to(report).as_posix()
            if _PLACE.fullmatch(inside) and inside not in (CARD, replay.FILE):
                (folder / inside).parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, folder / inside, follow_symlinks=False)
        text = "".join(f"{field} = {json.dumps(value, ensure_ascii=False)}\n" for field, value in card.items() if value)
        (folder / CARD).write_text(text, encoding="utf-8")
        shown, _ = replay.record(folder, told, replay.choose(lines, told, protocol), protocol)
        (folder / replay.FILE).write_text(replay.encode(shown))
        check(folder, games=games, protocol=protocol)
        shutil.copytree(folder, place / name)
    return read(place / name, protocol)


def read_card(path: Path) -> dict[str, str]:
    """Return what a sender says of an entry: known fields alone, each a text on one line, a link by https."""
    try:
        told = read_toml(path)
    except ConfigError as error:
        raise ResultsError(f"{path} {error}") from error
    if unknown := sorted(set(told) - set(LETTERS)):
        raise ResultsError(f"{path} has fields that are unknown: {', '.join(map(repr, unknown))[:200]}")
    card = {}
    for field, most in LETTERS.items():
        value = told.get(field, "")
        is_text = isinstance(value, str) and len(value) <= most and value.isprintable()
        if not is_text or (field == "by" and not value.strip()):
            raise ResultsError(
                f"{field} in {path} must be a text on one line, of {most} letters or fewer, got {str(value)[:70]!r}"
            )
        card[field] = value
    if card["link"] and not _LINK.fullmatch(card["link"]):
        raise ResultsError(f"link in {path} must be an address that begins with https://, got {card['link'][:70]!r}")
    return card


def _files(folder: Path) -> Iterator[Path]:
    """Yield all that lies in a folder but folders themselves, links to folders too, and what cannot be opened."""
    for path in sorted(folder.iterdir()):
        if path.is_dir() and not path.is_symlink():
            yield from _files(path)
        else:
            yield path


def _check_files(folder: Path) -> None:
    """Look at names, kinds and sizes of all files before one is opened."""
    if folder.is_symlink() or not folder.is_dir():
        raise ResultsError(f"{folder} is no entry: expected a folder, and no link")
    sizes = {}
    for path in _files(folder):
        inside = path.relative_to(folder).as_posix()
        status = path.lstat()
        if not stat.S_ISREG(status.st_mode):
            raise ResultsError(f"{path} is no file: expected one, got a link, a pipe or a device")
        if not _PLACE.fullmatch(inside):
            raise ResultsError(f"{path} belongs to no entry: remove it; weights are policy.safetensors or policy.onnx")
        if status.st_size > LIMITS[path.name]:
            raise ResultsError(
                f"{path} is too large: expected {LIMITS[path.name]:,} bytes or fewer, got {status.st_size:,}"
            )
        sizes[inside] = status.st_size
    if missing := [name for name in NEEDED if name not in sizes]:
        raise ResultsError(f"{folder} is no whole entry: {', '.join(missing)} is missing")
    if sum(sizes.values()) > WHOLE:
        raise ResultsError(f"{folder} is too large: expected {WHOLE:,} bytes or fewer, got {sum(sizes.values()):,}")


def _texts(plain: Any) -> Iterator[str]:
    """Yield all texts in what a JSON file holds, names of fields too; it is as deep as its reader allows."""
    if isinstance(plain, str):
        yield plain
    elif isinstance(plain, dict):
        for name, value in plain.items():
            yield name
            yield from _texts(value)
    elif isinstance(plain, list):
        for value in plain:
            yield from _texts(value)


def _check_report(report: dict[str, Any]) -> None:
    """Check the values that stand on the board and that no games vouch for."""
    cost = report["cost"]
    if not {one["kind"] for one in report["policies"]} <= set(KINDS):
        raise ValueError(f"kinds of policies must be of {', '.join(KINDS)}")
    if not isinstance(report["name"], str) or not 0 < len(report["name"]) <= 60:
        raise ValueError(f"its name must be 1 to 60 letters, got {str(report['name'])[:70]!r}")
    if len(cost["policies"]) != len(report["policies"]):
        raise ValueError("its costs are of another number of policies")
    numbers = [(name, one[name]) for one in cost["policies"] for name in _COSTS if one[name] is not None]
    for name, value in [*numbers, ("ms_a_command", cost["ms_a_command"])]:
        holds = isinstance(value, (int, float)) and not isinstance(value, bool)
        if not holds or not math.isfinite(value) or not 0 <= value < 1e15:
            raise ValueError(f"{name} among its costs must be a number of at least 0, got {str(value)[:70]!r}")
    for text in (cost["measured_on"], cost["processor"], *(str(one["processor"]) for one in cost["policies"])):
        if not isinstance(text, str) or len(text) > 200:
            raise ValueError(f"a processor must be a text of 200 letters or fewer, got {str(text)[:70]!r}")
