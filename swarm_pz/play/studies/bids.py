"""A study as a data set of the Brain Imaging Data Structure: one file of events a game, beside brain and body data.

As of BIDS 1.10 (Gorgolewski et al., Scientific Data 3, 2016), behavioural experiments without imaging: a condition is
a task, a game of it a run, and practice an acquisition of its own.
"""

from __future__ import annotations

import csv
from collections.abc import Iterable
from dataclasses import fields
from pathlib import Path
from typing import Any

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.evaluation.provenance import versions
from swarm_pz.play.studies.reading import StudyData
from swarm_pz.play.studies.rows import CaptureRow, CommandRow, GameRow, codebook
from swarm_pz.play.studies.tables import labels, write_json

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
