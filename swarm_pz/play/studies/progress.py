"""Progress of a participant: a file with a line for each finished step, written before the next step is shown.

The study and the participant's number determine the steps. So after a reload, a crash or a power cut the participant
continues with the first step that has no line, and no step is asked twice.
"""

from __future__ import annotations

import errno
import json
import os
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec

from swarm_pz.errors import ConfigError, OutputError, ProtocolError, RecordingError
from swarm_pz.files import explain
from swarm_pz.play.protocol import decode
from swarm_pz.play.recordings.folder import read_regular
from swarm_pz.play.studies.design import Condition, Study
from swarm_pz.play.studies.forms import Form, Item

StepKind = Literal["consent", "form", "text", "practice", "game", "break", "stop"]
_Moment = Annotated[float, msgspec.Meta(ge=0.0, le=1e12)]


class _Line(msgspec.Struct):
    """A line about a finished step. Lines are checked once, when they are read."""

    step: str
    at: _Moment = 0.0
    answers: dict[str, str | int | float | None] = {}
    scores: dict[str, float] = {}
    passed: bool = True
    ends: bool = False
    condition: str = ""
    system: str = ""
    opponent: str = ""
    side: Literal["red", "blue"] = "red"
    seed: int = 0
    outcome: Literal["win", "draw", "loss"] = "draw"
    won: bool = False
    seconds: _Moment = 0.0
    ended_by: str | None = None
    recording: str = ""
    delays: dict[str, dict[str, float | None]] = {}


_decoder = msgspec.json.Decoder(dict[str, Any])


@dataclass(frozen=True)
class Step:
    """One step of a participant.

    `id` is its name among the participant's steps; `condition` is that of its block; `text` is the name of a text;
    `game` is the number of a game in its block, from 0; `attempt` counts the attempts at a form, from 1.
    """

    id: str
    kind: StepKind
    condition: Condition | None = None
    form: Form | None = None
    text: str = ""
    game: int = 0
    attempt: int = 1

    @property
    def is_game(self) -> bool:
        """True if it is a game, practice included."""
        return self.kind in ("practice", "game")

    @property
    def played(self) -> Condition:
        """The condition of a game."""
        assert self.condition is not None  # noqa: S101
        return self.condition


def steps_of(
    study: Study, participant: int, done: Mapping[str, Mapping[str, Any]], *, is_alone: bool = False
) -> list[Step]:
    """Return all steps of a participant (number, from 0), in order.

    `done` are the finished steps: their results decide how much practice there is, and which forms are asked again. If
    the participant `is_alone`, since their partner has left, blocks of two have no further steps.
    """

    def form_steps(when: str, name: str, condition: Condition | None = None, text: str = "") -> list[Step]:
        attempts = []
        for form in (one for one in study.forms if one.when == when):
            for attempt in range(1, form.tries + 1):
                step = f"{name}.form.{form.name}" + (f".{attempt}" if attempt > 1 else "")
                attempts.append(Step(step, "form", condition, form, text if attempt > 1 else "", attempt=attempt))
                if done.get(step, {}).get("passed", True):
                    break
        return attempts

    steps = [Step("consent", "consent", text=study.consent)] if study.consent else []
    steps += form_steps("start", "start")
    steps += [Step("welcome", "text", text=study.welcome)] if study.welcome else []
    steps += form_steps("welcome", "welcome", text=study.welcome)
    for block, condition in enumerate(study.order_of(participant), 1):
        name, own = f"block{block}", []
        if block > 1 and study.break_s:
            own.append(Step(f"{name}.break", "break", condition))
        if condition.text:
            own.append(Step(f"{name}.text", "text", condition, text=condition.text))
        for game in range(_practice_of(study, name, done)):
            own.append(Step(f"{name}.practice{game + 1}", "practice", condition, game=game))
        for game in range(study.games):
            own.append(Step(f"{name}.game{game + 1}", "game", condition, game=game))
        own += form_steps("block", name, condition)
        steps += [step for step in own if not (is_alone and condition.is_of_two) or step.id in done]
    steps += form_steps("end", "end")
    if ended_early(done):
        steps = [step for step in [*steps, Step("stop", "stop")] if step.id in done]
    return steps + ([Step("debriefing", "text", text=study.debriefing)] if study.debriefing else [])


def ended_early(done: Mapping[str, Mapping[str, Any]]) -> bool:
    """Return True if a participant has stopped, or failed a form that ends the study for them."""
    return "stop" in done or any(line.get("ends") for line in done.values())


def items_of(study: Study, participant: int, step: Step) -> list[Item]:
    """Return the questions of a form in the order in which a participant is asked."""
    return step.form.order(f"{study.seed} {participant} {step.id}") if step.form is not None else []


def _practice_of(study: Study, block: str, done: Mapping[str, Mapping[str, Any]]) -> int:
    """Return the number of games of practice in a block: those done, and one more if it is due."""
    practice, games = study.practice, [line for name, line in done.items() if name.startswith(f"{block}.practice")]
    won = sum(game.get("won") is True for game in games)
    return len(games) + (won < practice.wins and len(games) < practice.most)


def first_line(study: Study, participant: int) -> dict[str, Any]:
    """Return the first line of a participant's file, which identifies participant and study."""
    return {"type": "participant", "number": participant, "study": study.title, "seed": study.seed}


def read_lines(path: Path) -> tuple[list[dict[str, Any]], int]:
    """Return a participant's complete lines, and their size in bytes; raise RecordingError if one is corrupt."""
    whole, end, _ = read_regular(path).rpartition(b"\n")
    lines: list[dict[str, Any]] = []
    for number, line in enumerate(whole.split(b"\n"), 1):
        if not line:
            continue
        try:
            lines.append(decode(_decoder, line, len(line)))
            if number > 1:
                msgspec.convert(lines[-1], _Line)
        except (msgspec.DecodeError, ProtocolError, RecursionError) as error:
            raise RecordingError(f"line {number} of {path} is corrupt: {error}") from error
    return lines, len(whole) + len(end)


class Progress:
    """A participant's file, which is created if it is missing.

    With `only_read` the file is left as it is, since another program may be writing it. `is_alone` returns the argument
    of `steps_of`. Raises RecordingError if the file is of another study or participant, or corrupt.
    """

    def __init__(
        self,
        study: Study,
        path: Path,
        participant: int,
        *,
        only_read: bool = False,
        is_alone: Callable[[], bool] = lambda: False,
    ) -> None:
        self.study, self.participant, self._path, self._is_alone = study, participant, path, is_alone
        first = first_line(study, participant)
        lines, whole = read_lines(path) if path.exists() else ([], 0)
        if lines and {key: lines[0].get(key) for key in first} != first:
            raise RecordingError(f"{path} is of another study or participant: expected {first}, got {lines[0]}")
        self.done = {str(line["step"]): line for line in lines[1:]}
        """Finished steps by id. It is replaced and never changed, since other threads read it."""
        if only_read:
            return
        if path.exists() and path.stat().st_size > whole:  # nobody was told that half a line is recorded
            os.truncate(path, whole)
        if not lines:
            self._write(first)

    def _write(self, line: dict[str, Any]) -> None:
        self._path.parent.mkdir(parents=True, exist_ok=True)
        data = json.dumps(line, allow_nan=False).encode() + b"\n"
        with self._path.open("ab", buffering=0) as file:
            before = os.fstat(file.fileno()).st_size
            try:
                if file.write(data) != len(data):
                    raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
                os.fsync(file.fileno())
            except OSError as error:  # half a line would spoil the next one
                file.truncate(before)
                raise OutputError(f"what was done cannot be kept in {self._path}: {explain(error)}") from error

    @property
    def steps(self) -> list[Step]:
        """All steps; of practice games, the finished ones and one more if it is due."""
        return steps_of(self.study, self.participant, self.done, is_alone=self._is_alone())

    @property
    def next(self) -> Step | None:
        """The next step; None when all are done."""
        done = self.done
        return next((step for step in self.steps if step.id not in done), None)

    @property
    def may_stop(self) -> bool:
        """True if a step is finished, consent is given, and more than the debriefing is left."""
        return bool(self.done) and self.next is not None and self.next.id not in ("consent", "debriefing")

    @property
    def has_ended_early(self) -> bool:
        """True if the participant has stopped, or failed a form that ends the study for them."""
        return ended_early(self.done)

    def finish(self, step: Step, **record: Any) -> None:
        """Record that a step is finished, with its results; they are on the disk when this returns.

        Raises ConfigError if it is not the next step, or the answers to its form are invalid; OutputError if it cannot
        be written. Nothing is recorded then.
        """
        due = self.next
        if due is None or due.id != step.id:
            raise ConfigError(f"the next step is {due.id if due else 'none: all is done'}, got {step.id}")
        if step.form is not None:
            record["answers"] = step.form.read(record.get("answers", {}))
            record["scores"] = step.form.scores(record["answers"])
            if not step.form.passes(record["answers"]):
                record |= {"passed": False, "ends": step.form.fails == "end" and step.attempt == step.form.tries}
        self._keep(step.id, record)

    def stop(self) -> None:
        """Record that the participant has stopped: only the debriefing is left."""
        if "stop" not in self.done and self.next is not None:
            self._keep("stop", {})

    def _keep(self, step: str, record: dict[str, Any]) -> None:
        line = {"step": step, "at": time.time(), **record}
        self._write(line)
        self.done = self.done | {step: line}
