"""A study's folder as rows of its tables; nothing in it is changed, so a study may be running meanwhile."""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Callable, Sequence
from dataclasses import MISSING, dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from swarm_pz.config import TEAM_NAMES, TICKS_PER_SECOND
from swarm_pz.errors import ConfigError, RecordingError
from swarm_pz.play.commands import CommandReader
from swarm_pz.play.protocol import CapturedMessage, InForceMessage, SeatCommand, SeatPainted
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.recordings.seats import SeatRow, seat_rows
from swarm_pz.play.studies.design import Study
from swarm_pz.play.studies.folder import StudyFolder
from swarm_pz.play.studies.progress import Step, read_lines, steps_of
from swarm_pz.play.studies.rows import CaptureRow, CommandRow, FormRow, GameRow, InterruptedRow, ParticipantRow, Row

_STEP = re.compile(r"block(\d+)\.(practice|game)(\d+)")
_ASIDE = re.compile(rf"(P\d+)\.({_STEP.pattern})\.(\d+)\.jsonl")
_TOLD = ("system", "opponent", "side", "seed", "outcome", "seconds", "at", "recording")
"""Columns of a game that its participant's line tells."""


@dataclass(frozen=True, kw_only=True)
class StudyData:
    """All rows of a study, by table; `faults` say what could not be read, or does not fit, and why."""

    study: Study
    participants: list[ParticipantRow] = field(default_factory=list)
    games: list[GameRow] = field(default_factory=list)
    interrupted: list[InterruptedRow] = field(default_factory=list)
    commands: list[CommandRow] = field(default_factory=list)
    captures: list[CaptureRow] = field(default_factory=list)
    forms: list[FormRow] = field(default_factory=list)
    faults: list[str] = field(default_factory=list)

    @property
    def remaining(self) -> list[ParticipantRow]:
        """The participants who have not withdrawn."""
        return [one for one in self.participants if not one.withdrawn]

    def table(self, name: str) -> list[Row]:
        """Return the rows of a table."""
        return list(getattr(self, name))


def read_study(folder: Path, progress: Callable[[float, float], None] | None = None) -> StudyData:
    """Return all that a study's folder holds; what of it is corrupt is left out, and told.

    `progress` is called with the numbers of participants that were read, and of all. ConfigError if no study ran there,
    RecordingError if nobody has taken part.
    """
    opened = StudyFolder(folder)
    data = StudyData(study=opened.study)
    known: dict[int, list[dict[str, Any]]] = {}
    for path in sorted((folder / "participants").glob("*.jsonl")):
        try:
            number, lines = _lines_of(path, data.study)
            known[number] = lines
        except RecordingError as error:
            data.faults.append(str(error))
    if not known:
        raise RecordingError("\n  ".join([f"nobody has taken part in the study of {folder}", *data.faults]))
    for done, (number, lines) in enumerate(sorted(known.items()), 1):
        _Person(data, opened, number, lines).read()
        if progress is not None:
            progress(done, len(known))
    return data


def _lines_of(path: Path, study: Study) -> tuple[int, list[dict[str, Any]]]:
    """Return a participant's number and steps."""
    lines, _ = read_lines(path)
    if not lines:
        raise RecordingError(f"{path} is empty")
    number: Any = lines[0].get("number")
    is_number = type(number) is int and number >= 0
    if lines[0].get("study") != study.title or not is_number or path.stem != study.name_of(number):
        raise RecordingError(f"{path} is no participant of {study.title!r}: its first line is {lines[0]}")
    return number, lines[1:]


class _Person:
    """One participant, on the way into the tables."""

    def __init__(self, data: StudyData, folder: StudyFolder, number: int, lines: Sequence[dict[str, Any]]) -> None:
        self.data, self.folder, self.number, self.who = data, folder, number, data.study.name_of(number)
        self.names = [str(line["step"]) for line in lines]
        self.done = dict(zip(self.names, lines, strict=True))
        self.is_alone = folder.is_alone(number)
        self.steps = steps_of(data.study, number, self.done, is_alone=self.is_alone)

    def read(self) -> None:
        known = [step.id for step in self.steps]
        strange = [name for name in self.done if name not in known]
        for name in strange:
            self._fault(name, "is no step of the study", "")
        due = known[: len(self.names)]
        wrong = next((name for name, other in itertools.zip_longest(self.names, due) if name != other), None)
        if not strange and wrong is not None:
            self._fault(wrong, "does not stand in its turn, or twice; the last one counts", "")
        steps = [step for step in self.steps if step.id in self.done]
        games = [self._game(step) for step in steps if step.is_game]
        for step in steps:
            self._form(step)
        self._interrupted()
        consent = self.done.get("consent", {})
        times = [float(line["at"]) for line in self.done.values() if "at" in line]
        counted = [game for game in games if not game.practice]
        withdrawn = self.number in self.folder.withdrawn
        self.data.participants.append(
            ParticipantRow(
                participant=self.who,
                number=self.number,
                order=" > ".join(condition.title for condition in self.data.study.order_of(self.number)),
                withdrawn=withdrawn,
                finished=len(steps) == len(self.steps),
                consent_version=consent.get("consent_version"),
                consent_at=consent.get("at"),
                consent_sha256=consent.get("consent_sha256"),
                steps=None if withdrawn else len(self.done),
                games=None if withdrawn else len(counted),
                practice_games=None if withdrawn else len(games) - len(counted),
                wins=None if withdrawn else sum(game.won for game in counted),
                began_at=min(times, default=None),
                ended_at=max(times, default=None),
            )
        )

    def _fault(self, step: str, fault: object, colon: str = ":") -> None:
        self.data.faults.append(f"{self.who}: {step}{colon} {fault}")

    # --- games ------------------------------------------------------------------------------------

    def _place(self, step: Step) -> dict[str, Any]:
        """Return the columns by which a game is found."""
        block = step.id.removeprefix("block").partition(".")[0]
        return {
            "participant": self.who,
            "step": step.id,
            "block": int(block),
            "game": step.game + 1,
            "practice": step.kind == "practice",
            "condition": step.played.title,
        }

    def _game(self, step: Step) -> GameRow:
        condition = step.played
        line = {name: getattr(condition, name) for name in ("system", "opponent", "side")}
        line |= {"seed": None, "outcome": "", "seconds": 0.0, "at": None, "recording": ""} | self.done[step.id]
        told: dict[str, Any] = {name: line[name] for name in _TOLD}
        own = TEAM_NAMES.index(line["side"])
        recording = self._recording(step, line["recording"])
        if recording is not None:
            seat = _seat_of(recording, line["side"])
            ended = seat.outcome if seat is not None else "nothing of that side"
            if line["outcome"] not in ("", ended):
                self._fault(step.id, f"the outcome was {line['outcome']!r}, its recording says {ended!r}")
            sizes = recording.config.game.team_sizes
            told |= _told_by(seat, GameRow) | {"drones": sizes[own], "opponent_drones": sizes[1 - own]}
            self._commands(step, recording, own)
            self._captures(step, recording, own)
        elif self.is_alone and condition.is_of_two:
            told |= {"left_out": "partner withdrew", "ended_by": line.get("ended_by") or ""}
        for name, asked in (("command", condition.command_delay_ms), ("display", condition.display_delay_ms)):
            measured = {"asked_ms": asked, "got_ms": None, "count": None} | line.get("delays", {}).get(name, {})
            told |= {f"{name}_delay_{column}": measured[column] for column in ("got_ms", "count")}
            told[f"{name}_delay_asked_ms"] = float(measured["asked_ms"])
        row = GameRow(
            **self._place(step), won=line["outcome"] == "win", decided=line["outcome"] in ("win", "loss"), **told
        )
        self.data.games.append(row)
        return row

    def _interrupted(self) -> None:
        """Read the participant's games that were broken off; of a corrupt recording what its name says."""
        rows, order = [], self.data.study.order_of(self.number)
        for path in (self.folder.path / "interrupted").glob("*.jsonl"):
            match = _ASIDE.fullmatch(path.name)
            if match is None or not 0 < int(match[3]) <= len(order):
                continue
            owner, name, block, kind, game, attempt = match.groups()
            step = Step(name, "practice" if kind == "practice" else "game", order[int(block) - 1], game=int(game) - 1)
            if owner != self.data.study.name_of(self.folder.players(self.number, step)[0]):
                continue
            recording, side = None, self.folder.side_of(self.number, step)
            try:
                recording = Recording.read(path)
            except RecordingError as error:
                self._fault(name, error, ", broken off:")
            row = InterruptedRow(
                **self._place(step),
                attempt=int(attempt),
                opponent=self.folder.opponent_of(step),
                side=side,
                recording=f"interrupted/{path.name}",
                **_told_by(_seat_of(recording, side), InterruptedRow),
            )
            rows.append(row)
        self.data.interrupted.extend(sorted(rows, key=lambda row: (row.block, not row.practice, row.game, row.attempt)))

    def _recording(self, step: Step, name: str) -> Recording | None:
        try:
            path = (self.folder.path / name).resolve()
            if not name:
                raise RecordingError("it has no recording")
            if not path.is_relative_to(self.folder.path.resolve()):
                raise RecordingError(f"its recording {path} is not in the study's folder")
            if self.is_alone and step.played.is_of_two and not path.exists():
                return None  # it was deleted with what their partner did
            return Recording.read(path)
        except RecordingError as error:
            self._fault(step.id, error)
            return None

    def _commands(self, step: Step, recording: Recording, own: int) -> None:
        reader, fates = CommandReader(recording.config.game), _fates(recording)
        for line, command, fate in zip(recording.of(SeatCommand), recording.commands, fates, strict=True):
            picture = reader.picture(command)
            row = CommandRow(
                participant=self.who,
                step=step.id,
                condition=step.played.title,
                side=TEAM_NAMES[line.team],
                by="automatic" if line.sender else "participant" if line.team == own else "opponent",
                number=line.number,
                kind=command.kind,
                tick=line.tick,
                seconds=line.tick / TICKS_PER_SECOND,
                received_ms=1000.0 * recording.since_began_s(line.server_ms),
                in_force_tick=int(fate["tick"]) if "tick" in fate else None,
                to_in_force_ms=fate["in_force_ms"] - line.server_ms if "in_force_ms" in fate else None,
                to_painted_ms=fate["painted_ms"] - line.server_ms if "painted_ms" in fate else None,
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
                participant=self.who,
                step=step.id,
                condition=step.played.title,
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

    def _form(self, step: Step) -> None:
        line, form = self.done[step.id], step.form
        if form is None:
            return
        answers, scores = line.get("answers", {}), line.get("scores", {})
        try:
            due = form.scores(form.read(answers))
            if due != scores:
                self._fault(step.id, f"the answers come to {due}, but {scores} stands there")
        except ConfigError as error:
            self._fault(step.id, error)
        block = re.match(r"block(\d+)\.", step.id)
        told = [(item.id, item.kind, item.text, answers.get(item.id)) for item in form.items]
        for name, kind, words, answer in [*told, *((name, "score", "", value) for name, value in scores.items())]:
            self.data.forms.append(
                FormRow(
                    participant=self.who,
                    step=step.id,
                    block=int(block[1]) if block is not None else None,
                    condition=step.condition.title if step.condition is not None else "",
                    form=form.name,
                    item=name,
                    kind=kind,
                    question=words,
                    answer=None if answer is None else str(answer),
                    value=float(answer) if isinstance(answer, int | float) else None,
                    at=line.get("at"),
                )
            )


def _seat_of(recording: Recording | None, side: str) -> SeatRow | None:
    rows = seat_rows(recording) if recording is not None else []
    return next((row for row in rows if row.side == side), None)


def _told_by(seat: SeatRow | None, kind: type[GameRow | InterruptedRow]) -> dict[str, Any]:
    """Return those columns of a game that its recording tells."""
    names = [one.name for one in fields(kind) if one.default is not MISSING]
    return {name: getattr(seat, name) for name in names if hasattr(seat, name)}


def _fates(recording: Recording) -> list[dict[str, float]]:
    """Return the fate of each command, in order. A client that comes back numbers its commands anew."""
    fates: list[dict[str, float]] = []
    latest: dict[tuple[int, str, int], dict[str, float]] = {}
    for line in recording.log:
        if isinstance(line, SeatCommand):
            fates.append({})
            latest[line.team, line.sender, line.number] = fates[-1]
        elif isinstance(line, InForceMessage):
            latest.get((line.team, line.sender, line.number), {}).update(tick=line.tick, in_force_ms=line.server_ms)
        elif isinstance(line, SeatPainted):
            latest.get((line.team, "", line.number), {}).update(painted_ms=line.painted_ms)
    return fates


def _centre(sums: np.ndarray[Any, Any]) -> float | None:
    """Return the middle of a density's sums along one axis, from 0 to 1; nothing has none."""
    total = float(sums.sum())
    return float(sums @ ((np.arange(len(sums)) + 0.5) / len(sums))) / total if total > 0 else None
