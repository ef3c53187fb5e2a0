"""Published tables of a study: rows and columns, described for programs and for people.

The key of `games` is participant and step; commands and captures refer to it by these two columns. Columns with a
default come from the game's recording; `SeatRow` describes those that have no description here.
"""

from __future__ import annotations

from dataclasses import dataclass

from swarm_pz.play.recordings.seats import column
from swarm_pz.play.recordings.tables import NOTES as NOTES_OF_TABLES


@dataclass(frozen=True, kw_only=True)
class ParticipantRow:
    """A participant."""

    participant: str = column("name of the participant, such as P01; it is not their code")
    number: int = column("number of the participant, from 0; it decides the order")
    order: str = column("titles of the conditions in the order in which they were met, with > between them")
    withdrawn: bool = column("whether the participant withdrew: then only number and order are kept")
    finished: bool = column("whether all steps of the study are done")
    stopped: bool = column("whether the participant stopped before the end; what they had done is kept")
    failed: str = column("forms whose right answers were not given; then the participant is in no comparison")
    consent_day: str = column("day of the consent, in UTC")


@dataclass(frozen=True, kw_only=True)
class GameRow:
    """A game, as one participant played it."""

    participant: str = column("name of the participant")
    step: str = column("name of the step, such as block1.game2; with the participant the key of a game")
    block: int = column("number of the block in the participant's order, from 1")
    game: int = column("number of the game in its block, from 1; games of one number have the same start")
    practice: bool = column("whether it was practice, which does not count")
    condition: str = column("title of the condition")
    system: str = column("control system that flew the participant's drones")
    opponent: str = column('policy that was played against; "person" for another participant')
    side: str = column("side of the participant: red or blue")
    seed: int | None = column("seed of the start")
    outcome: str = column("win, draw or loss of the participant")
    won: bool = column("whether the participant won")
    decided: bool = column("whether anybody won; else the length is a lower bound (censored)")
    seconds: float = column("length of the game", "s of game")
    speed: float | None = None
    after_s: float | None = column("when it was over, after the participant's first step; in whole seconds", "s")
    recording: str = column("file of the recording, in the study's folder")
    left_out: str = column(
        "what was unusual: left, no command, forfeit, ...; partner withdrew, if its recording was deleted for that; "
        "else empty. The report counts these games, too, except those whose ended_by is server or forfeit",
        default="",
    )
    ended_by: str = ""
    drones: int | None = column("drones of the participant at the start", "count", None)
    opponent_drones: int | None = column("drones of the opponent at the start", "count", None)
    final_share: float | None = None
    commands: int | None = None
    commands_per_minute: float | None = None
    first_command_s: float | None = None
    drawing_s_per_command: float | None = None
    input_to_in_force_ms: float | None = None
    disconnections: int | None = None
    away_s: float | None = None
    hidden_s: float | None = None
    command_delay_asked_ms: float | None = column("delay of commands that the condition asks for", "ms")
    command_delay_got_ms: float | None = column("delay of commands as measured, median", "ms")
    command_delay_count: int | None = column("commands whose delay was measured", "count")
    display_delay_asked_ms: float | None = column("delay of the display that the condition asks for", "ms")
    display_delay_got_ms: float | None = column("delay of the display as measured, median", "ms")
    display_delay_count: int | None = column("moments whose delay was measured", "count")
    rules_hash: str = ""
    config_hash: str = ""


@dataclass(frozen=True, kw_only=True)
class CommandRow:
    """A command of either side, in a game of a participant."""

    participant: str = column("name of the participant")
    step: str = column("name of the step; with the participant the key of the game")
    condition: str = column("title of the condition")
    side: str = column("side that was commanded: red or blue")
    by: str = column("participant, opponent, or shared: mixed with the helper's")
    number: int = column("number by which its sender knows it")
    kind: str = column('"density", or the kind of commands that the control system takes')
    tick: int = column("tick at which it arrived", "1/30 s of game")
    seconds: float | None = column("when it arrived", "s of game")
    in_force_tick: int | None = column("tick from which it was followed; empty if another one took its place", "1/30 s")
    drawing_ms: float | None = column("how long its drawing took", "ms")
    strokes: int | None = column("strokes of its drawing", "count")
    centre_x: float | None = column("centre of what it asks for, from 0 (left) to 1", "side of the board")
    centre_y: float | None = column("centre of what it asks for, from 0 (bottom) to 1", "side of the board")
    values: str = column("the command itself, as JSON; a density has rows from the bottom and columns from the left")


@dataclass(frozen=True, kw_only=True)
class CaptureRow:
    """A drone that one side took from the other, in a game of a participant."""

    participant: str = column("name of the participant")
    step: str = column("name of the step; with the participant the key of the game")
    condition: str = column("title of the condition")
    tick: int = column("tick at which it was taken", "1/30 s of game")
    seconds: float = column("when it was taken", "s of game")
    drone: int = column("number of the drone, from 0")
    side: str = column("side that took it: red or blue")
    by_participant: bool = column("whether the participant took it; else the participant lost it")
    drones: int = column("drones of the participant after it", "count")
    opponent_drones: int = column("drones of the opponent after it", "count")


@dataclass(frozen=True, kw_only=True)
class FormRow:
    """An answer to one question of a form, or a score of the form."""

    participant: str = column("name of the participant")
    step: str = column("name of the step, such as block1.form.sus")
    block: int | None = column("number of the block after which it was asked; empty if asked once")
    condition: str = column("title of the condition of that block; empty if asked once")
    form: str = column("name of the form")
    item: str = column("name of the question, or of the score")
    kind: str = column("scale, choice, number, text or pair; score for what the answers come to")
    question: str = column("the question's words")
    place: int | None = column("place of the question in the order in which it was asked, from 1")
    answer: str | None = column("the answer as text; empty if it was left out")
    value: float | None = column("the answer or score as a number; empty if it is none")
    correct: bool | None = column("whether it is the right answer; empty if there is none")
    after_s: float | None = column(
        "when the form was handed in, after the participant's first step; in whole seconds", "s"
    )


Row = ParticipantRow | GameRow | CommandRow | CaptureRow | FormRow
TABLES: dict[str, type[Row]] = {
    "games": GameRow,
    "commands": CommandRow,
    "captures": CaptureRow,
    "forms": FormRow,
    "participants": ParticipantRow,
}
"""Kinds of rows, by the name of their table."""
NOTES = NOTES_OF_TABLES | {
    "time": "A tick is 1/30 s of game. Truth values are true or false.",
    "factors": "Columns factor_... have the condition's level of each factor; empty where a row has no condition.",
    "materials": "`materials` has the study's file and its texts, without the codes.",
}
"""Notes for all tables."""
