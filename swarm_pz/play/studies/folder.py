"""The folder of a running study: its files, its participants' progress, and their games.

====================================  ================================================================
`study/`                              its file and texts, as they were when it began
`codes.txt`                           a line for each participant: name and code
`participants/NAME.jsonl`             what a participant has done; see `progress`
`games/NAME.STEP.jsonl`               the recording of each game; of a game of two, with the first one's name
`interrupted/NAME.STEP.N.jsonl`       recordings of interrupted games, which are played again
====================================  ================================================================

All that others may see has names, such as P01; codes, which open participants' sessions, are kept out of it.
"""

from __future__ import annotations

import contextlib
import functools
import json
import os
import re
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

from swarm_pz.config import TEAM_NAMES, TICKS_PER_SECOND
from swarm_pz.errors import ConfigError, OutputError, RecordingError
from swarm_pz.evaluation.ledger import folder_lock
from swarm_pz.files import check_folder, draft_of, explain, read_text
from swarm_pz.play.recordings.folder import read_ends
from swarm_pz.play.recordings.recorder import sync_folder
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.recordings.seats import outcome_of
from swarm_pz.play.studies.design import Study, check_code, draw_codes
from swarm_pz.play.studies.progress import Progress, Step

FROZEN, FILE, CODES = "study", "study.toml", "codes.txt"
_GAME = re.compile(r"block\d+\.game\d+")


class StudyFolder:
    """A study that runs, or ran, in an existing folder; `begin` makes a new one.

    With `only_read` nothing is written, since a server may be using the folder. `codes` are the participants' codes, by
    number; `withdrawn` has the numbers of participants who have withdrawn. Raises ConfigError if there is no study, or
    its codes cannot be read; ResultsError if another program writes there.
    """

    def __init__(self, path: Path, *, only_read: bool = True) -> None:
        file = path / FROZEN / FILE
        if not file.is_file():
            raise ConfigError(f"no study has run in {path}: expected the file {file}; begin one by study run")
        self.path, self.study = path, Study.read(file)
        self.codes = _read_codes(path / CODES, self.study)
        self._numbers = {code.upper(): number for number, code in enumerate(self.codes)}
        self._only_read = only_read
        self._progress: dict[int, Progress] = {}
        self._reading = threading.Lock()
        self._lock = contextlib.ExitStack()
        if not only_read:
            self._lock.enter_context(folder_lock(path))
        self.withdrawn = {number for number in range(self.study.participants) if self._has_withdrawn(number)}

    @classmethod
    def begin(cls, file: Path, path: Path) -> StudyFolder:
        """Begin a study in a folder, or continue it.

        Raises ConfigError if the file is no study, or the folder holds another one; OutputError if the folder cannot
        be written to.
        """
        study, frozen = Study.read(file), path / FROZEN
        files = [(file, FILE), *((study.folder / name, name) for name in study.texts)]
        check_folder(path)
        if not frozen.exists():
            _keep_codes(study, path / CODES)
            with folder_draft(frozen) as draft:
                for source, name in files:
                    copy = draft / name
                    copy.parent.mkdir(parents=True, exist_ok=True)
                    write_down(copy, source.read_bytes())
        for source, name in files:
            kept = frozen / name
            if not kept.is_file() or kept.read_bytes() != source.read_bytes():
                raise ConfigError(
                    f"{path} holds a study that began with another {name} than {source}: what was asked of some must "
                    f"be asked of all. Give another --folder; or run {frozen / FILE}, as it began"
                )
        for name in ("participants", "games", "interrupted"):
            check_folder(path / name)
        return cls(path, only_read=False)

    def close(self) -> None:
        """Release the folder for another server."""
        self._lock.close()

    # --- participants -----------------------------------------------------------------------------

    def number_of(self, code: str) -> int:
        """Return the number of the participant with a code, in upper or lower case.

        Raises ConfigError if nobody has it.
        """
        number = self._numbers.get(check_code(code).upper())
        if number is None:
            raise ConfigError(f"nobody in this study has the code {code}: compare it with the study's {CODES}")
        return number

    def file_of(self, number: int) -> Path:
        """Return the file of a participant's progress."""
        return self.path / "participants" / f"{self.study.name_of(number)}.jsonl"

    def progress(self, number: int) -> Progress:
        """Return a participant's progress; their file is created when they first come.

        Raises RecordingError if the file is corrupt, or cannot be used.
        """
        with self._reading:  # threads share `_progress`
            if number not in self._progress:
                path = self.file_of(number)
                try:
                    is_alone = functools.partial(self.is_alone, number)
                    self._progress[number] = Progress(
                        self.study, path, number, only_read=self._only_read, is_alone=is_alone
                    )
                    sync_folder(path.parent)
                except OSError as error:
                    raise RecordingError(f"{path} cannot be used: {explain(error)}") from error
            return self._progress[number]

    def has_come(self, number: int) -> bool:
        """Return True if a participant has ever come."""
        return self.file_of(number).exists()

    def _has_withdrawn(self, number: int) -> bool:
        try:
            first = json.loads(read_ends(self.file_of(number), 4096)[0].split(b"\n")[0])
        except (RecordingError, ValueError, RecursionError):
            return False
        return isinstance(first, dict) and "withdrawn" in first

    def is_alone(self, number: int) -> bool:
        """Return True if a participant's partner has withdrawn, stopped, or failed a form that ends the study."""
        if not self.study.is_of_pairs or number ^ 1 in self.withdrawn:
            return self.study.is_of_pairs
        try:
            last = read_ends(self.file_of(number ^ 1), 4096)[1]
        except RecordingError:
            return False
        return b'"step": "stop"' in last or b'"ends": true' in last

    def summary(self, number: int) -> dict[str, Any]:
        """Return a participant's progress, for the monitor."""
        order = [one.title for one in self.study.order_of(number)]
        row = {"name": self.study.name_of(number), "order": order, "block": "", "played": 0, "won": 0}
        row |= {"done": 0, "of": 0}
        if number in self.withdrawn or not self.has_come(number):
            return row | {"step": "withdrawn" if number in self.withdrawn else "has not come"}
        try:
            progress = self.progress(number)
        except RecordingError as error:
            return row | {"step": "corrupt", "fault": str(error)}
        step, games = progress.next, [line for name, line in progress.done.items() if _GAME.fullmatch(name)]
        return row | {
            "step": step.id if step is not None else "stopped" if progress.has_ended_early else "all done",
            "block": step.condition.title if step is not None and step.condition is not None else "",
            "played": len(games),
            "won": sum(line.get("won") is True for line in games),
            "done": len(progress.done),
            "of": len(progress.steps),
        }

    # --- games ------------------------------------------------------------------------------------

    def players(self, number: int, step: Step) -> tuple[int, ...]:
        """Return the participants of a game; the first has the condition's side, the second the other one."""
        is_of_two = step.kind == "game" and step.played.is_of_two
        return (number // 2 * 2, number // 2 * 2 + 1) if is_of_two else (number,)

    def side_of(self, number: int, step: Step) -> str:
        """Return the side of a participant in a game."""
        first = TEAM_NAMES.index(step.played.side)
        return TEAM_NAMES[first if number == self.players(number, step)[0] else 1 - first]

    def recording(self, number: int, step: Step) -> Path:
        """Return the file of a game."""
        return self.path / "games" / f"{self.study.name_of(self.players(number, step)[0])}.{step.id}.jsonl"

    def seed_of(self, step: Step) -> int:
        """Return the seed of a game."""
        return self.study.seed_of(step.game, practice=step.kind == "practice")

    def opponent_of(self, step: Step) -> str:
        """Return the opponent of a participant in a game."""
        return self.study.practice.opponent if step.kind == "practice" else step.played.opponent

    def line_of(self, number: int, step: Step) -> dict[str, Any] | None:
        """Return the record of a finished game from its recording, or None if it was not played to its end."""
        path, own = self.recording(number, step), self.side_of(number, step)
        try:
            end = Recording.read(path).end
        except RecordingError:
            return None
        if end is None or end.outcome == "stopped":
            return None
        delays = {} if end.delays is None else {"delays": msgspec.to_builtins(end.delays[TEAM_NAMES.index(own)])}
        return {
            "condition": step.played.title,
            "system": step.played.system,
            "opponent": self.opponent_of(step),
            "side": own,
            "seed": self.seed_of(step),
            "outcome": outcome_of(end, own),
            "won": end.outcome == own,
            "seconds": end.tick / TICKS_PER_SECOND,
            "ended_by": end.ended_by,
            "recording": f"games/{path.name}",
            **delays,
        }

    def settle(self, number: int) -> None:
        """Recover after the program ended in the middle of a game.

        A finished game gets its missing line; an unfinished recording is set aside, and its game is played again.

        Raises RecordingError if the participant's file is corrupt.
        """
        progress = self.progress(number)
        while (step := progress.next) is not None and step.is_game:
            path = self.recording(number, step)
            if not path.exists():
                return
            line = self.line_of(number, step)
            if line is None:
                self._set_aside(path)
                return
            progress.finish(step, **line)

    def was_broken_off(self, number: int, step: Step) -> bool:
        """Return True if a participant's game was begun before and interrupted."""
        return (self.path / "interrupted" / f"{self.recording(number, step).stem}.1.jsonl").exists()

    def _set_aside(self, path: Path) -> None:
        """Move the recording of an interrupted game from `games` to `interrupted`."""
        aside, count = self.path / "interrupted", 1
        while (goal := aside / f"{path.stem}.{count}.jsonl").exists():
            count += 1
        path.rename(goal)
        sync_folder(aside)
        sync_folder(path.parent)


def _keep_codes(study: Study, path: Path) -> None:
    """Write the study's codes, or random ones if it has none, into a file that no other user can read."""
    codes = study.codes or draw_codes(study.participants)
    lines = [f"{study.name_of(number)} {code}\n" for number, code in enumerate(codes)]
    try:
        with draft_of(path) as draft:
            write_down(draft, "".join(lines).encode(), mode=0o600)
    except OSError as error:
        raise OutputError(f"the codes cannot be kept in {path}: {explain(error)}") from error


def _read_codes(path: Path, study: Study) -> tuple[str, ...]:
    where = f"the codes of the study, {path}"
    try:
        words = read_text(path).split()
        names, codes = words[::2], words[1::2]
        if names == [study.name_of(number) for number in range(study.participants)] and len(codes) == len(names):
            return tuple(check_code(code) for code in codes)
    except ConfigError as error:
        raise ConfigError(f"{where}: {error}") from error
    expected = f"{study.participants} lines, each with a participant's name and code"
    raise ConfigError(f"{where}: expected {expected}, got something else; restore the file")


def write_down(path: Path, data: bytes, mode: int = 0o666) -> None:
    """Write a file, and sync it to the disk."""
    with open(path, "wb", opener=lambda name, flags: os.open(name, flags, mode)) as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


@contextlib.contextmanager
def folder_draft(path: Path) -> Iterator[Path]:
    """Yield a draft beside a folder, which replaces it at the end of the block, or is deleted if the block fails.

    Raises OutputError if something cannot be written.
    """
    draft = path.with_name(f".{path.name}.draft")
    try:
        shutil.rmtree(draft, ignore_errors=True)
        draft.mkdir()  # fails if a link is there: it may lead elsewhere
        yield draft
        if path.exists():
            shutil.rmtree(path)
        draft.rename(path)
        sync_folder(path.parent)
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"{str(path)!r} cannot be written: {explain(error)}") from error
    finally:
        shutil.rmtree(draft, ignore_errors=True)
