"""Entries: a folder each, with the policies of a method, the report of the benchmark on them, and a card."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from swarm_pz.errors import ConfigError, ResultsError
from swarm_pz.files import read_toml
from swarm_pz.policy import load, registered
from swarm_pz.policy.identity import identity_of
from swarm_pz.standard import Protocol
from swarm_pz.standard.report import REPORT, is_try, read_report

CARD, POLICIES = "entry.toml", "policies"
LETTERS = {"by": 60, "notes": 300, "link": 200}
"""Fields of a card, and the letters that each may have; `by` must be given."""
_NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,39}")
_FILE = re.compile(rf"{CARD}|{REPORT}|{POLICIES}/\d{{1,2}}/policy\.(?:json|safetensors|onnx)")
_LINK = re.compile(r"https://[A-Za-z0-9.-]+(?::\d+)?(?:/[A-Za-z0-9._~/?#@!$&()*+,;=%-]*)?")


@dataclass(frozen=True)
class Entry:
    """An entry: its report, and its card, which says whose it is."""

    folder: Path
    report: dict[str, Any]
    card: dict[str, str]

    @property
    def name(self) -> str:
        """Its folder's name."""
        return self.folder.name

    def check(self, protocol: Protocol) -> None:
        """Check that its policies can be loaded and are those of its report."""
        for number, told in enumerate(self.report["policies"]):
            folder = self.folder / POLICIES / str(number)
            place = str(folder) if folder.is_dir() else told["name"]
            found = identity_of(place, load(place, protocol.game))
            if found != told["digest"]:
                raise ResultsError(f"{place} is not the report's policy: expected {told['digest']!r}, got {found!r}")


def folders(place: Path) -> list[Path]:
    """Return the folders of all entries, in alphabetical order; anything else there is an error."""
    found = sorted(path for path in place.glob("*") if path.name != ".gitkeep")
    for path in found:
        if not path.is_dir() or not _NAME.fullmatch(path.name):
            raise ResultsError(f"{path} is no entry: expected a folder named by 1 to 40 of a to z, 0 to 9 and '-'")
    return found


def read(folder: Path, protocol: Protocol) -> Entry:
    """Read an entry; a ResultsError is raised if it holds other files, or is of another protocol."""
    for path in folder.rglob("*"):
        if path.is_file() and not _FILE.fullmatch(path.relative_to(folder).as_posix()):
            raise ResultsError(f"{path} belongs to no entry: remove it; weights are policy.safetensors or policy.onnx")
    report = read_report(folder)
    told = {"version": protocol.version, "digest": protocol.digest}
    if report["protocol"] != told:
        raise ResultsError(f"{folder} is of protocol {report['protocol']!r}, the board is of {told!r}")
    return Entry(folder, report, read_card(folder / CARD))


def add(report: Path, policies: list[str], folder: Path, card: dict[str, str], protocol: Protocol) -> Entry:
    """Make an entry of policies, by their names or folders, and of the folder of their report."""
    if not _NAME.fullmatch(folder.name):
        raise ResultsError(f"an entry's name must be 1 to 40 of a to z, 0 to 9 and '-', got {folder.name!r}")
    if folder.exists():
        raise ResultsError(f"there is an entry {folder.name!r} already: choose another name, or remove {folder}")
    if is_try(read_report(report)):
        raise ResultsError(f"{report} is of a try with few and short games, which is no entry: leave out --quick")
    folder.mkdir(parents=True)
    try:
        for number, policy in enumerate(policies):
            write = getattr(load(policy, protocol.game), "write", None)
            if write is not None:
                write(folder / POLICIES / str(number))
            elif policy not in registered():
                raise ResultsError(
                    f"{policy} must be a folder with weights or an installed policy; programs play seasons"
                )
        text = "".join(f"{field} = {json.dumps(value, ensure_ascii=False)}\n" for field, value in card.items() if value)
        (folder / CARD).write_text(text, encoding="utf-8")
        shutil.copyfile(report / REPORT, folder / REPORT)
        entry = read(folder, protocol)
        entry.check(protocol)
    except BaseException:
        shutil.rmtree(folder)
        raise
    return entry


def read_card(path: Path) -> dict[str, str]:
    """Return the fields of a card: known ones alone, each a text on one line, the link by https."""
    try:
        told = read_toml(path)
    except ConfigError as error:
        raise ResultsError(f"{path} {error}") from error
    if unknown := sorted(set(told) - set(LETTERS)):
        raise ResultsError(f"{path} has unknown fields: {', '.join(map(repr, unknown))[:200]}; remove them")
    card = {field: told.get(field, "") for field in LETTERS}
    for field, value in card.items():
        is_text = isinstance(value, str) and len(value) <= LETTERS[field] and value.isprintable()
        if not is_text or (field == "by" and not value.strip()):
            raise ResultsError(
                f"{field} in {path} must be a text on one line, of {LETTERS[field]} letters or fewer, got {value!r:.70}"
            )
    if card["link"] and not _LINK.fullmatch(card["link"]):
        raise ResultsError(f"link in {path} must be an address that begins with https://, got {card['link'][:70]!r}")
    return card
