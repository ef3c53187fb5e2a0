"""A study's folder as rows of its tables; nothing in it is changed, so a study may be running meanwhile."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

import numpy as np

from swarm_pz.config import TEAM_NAMES, TICKS_PER_SECOND
from swarm_pz.errors import ConfigError, RecordingError
from swarm_pz.files import explain
from swarm_pz.play.commands import CommandReader
from swarm_pz.play.recordings.format import CapturedLine, CommandLine, InForceLine, PaintedLine, Recording
from swarm_pz.play.recordings.seats import SeatRow, seat_rows
from swarm_pz.play.studies.design import Study
from swarm_pz.play.studies.folder import StudyFolder
from swarm_pz.play.studies.forms import Form
from swarm_pz.play.studies.progress import Step, read_lines, steps_of
from swarm_pz.play.studies.rows import CaptureRow, CommandRow, FormRow, GameRow, InterruptedRow, ParticipantRow, Row

_STEP = re.compile(r"block(\d+)\.(practice|game)(\d+)")
_ASIDE = re.compile(rf"(P\d+)\.({_STEP.pattern})\.(\d+)\.jsonl")
_OF_SEATS = sorted(
    {one.name for one in fields(GameRow)} & {one.name for one in fields(SeatRow)} - {"seconds", "outcome"}
)
"""Columns of games that recordings tell, as all tables of them have them."""


@dataclass(frozen=True, kw_only=True)
class StudyData:
    """All rows of a study.

    Attributes
    ----------
    study : Study
    participants, games, interrupted, commands, captures, forms : list
        In the order of the participants' numbers, and of what they did.
    faults : list of str
        What could not be read, or does not fit, and why.
    """

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

    Parameters
    ----------
    folder : Path
        Where the study ran: `study/study.toml`, `participants/`, `games/`.
    progress : callable, optional
        Told how many participants have been read, and how many there are.

    Raises
    ------
    ConfigError
        If no study ran there.
    RecordingError
        If nobody has taken part.
    """
    opened = StudyFolder(folder)
    data = StudyData(study=opened.study)
    known: dict[int, list[dict[str, Any]]] = {}
    for path in sorted((folder / "participants").glob("*.jsonl")):
        try:
            number, lines = _lines_of(path, data.study)
            known[number] = lines
        except (RecordingError, OSError) as error:
            data.faults.append(str(error) if isinstance(error, RecordingError) else explain(error))
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
        places = [match for name in self.done if (match := _STEP.fullmatch(name))]
        practised = Counter(f"block{match[1]}" for match in places if match[2] == "practice")
        self.is_alone = folder.is_alone(number)
        self.steps = steps_of(data.study, number, dict(practised), self.done if self.is_alone else None)

    def read(self) -> None:
        known = {step.id for step in self.steps}
        self.data.faults.extend(
            f"{self.who}: {name} is no step of the study" for name in self.done if name not in known
        )
        due = [step.id for step in self.steps][: len(self.names)]
        if known.issuperset(self.names) and self.names != due:
            wrong = next(name for name, other in zip(self.names, due, strict=False) if name != other)
            self.data.faults.append(f"{self.who}: {wrong} does not stand in its turn, or twice; the last one counts")
        games = [self._game(step) for step in self.steps if step.id in self.done and step.kind in ("game", "practice")]
        for step in self.steps:
            if step.id in self.done and step.form is not None:
                self.data.forms.extend(self._form(step))
        self.data.interrupted.extend(self._interrupted())
        consent = self.done.get("consent", {})
        times = [float(line["at"]) for line in self.done.values() if "at" in line]
        withdrawn = self.number in self.folder.withdrawn
        counted = [game for game in games if not game.practice]
        self.data.participants.append(
            ParticipantRow(
                participant=self.who,
                number=self.number,
                order=" > ".join(condition.title for condition in self.data.study.order_of(self.number)),
                withdrawn=withdrawn,
                finished=all(step.id in self.done for step in self.steps),
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

    # --- games ------------------------------------------------------------------------------------

    def _game(self, step: Step) -> GameRow:
        line, place, condition = self.done[step.id], _STEP.fullmatch(step.id), step.condition
        assert place is not None and condition is not None  # noqa: S101
        side = str(line.get("side", condition.side))
        recording = self._recording(step, line)
        seat = None
        if recording is not None:
            seat = next((row for row in seat_rows(recording) if row.side == side), None)
            self._check(step, line, seat)
            self._commands(step, recording, TEAM_NAMES.index(side))
            self._captures(step, recording, TEAM_NAMES.index(side))
        sizes = recording.config.game.team_sizes if recording is not None else None
        own = TEAM_NAMES.index(side)
        outcome = str(line.get("outcome", seat.outcome if seat is not None else ""))
        told: dict[str, Any] = {name: getattr(seat, name) for name in _OF_SEATS} if seat is not None else {}
        row: dict[str, Any] = {one.name: None if str(one.type).endswith("None") else "" for one in fields(GameRow)}
        if recording is None and self.is_alone and condition.is_of_two:
            told = {"left_out": "partner withdrew", "ended_by": str(line.get("ended_by") or "")}
        row |= told
        row |= {
            "participant": self.who,
            "step": step.id,
            "block": int(place[1]),
            "game": int(place[3]),
            "practice": step.kind == "practice",
            "condition": condition.title,
            "system": str(line.get("system", condition.system)),
            "opponent": str(line.get("opponent", condition.opponent)),
            "side": side,
            "seed": line.get("seed"),
            "outcome": outcome,
            "won": outcome == "win",
            "decided": outcome in ("win", "loss"),
            "seconds": float(line.get("seconds", seat.seconds if seat is not None else 0.0)),
            "at": line.get("at"),
            "recording": str(line.get("recording", "")),
            "drones": sizes[own] if sizes is not None else None,
            "opponent_drones": sizes[1 - own] if sizes is not None else None,
        }
        for name, asked in (("command", condition.command_delay_ms), ("display", condition.display_delay_ms)):
            measured = line.get("delays", {}).get(name, {})
            row[f"{name}_delay_asked_ms"] = float(measured.get("asked_ms", asked))
            row[f"{name}_delay_got_ms"] = measured.get("got_ms")
            row[f"{name}_delay_count"] = measured.get("count")
        self.data.games.append(GameRow(**row))
        return self.data.games[-1]

    def _interrupted(self) -> list[InterruptedRow]:
        """Return the participant's games that were broken off; of a corrupt recording what its name says."""
        rows, order = [], self.data.study.order_of(self.number)
        for path in (self.folder.path / "interrupted").glob("*.jsonl"):
            match = _ASIDE.fullmatch(path.name)
            if match is None or not 0 < int(match[3]) <= len(order):
                continue
            owner, name, block, kind, game, attempt = match.groups()
            condition = order[int(block) - 1]
            step = Step(name, "game" if kind == "game" else "practice", condition, game=int(game) - 1)
            if owner != self.data.study.name_of(self.folder.players(self.number, step)[0]):
                continue
            side, seat = self.folder.side_of(self.number, step), None
            try:
                seat = next((row for row in seat_rows(Recording.read(path)) if row.side == side), None)
            except RecordingError as error:
                self.data.faults.append(f"{self.who}: {name}, broken off: {error}")
            rows.append(
                InterruptedRow(
                    participant=self.who,
                    step=name,
                    attempt=int(attempt),
                    block=int(block),
                    game=int(game),
                    practice=kind == "practice",
                    condition=condition.title,
                    opponent=self.folder.opponent_of(step),
                    side=side,
                    started=seat.started if seat is not None else None,
                    seconds=seat.seconds if seat is not None else None,
                    ended_by=seat.ended_by if seat is not None else None,
                    commands=seat.commands if seat is not None else None,
                    disconnections=seat.disconnections if seat is not None else None,
                    recording=f"interrupted/{path.name}",
                )
            )
        return sorted(rows, key=lambda row: (row.block, not row.practice, row.game, row.attempt))

    def _recording(self, step: Step, line: Mapping[str, Any]) -> Recording | None:
        assert step.condition is not None  # noqa: S101
        try:
            if "recording" not in line:
                raise RecordingError("it has no recording")
            path = (self.folder.path / str(line["recording"])).resolve()
            if not path.is_relative_to(self.folder.path.resolve()):
                raise RecordingError(f"its recording {path} is not in the study's folder")
            if self.is_alone and step.condition.is_of_two and not path.exists():
                return None  # it was deleted with what their partner did
            return Recording.read(path)
        except RecordingError as error:
            self.data.faults.append(f"{self.who}: {step.id}: {error}")
            return None

    def _check(self, step: Step, line: Mapping[str, Any], seat: SeatRow | None) -> None:
        told = seat.outcome if seat is not None else "nothing of that side"
        if line.get("outcome", told) != told:
            self.data.faults.append(
                f"{self.who}: {step.id}: the outcome was {line['outcome']!r}, its recording says {told!r}"
            )

    def _commands(self, step: Step, recording: Recording, own: int) -> None:
        assert step.condition is not None  # noqa: S101
        reader, fates = CommandReader(recording.config.game), _fates(recording)
        for line, command, fate in zip(recording.of(CommandLine), recording.commands, fates, strict=True):
            picture = reader.picture(command)
            self.data.commands.append(
                CommandRow(
                    participant=self.who,
                    step=step.id,
                    condition=step.condition.title,
                    side=TEAM_NAMES[line.team],
                    by="automatic" if line.sender else "participant" if line.team == own else "opponent",
                    number=line.number,
                    kind=command.kind,
                    tick=line.tick,
                    seconds=line.tick / TICKS_PER_SECOND,
                    received_ms=line.received_ms,
                    in_force_tick=fate.tick,
                    to_in_force_ms=fate.in_force_ms - line.received_ms if fate.in_force_ms is not None else None,
                    to_painted_ms=fate.painted_ms - line.received_ms if fate.painted_ms is not None else None,
                    drawing_ms=line.timing.drawing_ms if line.timing is not None else None,
                    strokes=len(line.strokes) if line.strokes is not None else None,
                    centre_x=_centre(picture.sum(axis=0)),
                    centre_y=_centre(picture.sum(axis=1)),
                    values=json.dumps(command.values.tolist(), separators=(",", ":")),
                )
            )

    def _captures(self, step: Step, recording: Recording, own: int) -> None:
        assert step.condition is not None  # noqa: S101
        sizes = list(recording.config.game.team_sizes)
        for line in recording.of(CapturedLine):
            sizes[line.team] += 1
            sizes[1 - line.team] -= 1
            self.data.captures.append(
                CaptureRow(
                    participant=self.who,
                    step=step.id,
                    condition=step.condition.title,
                    tick=line.tick,
                    seconds=line.tick / TICKS_PER_SECOND,
                    drone=line.drone,
                    side=TEAM_NAMES[line.team],
                    by_participant=line.team == own,
                    drones=sizes[own],
                    opponent_drones=sizes[1 - own],
                )
            )

    # --- forms ------------------------------------------------------------------------------------

    def _form(self, step: Step) -> list[FormRow]:
        line, form = self.done[step.id], step.form
        assert form is not None  # noqa: S101
        block = re.match(r"block(\d+)\.", step.id)
        answers, scores = line.get("answers", {}), line.get("scores", {})
        self._check_form(step, form, answers, scores)
        told: list[tuple[str, str, str, Any]] = [
            (item.id, item.kind, item.text, answers.get(item.id)) for item in form.items
        ]
        told += [(name, "score", "", value) for name, value in scores.items()]
        return [
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
            for name, kind, words, answer in told
        ]

    def _check_form(self, step: Step, form: Form, answers: Mapping[str, Any], scores: Mapping[str, float]) -> None:
        try:
            due = form.scores(form.read(answers))
        except ConfigError as error:
            self.data.faults.append(f"{self.who}: {step.id}: {error}")
            return
        if due != scores:
            self.data.faults.append(f"{self.who}: {step.id}: the answers come to {due}, but {scores} stands there")


@dataclass
class _Fate:
    """What became of a command: when it came into force, and when its sender saw so."""

    tick: int | None = None
    in_force_ms: float | None = None
    painted_ms: float | None = None


def _fates(recording: Recording) -> list[_Fate]:
    """Return what became of each command, in order: a client that comes back counts its own from the start again."""
    fates: list[_Fate] = []
    latest: dict[tuple[int, str, int], _Fate] = {}
    for line in recording.events:
        if isinstance(line, CommandLine):
            fates.append(_Fate())
            latest[line.team, line.sender, line.number] = fates[-1]
        elif isinstance(line, InForceLine) and (line.team, line.sender, line.number) in latest:
            fate = latest[line.team, line.sender, line.number]
            fate.tick, fate.in_force_ms = line.tick, line.ms
        elif isinstance(line, PaintedLine) and (line.team, "", line.number) in latest:
            latest[line.team, "", line.number].painted_ms = line.ms
    return fates


def _centre(sums: np.ndarray[Any, Any]) -> float | None:
    """Return the middle of a density's sums along one axis, from 0 to 1; nothing has none."""
    total = float(sums.sum())
    return float(sums @ ((np.arange(len(sums)) + 0.5) / len(sums))) / total if total > 0 else None
