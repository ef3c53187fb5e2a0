"""A study as data sets of two standards, for search engines and programs that know them.

- BIDS 1.10 (the Brain Imaging Data Structure; Gorgolewski et al., Scientific Data 3, 2016), behavioural experiments
  without imaging: a condition is a task, a game of it a run with a file of events, and practice an acquisition of its
  own.
- Psych-DS, schema 1.5: `dataset_description.json` is a schema.org Dataset that knows every column, and the names of the
  tables are pairs of a key and a value.
"""

from __future__ import annotations

import csv
import json
import unicodedata
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.evaluation.provenance import versions
from swarm_pz.play.recordings.tables import write_table
from swarm_pz.play.studies.reading import StudyData
from swarm_pz.play.studies.report import markdown
from swarm_pz.play.studies.rows import TABLES, CaptureRow, CommandRow, GameRow, codebook

VERSION = "1.10.0"
EMPTY = "n/a"
EVENTS = {
    "onset": ("when it was, from the beginning of the game; before it, if it is negative", "s"),
    "duration": ("how long it was; 0 for a moment", "s"),
    "trial_type": ("what it was", ""),
    "side": ("whose command it is, or who took the drone", ""),
    "actor": ("who acted, as the participant sees it", ""),
    "number": ("of the command, or of the drone", ""),
    "drones": ("drones of the participant after it", "count"),
    "opponent_drones": ("drones of the opponent after it", "count"),
}
"""Columns of events: what they are, and their units."""
LEVELS = {
    "trial_type": {
        "game": "the game, from its first to its last moment",
        "command_received": "a command arrived",
        "command_in_force": "a command is followed from here on",
        "capture": "a drone was taken",
    },
    "side": {"red": "the red side", "blue": "the blue side"},
    "actor": {
        "participant": "the participant",
        "opponent": "the opponent",
        "automatic": "a response that was set up before, in a player's place",
    },
}
"""What stands in those columns that hold one of a few words."""


def write_bids(data: StudyData, folder: Path) -> None:
    """Write a study's games as a BIDS data set, into a new folder."""
    folder.mkdir()
    tasks = labels((one.title for one in data.study.conditions), "condition")
    software = {"Name": "swarm-pz", "Version": versions()["swarm-pz"]}
    head = {"Name": data.study.title, "BIDSVersion": VERSION, "DatasetType": "raw", "GeneratedBy": [software]}
    write_json(head, folder / "dataset_description.json")
    (folder / "README").write_text(_readme(data.study.title, tasks), encoding="utf-8")
    _write_people(data, folder)
    happened: dict[tuple[str, str], list[CommandRow | CaptureRow]] = {}
    rows: list[CommandRow | CaptureRow] = [*data.commands, *data.captures]
    for row in rows:
        happened.setdefault((row.participant, row.step), []).append(row)
    for game in data.games:
        who, practice = f"sub-{game.participant}", "_acq-practice" if game.practice else ""
        beside = folder / who / "beh"
        beside.mkdir(parents=True, exist_ok=True)
        path = beside / f"{who}_task-{tasks[game.condition]}{practice}_run-{game.game}_events.tsv"
        _write_tsv([list(EVENTS), *_events(game, happened.get((game.participant, game.step), []))], path)
        write_json(_sidecar(game), path.with_suffix(".json"))


def _events(game: GameRow, rows: Iterable[CommandRow | CaptureRow]) -> list[list[Any]]:
    """Return a game's events, by when they were: whole seconds of the clock, whatever the game's speed."""
    speed = game.speed or 1.0
    whole = [0.0, game.seconds / speed, "game", game.side, "participant", None, game.drones, game.opponent_drones]
    found: list[list[Any]] = [whole]
    for row in rows:
        if isinstance(row, CaptureRow):
            actor = "participant" if row.by_participant else "opponent"
            onset = row.tick / TICKS_PER_SECOND / speed
            found.append([onset, 0.0, "capture", row.side, actor, row.drone, row.drones, row.opponent_drones])
            continue
        onset, about = row.received_ms / 1000.0, [row.side, row.by, row.number, None, None]
        found.append([onset, 0.0, "command_received", *about])
        if row.to_in_force_ms is not None:
            found.append([onset + row.to_in_force_ms / 1000.0, 0.0, "command_in_force", *about])
    return sorted(found, key=lambda event: float(event[0]))


def _sidecar(game: GameRow) -> dict[str, Any]:
    software = {"SoftwareName": "swarm-pz", "SoftwareVersion": versions()["swarm-pz"]}
    names = [column.name for column in fields(GameRow) if column.name not in ("participant", "at")]
    told: dict[str, Any] = {
        "StimulusPresentation": software,
        "Game": {name: getattr(game, name) for name in names},
    }
    for name, (about, unit) in EVENTS.items():
        told[name] = {"Description": about} | ({"Units": unit} if unit == "s" else {})
        told[name] |= {"Levels": LEVELS[name]} if name in LEVELS else {}
    return told


def _write_people(data: StudyData, folder: Path) -> None:
    names = ["number", "order", "finished", "games", "practice_games", "wins"]
    lines = [[f"sub-{row.participant}", *(getattr(row, name) for name in names)] for row in data.remaining]
    _write_tsv([["participant_id", *names], *lines], folder / "participants.tsv")
    known = codebook()["participants"]["columns"]
    write_json({name: {"Description": known[name]["about"]} for name in names}, folder / "participants.json")


def _readme(title: str, tasks: dict[str, str]) -> str:
    conditions = ", ".join(f"{condition}: task-{label}" for condition, label in tasks.items())
    return (
        f"# {title}\n\n"
        "Games of two swarms of drones, each led by commands; written by swarm-pz from the recordings of a study.\n\n"
        f"Each condition is a task ({conditions}), each game a run; games of practice are acq-practice. Onsets are "
        "seconds since the beginning of a game. Answers to forms and the commands themselves are in the tables of the "
        "same export.\n"
    )


def _write_tsv(rows: Iterable[Iterable[Any]], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, "excel-tab", lineterminator="\n").writerows([_cell(value) for value in row] for row in rows)


def _cell(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, 6)
    return EMPTY if value is None or value == "" else str(value).lower() if isinstance(value, bool) else value


# --- Psych-DS -----------------------------------------------------------------------------------------


def write_psychds(data: StudyData, folder: Path) -> None:
    """Write a study's tables as a Psych-DS data set, into a new folder."""
    (folder / "data").mkdir(parents=True)
    title = data.study.title
    study = labels([title], "study")[title]
    for name, kind in TABLES.items():
        write_table(data.table(name), kind, folder / "data" / f"study-{study}_description-{name}_data.csv")
    about = (
        f"Games of two swarms of drones, played by {len(data.remaining)} participants under the conditions "
        f"{', '.join(one.title for one in data.study.conditions)}: what each of them commanded, took and answered. "
        "Written by swarm-pz from the recordings."
    )
    description = {
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": title,
        "description": about,
        "keywords": ["swarm-pz", "human-swarm interaction", "drones"],
        "variableMeasured": _variables(),
    }
    write_json(description, folder / "dataset_description.json")
    (folder / "README.md").write_text(f"# {markdown(title)}\n\n{markdown(about)}\n", encoding="utf-8")


def _variables() -> list[dict[str, Any]]:
    """Return all columns, each once: what it is in each of its tables, and its unit."""
    found: dict[str, dict[str, Any]] = {}
    for name, table in codebook().items():
        for column, told in table["columns"].items():
            known = found.setdefault(column, {"@type": "PropertyValue", "name": column, "description": ""})
            known["description"] += f"{'; ' if known['description'] else ''}in {name}: {told['about']}"
            known |= {"unitText": told["unit"]} if told["unit"] else {}
    return list(found.values())


# --- of both ------------------------------------------------------------------------------------------


def write_json(content: Any, path: Path) -> None:
    """Write plain values as a file that people read, too."""
    path.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def labels(names: Iterable[str], otherwise: str) -> dict[str, str]:
    """Return labels of ASCII letters and digits, as names of data files have them, a different one for each name.

    They differ by more than upper and lower case, since files of some systems must.
    """
    found: dict[str, str] = {}
    for name in dict.fromkeys(names):
        words = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
        stem = "".join(filter(str.isalnum, words)) or otherwise
        label, count, taken = stem, 1, {one.lower() for one in found.values()}
        while label.lower() in taken:
            count += 1
            label = f"{stem}x{count}"
        found[name] = label
    return found
