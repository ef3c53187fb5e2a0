"""What clients say."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from swarm_pz.play.protocol.fields import Code, Count, Label, Message, Milliseconds, Name, Settings, Side, Token
from swarm_pz.play.strokes import MOST_POINTS, Brush

MOST_RULES = 8
"""Automatic responses of a seat."""


class ClientInfo(Message):
    """What a client says about its screen; programs leave it out."""

    viewport: tuple[Annotated[int, Meta(ge=0, le=100_000)], Annotated[int, Meta(ge=0, le=100_000)]]
    pixel_ratio: Annotated[float, Meta(ge=0, le=100)] = 1.0
    refresh_hz: Annotated[float, Meta(ge=0, le=1000)] = 0.0


class Hello(Message, tag="hello"):
    """The first message of every connection; a token takes its seat back."""

    kind: Literal["person", "program"] = "program"
    token: Token | None = None
    client: ClientInfo | None = None


class Create(Message, tag="create"):
    """Open a room and sit down in it against an opponent; or watch, the opponent plays blue, and `player` red."""

    settings: Settings = msgspec.field(default_factory=Settings)
    seat: Side | Literal["watch"] = "red"
    opponent: Name | None = None
    player: Name | None = None
    label: Label = ""
    lesson: bool = False
    """It is to learn the game: the recordings of its games say so, and tables leave them out."""
    once: bool = False
    """One game is played in it, between those who sit down for it, and no more."""
    seed: Count | None = None
    """Of the start of its first game; None takes any."""


class Join(Message, tag="join"):
    """Sit down in a room that is there, or watch."""

    room: Code
    seat: Side | Literal["watch"] = "watch"
    label: Label = ""


class Invite(Message, tag="invite"):
    """Give a free seat of one's room to a policy, or with None free a policy's seat."""

    seat: Side
    policy: Name | None


class Ready(Message, tag="ready"):
    """Say that one is ready, or not; also for the next game after one, and for two policies that one watches.

    Who is not ready any more while a game counts down calls it off.
    """

    ready: bool = True


class StrokeMessage(Message):
    """One line of a drawing; see `swarm_pz.play.strokes.Stroke`."""

    brush: Brush
    width: float
    points: Annotated[list[tuple[float, float]], Meta(min_length=1, max_length=MOST_POINTS)]


class Timing(Message):
    """When a command was made, on the client's clock, and how far that is from the server's."""

    input_ms: Milliseconds
    sent_ms: Milliseconds
    offset_ms: Milliseconds = 0.0
    round_trip_ms: Milliseconds = 0.0
    drawing_ms: Milliseconds = 0.0


Strokes = Annotated[list[StrokeMessage], Meta(max_length=256)]
Form = list[Any] | dict[str, Any]
"""A command as its control system reads it: numbers in the array form of its kind, or a form for people."""


class CommandMessage(Message, tag="command"):
    """A command in one of its forms, not more: strokes, a density, or what the seat's control system takes."""

    number: Count
    strokes: Strokes | None = None
    density: list[list[float]] | None = None
    command: Form | None = None
    timing: Timing | None = None


class When(Message):
    """A condition of one's own side: one of these, not more."""

    fewer: Annotated[int, Meta(ge=1, le=400)] | None = None
    """One has fewer drones than this."""
    nobody_within: Annotated[float, Meta(gt=0, le=1.5)] | None = None
    """No opponent is within so many map widths of any own drone."""
    silent_s: Annotated[float, Meta(ge=0.5, le=3600)] | None = None
    """One has sent nothing for so many seconds of game."""


class Response(Message):
    """Who commands, or what is commanded: one of these, not more."""

    policy: Name | None = None
    strokes: Strokes | None = None
    density: list[list[float]] | None = None
    command: Form | None = None


class Rule(Message):
    """An automatic response: while the condition holds, it commands in place of the player."""

    when: When
    do: Response


class Rules(Message, tag="rules"):
    """The automatic responses of one's seat, in place of those that it had; the first acts whose condition holds."""

    rules: Annotated[list[Rule], Meta(max_length=MOST_RULES)]


class Painted(Message, tag="painted"):
    """When the client first painted a frame that a command had changed, on the server's clock."""

    number: Count
    painted_ms: Milliseconds


class Acknowledge(Message, tag="acknowledge"):
    """The latest frame that has arrived."""

    sequence: Count


class Ping(Message, tag="ping"):
    """Ask for the server's clock."""

    sent_ms: Milliseconds


class Visibility(Message, tag="visibility"):
    """The page was hidden or shown again."""

    hidden: bool


class Leave(Message, tag="leave"):
    """Give one's seat up."""


class OpenReplay(Message, tag="open_replay"):
    """Watch a recorded game."""

    recording: Name


class Seek(Message, tag="seek"):
    """Go to a tick of the recorded game that one watches."""

    tick: Count


class Pace(Message, tag="pace"):
    """Play the recorded game at some speed; 0 holds it."""

    speed: Annotated[float, Meta(ge=0, le=8)]


class TakeOver(Message, tag="take_over"):
    """Play on from the moment that one watches, in a new room."""

    seat: Side
    opponent: Name | None = None


class AskLevel(Message, tag="ask_level"):
    """Ask what somebody has reached on the ladder with a control system; None for the table's."""

    code: Name
    system: Name | None = None


class Climb(Message, tag="climb"):
    """Open a room for somebody's next game on the ladder, and sit down in it."""

    code: Name
    system: Name | None = None


ClientMessage = (
    Hello
    | Create
    | Join
    | Invite
    | Ready
    | CommandMessage
    | Rules
    | Painted
    | Acknowledge
    | Ping
    | Visibility
    | Leave
    | OpenReplay
    | Seek
    | Pace
    | TakeOver
    | AskLevel
    | Climb
)
