"""A study as a data set of the Brain Imaging Data Structure: one file of events a game, beside brain and body data.

As of BIDS 1.10 (Gorgolewski et al., Scientific Data 3, 2016), behavioural experiments without imaging: a condition is
a task, a game of it a run, and practice an acquisition of its own.
"""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.evaluation.provenance import versions
from swarm_pz.play.studies.reading import StudyData
from swarm_pz.play.studies.rows import CaptureRow, CommandRow, GameRow, ParticipantRow, codebook, columns
from swarm_pz.play.studies.tables import labels

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
TYPES = {
    "game": "the game, from its first to its last moment",
    "command_received": "a command arrived",
    "command_in_force": "a command is followed from here on",
    "capture": "a drone was taken",
}
"""Kinds of events."""


def write_bids(data: StudyData, folder: Path) -> None:
    """Write a study's games as a BIDS data set, into a new folder."""
    folder.mkdir()
    tasks = labels((one.title for one in data.study.conditions), "condition")
    description = {
        "Name": data.study.title,
        "BIDSVersion": VERSION,
        "DatasetType": "raw",
        "GeneratedBy": [{"Name": "swarm-pz", "Version": versions()["swarm-pz"]}],
    }
    _write_json(description, folder / "dataset_description.json")
    (folder / "README").write_text(_readme(data), encoding="utf-8")
    _write_people(data.remaining, folder)
    happened: dict[tuple[str, str], list[CommandRow | CaptureRow]] = {}
    rows: list[CommandRow | CaptureRow] = [*data.commands, *data.captures]
    for row in rows:
        happened.setdefault((row.participant, row.step), []).append(row)
    for game in data.games:
        parts = [f"sub-{game.participant}", f"task-{tasks[game.condition]}"]
        parts += ["acq-practice"] if game.practice else []
        stem = "_".join([*parts, f"run-{game.game}", "events"])
        beside = folder / parts[0] / "beh"
        beside.mkdir(parents=True, exist_ok=True)
        events = _events(game, happened.get((game.participant, game.step), []))
        _write_tsv([list(EVENTS), *events], beside / f"{stem}.tsv")
        _write_json(_sidecar(game), beside / f"{stem}.json")


def _events(game: GameRow, rows: Iterable[CommandRow | CaptureRow]) -> list[list[Any]]:
    """Return a game's events, by when they were: whole seconds of the clock, whatever the game's speed."""
    speed = game.speed or 1.0
    found: list[list[Any]] = [
        [0.0, game.seconds / speed, "game", game.side, "participant", None, game.drones, game.opponent_drones]
    ]
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
    told: dict[str, Any] = {
        name: {"Description": about, **({"Units": unit} if unit == "s" else {})}
        for name, (about, unit) in EVENTS.items()
    }
    told["trial_type"]["Levels"] = TYPES
    told["side"]["Levels"] = {"red": "the red side", "blue": "the blue side"}
    told["actor"]["Levels"] = {
        "participant": "the participant",
        "opponent": "the opponent",
        "automatic": "a response that was set up before, in a player's place",
    }
    return {
        "StimulusPresentation": {"SoftwareName": "swarm-pz", "SoftwareVersion": versions()["swarm-pz"]},
        "Game": {
            column.name: getattr(game, column.name)
            for column in columns(GameRow)
            if column.name not in ("participant", "at")
        },
        **told,
    }


def _write_people(rows: Iterable[ParticipantRow], folder: Path) -> None:
    names = ["number", "order", "finished", "games", "practice_games", "wins"]
    lines = [[f"sub-{row.participant}", *(getattr(row, name) for name in names)] for row in rows]
    _write_tsv([["participant_id", *names], *lines], folder / "participants.tsv")
    known = codebook()["participants"]["columns"]
    told = {name: known[name]["about"] for name in names}
    _write_json({name: {"Description": about} for name, about in told.items()}, folder / "participants.json")


def _readme(data: StudyData) -> str:
    names = labels((one.title for one in data.study.conditions), "condition")
    conditions = ", ".join(f"{title}: task-{label}" for title, label in names.items())
    return (
        f"# {data.study.title}\n\n"
        "Games of two swarms of drones, each led by commands; written by swarm-pz from the recordings of a study.\n\n"
        f"Each condition is a task ({conditions}), each game a run; games of practice are acq-practice. Onsets are "
        "seconds since the beginning of a game. Answers to forms and the commands themselves are in the tables of the "
        "same export.\n"
    )


def _write_json(content: dict[str, Any], path: Path) -> None:
    path.write_text(json.dumps(content, indent=2, ensure_ascii=False) + "\n", encoding="utf-8")


def _write_tsv(rows: Iterable[Iterable[Any]], path: Path) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        csv.writer(file, "excel-tab", lineterminator="\n").writerows([_cell(value) for value in row] for row in rows)


def _cell(value: Any) -> Any:
    if isinstance(value, float):
        return round(value, 6)
    return EMPTY if value is None or value == "" else str(value).lower() if isinstance(value, bool) else value
