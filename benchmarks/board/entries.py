"""Entries of the board: folders with the policies of a method, the benchmark's report on them, and a card."""

from __future__ import annotations

import json
import re
import shutil
import tempfile
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from swarm_pz.errors import ConfigError, ResultsError
from swarm_pz.files import draft_of, read_toml
from swarm_pz.policy import load, registered
from swarm_pz.policy.identity import identity_of
from swarm_pz.standard import Entry as MeasuredEntry
from swarm_pz.standard import Protocol, meet, run
from swarm_pz.standard.report import REPORT, encode, read_report

CARD, POLICIES = "entry.toml", "policies"
LETTERS = {"by": 60, "notes": 300, "link": 200, "policies": 200}
"""Fields of a card, and their maximum lengths; `by` is required, and `policies` names installed policies."""
_NAME = re.compile(r"[a-z0-9][a-z0-9-]{0,39}")
_FILE = re.compile(rf"{CARD}|{REPORT}|{POLICIES}/\d{{1,2}}/policy\.(?:json|safetensors|onnx)")
_LINK = re.compile(r"https://[A-Za-z0-9.-]+(?::\d+)?(?:/[A-Za-z0-9._~/?#@!$&()*+,;=%-]*)?")


@dataclass(frozen=True)
class Entry:
    """An entry: its policies by name or folder, a card that says whose it is, and the report if there is one."""

    folder: Path
    policies: tuple[str, ...]
    card: dict[str, str]
    report: dict[str, Any] | None

    @property
    def name(self) -> str:
        """Its folder's name."""
        return self.folder.name

    def check(self, protocol: Protocol) -> None:
        """Raise a ResultsError unless the report is of this protocol and of the entry's policies."""
        if self.report is None:
            raise ResultsError(f"{self.folder} has no report: `scripts/board play` makes it")
        current = {"version": protocol.version, "digest": protocol.digest}
        if self.report["protocol"] != current:
            raise ResultsError(f"{self.folder} is of protocol {self.report['protocol']!r}, the board is of {current!r}")
        digests = [identity_of(policy, load(policy, protocol.game)) for policy in self.policies]
        expected = [one["digest"] for one in self.report["policies"]]
        if digests != expected:
            raise ResultsError(f"{self.folder} has a report of other policies: expected {expected}, got {digests}")


def folders(place: Path) -> list[Path]:
    """Return the folders of all entries, in alphabetical order; anything else there is an error."""
    paths = sorted(path for path in place.glob("*") if path.name != ".gitkeep")
    for path in paths:
        if not path.is_dir() or not _NAME.fullmatch(path.name):
            raise ResultsError(f"{path} is no entry: expected a folder named by 1 to 40 of a to z, 0 to 9 and '-'")
    return paths


def read(folder: Path) -> Entry:
    """Read an entry; a ResultsError is raised if it holds other files."""
    for path in folder.rglob("*"):
        if path.is_file() and not _FILE.fullmatch(path.relative_to(folder).as_posix()):
            raise ResultsError(f"{path} belongs to no entry: remove it; weights are policy.safetensors or policy.onnx")
    card = read_card(folder / CARD)
    installed = tuple(filter(None, card.pop("policies").split(" ")))
    policies = installed or tuple(sorted(map(str, (folder / POLICIES).glob("*"))))
    if not policies:
        raise ResultsError(f"{folder} has neither policies nor names of installed ones")
    return Entry(folder, policies, card, read_report(folder) if (folder / REPORT).exists() else None)


def add(policies: list[str], folder: Path, card: dict[str, str], protocol: Protocol) -> Entry:
    """Make an entry, without a report, from the names or folders of policies."""
    if not _NAME.fullmatch(folder.name):
        raise ResultsError(f"an entry's name must be 1 to 40 of a to z, 0 to 9 and '-', got {folder.name!r}")
    if folder.exists():
        raise ResultsError(f"there is an entry {folder.name!r} already: choose another name, or remove {folder}")
    folder.mkdir(parents=True)
    try:
        if set(policies) <= set(registered()):
            card = card | {"policies": " ".join(policies)}
        else:
            for number, policy in enumerate(policies):
                write = getattr(load(policy, protocol.game), "write", None)
                if write is None:
                    raise ResultsError(f"{policy} must be a folder with weights, as all of a method or none of it")
                write(folder / POLICIES / str(number))
        text = "".join(f"{field} = {json.dumps(value, ensure_ascii=False)}\n" for field, value in card.items() if value)
        (folder / CARD).write_text(text, encoding="utf-8")
        return read(folder)
    except BaseException:
        shutil.rmtree(folder)
        raise


def play(place: Path, protocol: Protocol, work: Path, names: Sequence[str] = (), **more: Any) -> None:
    """Run the benchmark on entries, by default all, and write their reports; all other entries attack each one.

    Games in the folder `work` are not played again. `more` are further arguments of `swarm_pz.standard.run`.
    """
    entries = {folder.name: read(folder) for folder in folders(place)}
    for name in names or entries:
        others = {
            f"{other.name}/{number}": policy
            for other in entries.values()
            if other.name != name
            for number, policy in enumerate(other.policies)
        }
        entry = entries[name]
        run(MeasuredEntry(policies=entry.policies, name=name), work / name, protocol=protocol, attackers=others, **more)
        shutil.copyfile(work / name / REPORT, entry.folder / REPORT)


def attack(
    place: Path, protocol: Protocol, work: Path, name: str, *, pool: Executor, say: Callable[[str], None], **more: Any
) -> None:
    """Let an entry attack all others; run the benchmark again on those that it beats more than earlier attackers."""
    entries = {folder.name: read(folder) for folder in folders(place)}
    newcomers = {f"{name}/{number}": policy for number, policy in enumerate(entries.pop(name).policies)}
    for other in entries.values():
        if (report := other.report) is None:
            continue
        with tempfile.TemporaryDirectory(prefix="swarm-pz-") as folder:
            if meet(report, other.policies, newcomers, Path(folder), protocol=protocol, pool=pool):
                with draft_of(other.folder / REPORT) as draft:
                    draft.write_text(encode(report))
                continue
        say(f"{name} beats {other.name} more than anybody before")
        play(place, protocol, work, [other.name], pool=pool, say=say, **more)


def read_card(path: Path) -> dict[str, str]:
    """Return the fields of a card; raise a ResultsError if one is unknown or invalid, or `by` is missing."""
    try:
        fields = read_toml(path)
    except ConfigError as error:
        raise ResultsError(f"{path} {error}") from error
    if unknown := sorted(set(fields) - set(LETTERS)):
        raise ResultsError(f"{path} has unknown fields: {', '.join(map(repr, unknown))[:200]}; remove them")
    card = {field: fields.get(field, "") for field in LETTERS}
    for field, value in card.items():
        is_text = isinstance(value, str) and len(value) <= LETTERS[field] and value.isprintable()
        if not is_text or (field == "by" and not value.strip()):
            raise ResultsError(
                f"{field} in {path} must be a text on one line, of {LETTERS[field]} letters or fewer, got {value!r:.70}"
            )
    if card["link"] and not _LINK.fullmatch(card["link"]):
        raise ResultsError(f"link in {path} must be an address that begins with https://, got {card['link'][:70]!r}")
    return card
