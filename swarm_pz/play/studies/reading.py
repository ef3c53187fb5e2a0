"""A study's folder read into rows of tables; reading changes nothing, so the study may be running."""

from __future__ import annotations

import datetime
import json
import re
from collections.abc import Callable, Mapping
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from swarm_pz.config import TEAM_NAMES, TICKS_PER_SECOND
from swarm_pz.errors import RecordingError
from swarm_pz.play.commands import CommandReader
from swarm_pz.play.protocol import CapturedMessage, SeatCommand
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.recordings.seats import seat_rows
from swarm_pz.play.studies.design import Study
from swarm_pz.play.studies.folder import StudyFolder
from swarm_pz.play.studies.forms import Form
from swarm_pz.play.studies.progress import Progress, Step, items_of, read_lines
from swarm_pz.play.studies.rows import CaptureRow, CommandRow, FormRow, GameRow, ParticipantRow, Row

_OF_LINE = ("system", "opponent", "side", "seed", "outcome", "seconds", "recording")
"""Columns of a game that come from the participant's file."""


@dataclass(frozen=True, kw_only=True)
class StudyData:
    """All rows of a study, by table; `faults` say what could not be read, or does not fit, and why."""

    study: Study
    participants: list[ParticipantRow] = field(default_factory=list)
    games: list[GameRow] = field(default_factory=list)
    commands: list[CommandRow] = field(default_factory=list)
    captures: list[CaptureRow] = field(default_factory=list)
    forms: list[FormRow] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)

    @property
    def remaining(self) -> list[ParticipantRow]:
        """The participants who have not withdrawn."""
        return [one for one in self.participants if not one.withdrawn]

    @property
    def failed(self) -> set[str]:
        """Names of participants who failed a form, and so are in no comparison."""
        return {one.participant for one in self.participants if one.failed}

    @property
    def factor_columns(self) -> dict[str, Callable[[Row], str]]:
        """Functions from a row to its level of a factor, by column; the level is empty if a row has several."""
        orders = {
            one.participant: [condition.title for condition in self.study.order_of(one.number)]
            for one in self.participants
        }

        def column(of: Mapping[str, str]) -> Callable[[Row], str]:
            def level(row: Row) -> str:
                title = getattr(row, "condition", "")
                levels = {of[one] for one in ([title] if title else orders[row.participant])}
                return levels.pop() if len(levels) == 1 else ""

            return level

        return {f"factor_{name}": column(of) for name, of in self.study.factors.items()}


def read_study(folder: Path, progress: Callable[[float, float], None] | None = None) -> StudyData:
    """Read a study's folder; corrupt parts are left out, and named in `faults`.

    `progress` is called with the number of participants read so far, and of all. Raises ConfigError if no study ran
    there, RecordingError if nobody has taken part.
    """
    opened = StudyFolder(folder)
    data = StudyData(study=opened.study)
    numbers = {opened.file_of(number): number for number in range(data.study.participants)}
    known: dict[int, Progress] = {}
    for path in sorted((folder / "participants").glob("*.jsonl")):
        try:
            if path not in numbers:
                raise RecordingError(f"{path} is no participant of {data.study.title!r}")
            if not read_lines(path)[0]:
                raise RecordingError(f"{path} is empty")
            known[numbers[path]] = opened.progress(numbers[path])
        except RecordingError as error:
            data.faults.append(str(error))
    if not known:
        raise RecordingError("\n  ".join([f"nobody has taken part in the study of {folder}", *data.faults]))
    for done, one in enumerate(known.values(), 1):
        _Person(data, opened, one).read()
        if progress is not None:
            progress(done, len(known))
    return data


class _Person:
    """Reads one participant into the tables."""

    def __init__(self, data: StudyData, folder: StudyFolder, progress: Progress) -> None:
        self.data, self.folder, self.progress = data, folder, progress
        self.number, self.done, self.steps = progress.participant, progress.done, progress.steps
        self.participant, self.is_alone = data.study.name_of(self.number), folder.is_alone(self.number)
        self.began = min((line["at"] for line in self.done.values() if "at" in line), default=0.0)

    def read(self) -> None:
        known = {step.id for step in self.steps}
        for name in self.done.keys() - known:
            self._fault(name, "is no step of the study", "")
        steps = [step for step in self.steps if step.id in self.done]
        asked = [(step, step.form) for step in steps if step.form is not None]
        missed = [one for one in asked if not self.done[one[0].id].get("passed", True)]
        failed = [form.name for step, form in missed if step.attempt == form.tries]
        for step in steps:
            if step.is_game:
                self._game(step)
        for step, form in asked:
            self._form(step, form)
        self.data.participants.append(
            ParticipantRow(
                participant=self.participant,
                number=self.number,
                order=" > ".join(condition.title for condition in self.data.study.order_of(self.number)),
                withdrawn=self.number in self.folder.withdrawn,
                finished=len(steps) == len(self.steps) and not self.progress.has_ended_early,
                stopped="stop" in self.done,
                failed=", ".join(dict.fromkeys(failed)),
                consent_day=_day(self.done.get("consent", {}).get("at")),
            )
        )

    def _after(self, step: str) -> float | None:
        """Return the seconds from the first finished step to this one: a time of day could identify the person."""
        at = self.done[step].get("at")
        return None if at is None else float(round(at - self.began))

    def _fault(self, step: str, fault: object, colon: str = ":") -> None:
        self.data.faults.append(f"{self.participant}: {step}{colon} {fault}")

    # --- games ------------------------------------------------------------------------------------

    def _key(self, step: Step) -> dict[str, Any]:
        """Return the columns that identify a step."""
        title = step.condition.title if step.condition is not None else ""
        return {"participant": self.participant, "step": step.id, "condition": title}

    def _game(self, step: Step) -> None:
        condition = step.played
        line = {name: getattr(condition, name) for name in ("system", "opponent", "side")}
        line |= {"seed": None, "outcome": "", "seconds": 0.0, "recording": ""} | self.done[step.id]
        columns: dict[str, Any] = {name: line[name] for name in _OF_LINE} | {"after_s": self._after(step.id)}
        columns["seconds"] = round(line["seconds"], 6)  # as published, so that others compute the same
        own = TEAM_NAMES.index(line["side"])
        recording = self._recording(step, line["recording"])
        if recording is not None:
            seat = next((row for row in seat_rows(recording) if row.side == line["side"]), None)
            sizes = recording.config.game.team_sizes
            names = [one.name for one in fields(GameRow) if one.default is not MISSING]
            columns |= {name: getattr(seat, name) for name in names if hasattr(seat, name)}
            columns |= {"drones": sizes[own], "opponent_drones": sizes[1 - own]}
            self._commands(step, recording, own)
            self._captures(step, recording, own)
        elif self.is_alone and condition.is_of_two:
            columns |= {"left_out": "partner withdrew", "ended_by": line.get("ended_by") or ""}
        for name, asked_ms in (("command", condition.command_delay_ms), ("display", condition.display_delay_ms)):
            measured = {"asked_ms": asked_ms, "got_ms": None, "count": None} | line.get("delays", {}).get(name, {})
            columns |= {f"{name}_delay_{column}": measured[column] for column in ("got_ms", "count")}
            columns[f"{name}_delay_asked_ms"] = float(measured["asked_ms"])
        row = GameRow(
            **self._key(step),
            block=int(step.id.removeprefix("block").partition(".")[0]),
            game=step.game + 1,
            practice=step.kind == "practice",
            won=line["outcome"] == "win",
            decided=line["outcome"] in ("win", "loss"),
            **columns,
        )
        self.data.games.append(row)

    def _recording(self, step: Step, name: str) -> Recording | None:
        try:
            path = (self.folder.path / name).resolve()
            if not name:
                raise RecordingError("it has no recording")
            if not path.is_relative_to(self.folder.path.resolve()):
                raise RecordingError(f"its recording {path} is not in the study's folder")
            if self.is_alone and step.played.is_of_two and not path.exists():
                return None  # it was deleted when their partner withdrew
            recording = Recording.read(path)
            recording.in_force()  # which raises if its commands are corrupt
            return recording
        except RecordingError as error:
            self._fault(step.id, error)
            return None

    def _commands(self, step: Step, recording: Recording, own: int) -> None:
        reader = CommandReader(recording.config.game)
        ticks = {id(command): tick for tick, command in recording.in_force()}  # clients that come back reuse numbers
        for line, command in zip(recording.of(SeatCommand), recording.commands, strict=True):
            picture = reader.picture(command)
            row = CommandRow(
                **self._key(step),
                side=TEAM_NAMES[line.team],
                by="shared" if line.sender else "participant" if line.team == own else "opponent",
                number=line.number,
                kind=command.kind,
                tick=line.tick,
                seconds=line.tick / TICKS_PER_SECOND,
                in_force_tick=ticks.get(id(command)),
                drawing_ms=line.timing.drawing_ms if line.timing is not None else None,
                strokes=len(line.strokes) if line.strokes is not None else None,
                centre_x=_centre(picture.sum(axis=0)),
                centre_y=_centre(picture.sum(axis=1)),
                values=json.dumps(command.values.tolist(), separators=(",", ":")),
            )
            self.data.commands.append(row)

    def _captures(self, step: Step, recording: Recording, own: int) -> None:
        sizes = list(recording.config.game.team_sizes)
        for line in recording.of(CapturedMessage):
            sizes[line.team] += 1
            sizes[1 - line.team] -= 1
            row = CaptureRow(
                **self._key(step),
                tick=line.tick,
                seconds=line.tick / TICKS_PER_SECOND,
                drone=line.drone,
                side=TEAM_NAMES[line.team],
                by_participant=line.team == own,
                drones=sizes[own],
                opponent_drones=sizes[1 - own],
            )
            self.data.captures.append(row)

    # --- forms ------------------------------------------------------------------------------------

    def _form(self, step: Step, form: Form) -> None:
        line = self.done[step.id]
        answers, scores = line.get("answers", {}), line.get("scores", {})
        block = re.match(r"block(\d+)\.", step.id)
        rows: list[tuple[Any, ...]] = [
            (item.id, item.kind, item.text, place, item.correct, answers.get(item.id))
            for place, item in enumerate(items_of(self.data.study, self.number, step), 1)
        ]
        rows += [(name, "score", "", None, None, value) for name, value in scores.items()]
        for name, kind, words, place, right, answer in rows:
            self.data.forms.append(
                FormRow(
                    **self._key(step),
                    block=int(block[1]) if block is not None else None,
                    form=form.name,
                    item=name,
                    kind=kind,
                    question=words,
                    place=place,
                    answer=None if answer is None else str(answer),
                    value=float(answer) if isinstance(answer, int | float) else None,
                    correct=None if right is None else answer == right,
                    after_s=self._after(step.id),
                )
            )


def _day(at: float | None) -> str:
    """Return the day of a time in UTC."""
    return "" if at is None else datetime.datetime.fromtimestamp(at, datetime.UTC).date().isoformat()


def _centre(sums: np.ndarray[Any, Any]) -> float | None:
    """Return the centre of a density from its sums along one axis, from 0 to 1; None if all are 0."""
    total = float(sums.sum())
    return float(sums @ ((np.arange(len(sums)) + 0.5) / len(sums))) / total if total > 0 else None
