"""Withdrawal of a participant: their data are deleted.

The data are in their own file and in recordings. First a note of the withdrawal replaces their file, in one step. So if
the program is stopped midway, no step of theirs is published, and the next call deletes the rest. A recording of a game
of two shows both participants, and is deleted; the result of the game stays in the partner's file.
"""

from __future__ import annotations

import contextlib
import json
import time
from pathlib import Path

from swarm_pz.errors import ConfigError, OutputError, RecordingError, ResultsError
from swarm_pz.files import draft_of, explain
from swarm_pz.play.recordings.recorder import sync_folder
from swarm_pz.play.studies.folder import StudyFolder, write_down
from swarm_pz.play.studies.progress import first_line


def withdraw(path: Path, code: str) -> tuple[str, int]:
    """Delete a participant's data, and return their name and the number of deleted recordings.

    Raises ConfigError if no study ran there, nobody has the code, or their data are deleted already; OutputError if a
    server runs the study, or a file cannot be deleted.
    """
    try:
        opened = StudyFolder(path, only_read=False)
    except ResultsError as error:
        raise OutputError(
            f"{path} is being served, so the participant may be in session: withdraw on their page (Stop), or end the "
            "server (Ctrl-C), call this again, and start the server again; everybody goes on where they were"
        ) from error
    with contextlib.closing(opened):
        number = opened.number_of(code)
        name = opened.study.name_of(number)
        if number in opened.withdrawn and not _recordings(opened, number):
            raise ConfigError(f"{name}, who had the code {code}, has withdrawn already: nothing of theirs is left")
        return name, delete(opened, number)


def delete(opened: StudyFolder, number: int) -> int:
    """Delete the data of a participant, who must not be in a game, and return the number of deleted recordings.

    Raises OutputError if a file cannot be deleted.
    """
    try:
        if number not in opened.withdrawn:
            _settle_partner(opened, number)
            line, file = first_line(opened.study, number) | {"withdrawn": time.time()}, opened.file_of(number)
            with draft_of(file) as draft:
                write_down(draft, json.dumps(line).encode() + b"\n")
            sync_folder(file.parent)
            opened.withdrawn.add(number)
        left = _recordings(opened, number)  # the partner's game may have been set aside
        for file in left:
            file.unlink()
        for folder in {file.parent for file in left}:
            sync_folder(folder)
    except OSError as error:
        name = opened.study.name_of(number)
        raise OutputError(
            f"not all of {name} is deleted: {explain(error)}; call this again when that is mended"
        ) from error
    return len(left)


def _recordings(opened: StudyFolder, number: int) -> list[Path]:
    """Return the recordings that show a participant, of finished and interrupted games."""
    study = opened.study
    patterns = [f"{study.name_of(number)}.*.jsonl"]
    if study.is_of_pairs and number % 2:  # recordings of two have the first one's name
        blocks = [block for block, one in enumerate(study.order_of(number), 1) if one.is_of_two]
        patterns += [f"{study.name_of(number - 1)}.block{block}.game*.jsonl" for block in blocks]
    folders = [opened.path / name for name in ("games", "interrupted")]
    return sorted(file for folder in folders for pattern in patterns for file in folder.glob(pattern))


def _settle_partner(opened: StudyFolder, number: int) -> None:
    """Save the result of a game of two for the partner, if only its recording has it."""
    partner = number ^ 1
    if opened.study.is_of_pairs and partner not in opened.withdrawn and opened.has_come(partner):
        with contextlib.suppress(RecordingError):  # a corrupt file is kept as it is
            step = opened.progress(partner).next
            if step is not None and number in opened.players(partner, step):  # they may be in a game of their own
                opened.settle(partner)
