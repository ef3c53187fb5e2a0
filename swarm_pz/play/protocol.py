"""What a table and its clients say to each other: JSON messages; what they show is in `frames`.

`docs/protocol.md` explains both; this file decides them. Messages are structs, told apart by their ``type``; whatever
does not fit them is refused before anything else sees it. Run as a program it prints the JSON schema of all messages.
"""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

import msgspec
from msgspec import Meta, Struct

from swarm_pz.errors import ProtocolError
from swarm_pz.play.strokes import MOST_POINTS, Brush, Mapping

SUBPROTOCOL = "swarm-pz.play.v2"
"""What clients and tables speak."""
MAX_MESSAGE_BYTES = 65_536
MAX_MESSAGES_PER_SECOND = 20

LARGEST, SMALLEST = 1e22, 1e-300
"""Sizes of numbers other than 0: msgspec reads those further from 1 up to a thousand times as slowly."""
_FAR = re.compile(rb"[eE](?:\+?[0-9]{2}|-[0-9]{3})")
"""What a number has that may be so far from 1; words may have it, too."""

T = TypeVar("T")

# --- what messages are made of --------------------------------------------------------------------

Side = Literal["red", "blue"]
SIDES: tuple[Side, Side] = ("red", "blue")
Milliseconds = Annotated[float, Meta(ge=-1e15, le=1e15)]
Count = Annotated[int, Meta(ge=0, lt=2**32)]
Reason = Literal["malformed", "too_many", "out_of_turn", "not_valid", "taken", "unknown", "full"]
Tick = Annotated[int, Meta(ge=0, lt=2**32)]
Outcome = Literal["red", "blue", "draw", "stopped"]
EndedBy = Literal["capture", "time", "left", "server", "forfeit"]
SeatEvent = Literal["connected", "disconnected", "displaced", "hidden", "shown", "failed", "forfeit"]
Code = Annotated[str, Meta(pattern="^[A-Za-z0-9]{4,8}$")]
Token = Annotated[str, Meta(pattern="^[0-9a-f]{32}$")]
Name = Annotated[str, Meta(min_length=1, max_length=200)]
# One line of text: no control characters (of terminals, too), no line ends, nothing that turns its direction.
Label = Annotated[
    str, Meta(max_length=40, pattern=r"^(?![\s\S]*[\u0000-\u001f\u007f-\u009f\u2028-\u202e\u2066-\u2069\ufeff])")
]


class Message(Struct, forbid_unknown_fields=True):
    """A message, or a part of one."""


class Settings(Message):
    """How a room plays; None for the time limit plays without one."""

    red: Annotated[int, Meta(ge=0, le=200)] = 10
    blue: Annotated[int, Meta(ge=0, le=200)] = 10
    time_limit: Annotated[float, Meta(ge=1, le=36_000)] | None = 300.0
    mapping: Mapping | None = None
    """How drawings become densities; None for as the rules need it."""
    speed: Annotated[float, Meta(ge=0.25, le=2)] = 1.0
    majority: bool = False
    """When time is up, the side with more drones has won; else nobody has."""
    red_system: Name | None = None
    """The control system that flies red; None for that of the table. So below."""
    blue_system: Name | None = None


# --- what clients say -----------------------------------------------------------------------------

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
)

# --- what the server says -------------------------------------------------------------------------


class Card(Message):
    """How good a policy is, and what it looks like at one moment of a game as blue."""

    rating: float
    """On the ladder; `uniform` is 1000."""
    target: list[str]
    """Rows from the bottom up, digits from 0 to 9."""
    drones: list[tuple[int, int]]
    """x and y in hundredths of a map width."""


class PolicyInfo(Message):
    """A policy that may take a seat."""

    name: str
    about: str
    card: Card | None = None
    """Of those that were rated."""
    answers: str = "density"
    """The kind of its commands: it flies what takes them; "any" is for policies that suit themselves to the system."""


class SystemInfo(Message):
    """A control system that may fly a seat."""

    name: str
    about: str
    takes: str
    """The kind of its commands."""
    serves_densities: bool
    """Whether it can be flown by densities, and so by strokes."""


class Commands(Message):
    """What commands a seat takes, and what is needed to make them by hand."""

    system: str
    takes: str
    shape: list[int]
    low: float | list[Any]
    """Least numbers, nested as the shape; one number if all are the same. So below."""
    high: float | list[Any]
    default: list[Any]
    """The command that is in force at the start."""
    serves_densities: bool
    shapes: list[str] = msgspec.field(default_factory=list)
    """Names of formations."""


class Welcome(Message, tag="welcome"):
    """The answer to a hello."""

    version: str
    policies: list[PolicyInfo]
    min_command_interval: float
    command_cells: int
    server_ms: float
    addresses: list[str] = msgspec.field(default_factory=list)
    """Of this page, as other devices in the network reach it; none if only this machine can."""
    records_labels: bool = False
    """Whether labels stand in recordings; else only those at the table see them."""
    systems: list[SystemInfo] = msgspec.field(default_factory=list)
    """Control systems that may fly a seat."""
    default_systems: list[str] = msgspec.field(default_factory=list)
    """Names of those that fly red and blue where a room's settings say nothing else."""
    opponents: list[str] = msgspec.field(default_factory=list)
    """Those that pages unlock one after the other, from the weakest on."""
    embedders: list[str] = msgspec.field(default_factory=list)
    """Origins of the pages that may hold this one in a frame."""
    guests: bool = True
    """Whether others can come into a room."""


class SeatFactors(Message):
    """What an experimenter varies at a seat, as far as its client has to know it to show the game."""

    hide: list[str] = msgspec.field(default_factory=list)
    """Of "opponents", "ground", "trails", "target": what it is not sent, or (trails) should not paint."""
    frame_rate: int = 30
    """Moments that it is sent a second; below 30 it should show them as they are, and not what follows from them."""
    helper: str = ""
    """The policy that makes a share of its commands."""
    share: float = 0.0


class Seated(Message, tag="seated"):
    """A seat is yours; the token takes it back after a lost connection."""

    room: str
    seat: Side
    token: str
    commands: Commands
    """What it takes."""
    factors: SeatFactors | None = None
    """None where nothing is varied that is to be known."""


class SeatState(Message):
    """Who sits in a seat."""

    kind: Literal["free", "person", "program", "policy"] = "free"
    name: str = ""
    label: str = ""
    connected: bool = False
    ready: bool = False
    policy_state: Literal["loading", "loaded", "failed"] | None = None
    """Of a policy: a game waits until it is loaded, and one that failed does not play."""
    reason: str = ""
    """Why a policy failed to load."""
    gone: bool = False
    """Who had it gave it up for good in the game that is played; its swarm goes on with its last command."""
    system: str = ""
    """The control system that flies it."""
    takes: str = ""
    """The kind of its commands."""


class RoomState(Message, tag="room"):
    """A room, sent whenever anything of it changes."""

    code: str
    phase: Literal["waiting", "starting", "playing", "over", "replay"]
    """While a game starts, it counts down: its start is shown, and commands are taken for its first tick."""
    settings: Settings
    red: SeatState
    blue: SeatState
    watchers: int
    sizes: list[tuple[int, int]]
    """Drones of red and blue, once a second since the start."""
    min_command_interval: float
    outcome: Literal["red", "blue", "draw", "stopped"] | None = None
    recording: str | None = None
    """Of the game that is over, or that is watched."""
    last_tick: int | None = None
    """Of a recorded game."""
    starts_ms: float | None = None
    """When the countdown is over, on the server's clock; the first tick waits for policies' first commands, too."""
    verified: bool | None = None
    """Whether the recorded game plays here as it did; else it cannot be taken over."""
    ended_by: str | None = None
    """Of a game that is over, as in its recording."""
    forfeit: str = ""
    """Which side's control system failed, so that it lost, and how."""
    once: bool = False
    """One game is played here, and no more."""


class Received(Message, tag="received"):
    """A command has arrived; it waits if the last one is too young."""

    number: int
    server_ms: float


class OfSeat(Message):
    """A message about a seat; each has the field itself, since structs have one base with fields."""

    if TYPE_CHECKING:
        seat: Side

    @property
    def team(self) -> int:
        """0 red, 1 blue."""
        return SIDES.index(self.seat)


class InForceMessage(OfSeat, tag="in_force"):
    """The swarm follows a command from this tick on."""

    seat: Side
    number: Count
    tick: Tick
    server_ms: float
    sender: str = ""
    """Of a command that an automatic response gave: "auto:" and its policy, or "auto:saved"; of one that a
    policy shares, "shared:" and that policy, with the number of the player's latest."""


class Acting(Message, tag="acting"):
    """Which of the seat's automatic responses commands now; whenever that changes."""

    seat: Side
    rule: int | None
    """Its place among the rules, from 0; None for none."""
    sender: str = ""
    """As in `in_force`."""


class Refused(Message, tag="refused"):
    """A message was not obeyed, and why; nothing has changed."""

    code: Reason
    reason: str
    about: str = ""
    recording: str | None = None
    """To a hello whose token's seat is gone: the game that was played there."""


class Notice(Message, tag="notice"):
    """Something that everybody in the room should know."""

    text: str


class Displaced(Message, tag="displaced"):
    """Another connection has taken this seat; this one is sent nothing more."""


class Pong(Message, tag="pong"):
    """The answer to a ping."""

    sent_ms: float
    server_ms: float


ServerMessage = Welcome | Seated | RoomState | Received | InForceMessage | Acting | Refused | Notice | Displaced | Pong

# --- what a recording has besides -----------------------------------------------------------------


class RecordedSeat(Message):
    """The player of a seat at the start: never a person's name, at most a label they chose."""

    kind: Literal["person", "program", "policy", "free"]
    policy: str = ""
    label: str = ""


class Origin(Message):
    """The recorded game, and its moment, from which this one was played on."""

    recording: str
    tick: Tick
    lines: Count
    """So many lines after the first are from there."""


class Header(Message, tag="game"):
    """The first line of a recording."""

    protocol: str
    software: str
    started: str
    """In UTC, ISO 8601."""
    began_ms: float
    """The same moment on the server's clock."""
    table: dict[str, Any]
    """The configuration, the rules among it."""
    seed: int
    red: RecordedSeat
    blue: RecordedSeat
    lesson: bool = False
    origin: Origin | None = None


class SeatCommand(CommandMessage, OfSeat, tag="command", kw_only=True):
    """A command as it arrived, with the density or the array that is followed, also where strokes were sent."""

    seat: Side
    tick: Tick
    """The first solve that counts it is at this tick or later."""
    server_ms: float
    sender: str = ""
    """As in `in_force`."""


class SeatPainted(Painted, OfSeat, tag="painted"):
    """The screen of a seat's client showed the first frame that a command had changed."""

    seat: Side


class CapturedMessage(OfSeat, tag="captured"):
    """A team captured a drone."""

    seat: Side
    tick: Tick
    drone: Annotated[int, Meta(ge=0, lt=2**16)]


class FrameMessage(Message, tag="frame"):
    """Positions, velocities and teams: a frame as it is sent, in base64."""

    tick: Tick
    data: bytes


class SeatMessage(OfSeat, tag="seat"):
    """A connection came, went or changed; or a seat failed, and why."""

    seat: Side
    event: SeatEvent
    server_ms: float
    client: ClientInfo | None = None
    reason: str = ""


class Delay(Message):
    """A requested delay, the median of the measured ones (null if nothing was delayed), and their number."""

    asked_ms: float
    got_ms: float | None
    count: int


class SeatDelays(Message):
    """The delays of a seat: of its commands, and of the moments that it was shown."""

    command: Delay
    display: Delay


class EndMessage(Message, tag="end"):
    """The game's end; "stopped" if nobody played it to its end."""

    outcome: Outcome
    tick: Tick
    sizes: tuple[Count, Count]
    server_ms: float
    ended_by: EndedBy
    """A game that a client had left when it ended is "left", however it ended."""
    delays: tuple[SeatDelays, SeatDelays] | None = None
    """Red's and blue's, where the table varied anything."""


LogMessage = SeatCommand | InForceMessage | SeatPainted | CapturedMessage | FrameMessage | SeatMessage | EndMessage

# --- how messages are written and read ------------------------------------------------------------

_client_decoder: msgspec.json.Decoder[ClientMessage] = msgspec.json.Decoder(ClientMessage)
_server_decoder: msgspec.json.Decoder[ServerMessage] = msgspec.json.Decoder(ServerMessage)
_log_decoder: msgspec.json.Decoder[Header | LogMessage] = msgspec.json.Decoder(Header | LogMessage)
_encoder = msgspec.json.Encoder()


def decode_client(text: str | bytes) -> ClientMessage:
    """Read a client's message.

    Raises
    ------
    ProtocolError
        If it is too long or fits none of the messages.
    """
    return _decode(_client_decoder, text)


def decode_server(text: str | bytes) -> ServerMessage:
    """Read a server's message, as `decode_client`."""
    return _decode(_server_decoder, text)


def decode_log(line: bytes) -> Header | LogMessage:
    """Read a line of a recording; errors as of `decode`."""
    return decode(_log_decoder, line)


def _decode(decoder: msgspec.json.Decoder[T], text: str | bytes) -> T:
    if len(text) > MAX_MESSAGE_BYTES:
        raise ProtocolError(f"a message may have {MAX_MESSAGE_BYTES} bytes, got {len(text)}")
    try:
        return decode(decoder, text)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise ProtocolError(f"not a message of {SUBPROTOCOL}: {error}") from error


def decode(decoder: msgspec.json.Decoder[T], text: str | bytes) -> T:
    """Read JSON that anybody may have written, for about as little time a byte whatever it holds.

    Raises
    ------
    DecodeError
        If it is not what the decoder reads, or a number in it is too large or too small.
    UnicodeDecodeError, RecursionError
        If it is no text, or nested too deeply.
    """
    if _FAR.search(text.encode(errors="replace") if isinstance(text, str) else text) is not None:
        try:
            json.loads(text, parse_float=_near)
        except ValueError as error:
            raise msgspec.DecodeError(str(error)) from error
    return decoder.decode(text)


def _near(written: str) -> float:
    value = float(written)
    if value and not SMALLEST <= abs(value) <= LARGEST:
        raise ValueError(f"a number must be 0, or from {SMALLEST:g} to {LARGEST:g} in size, got {written[:40]}")
    return value


def encode(message: ClientMessage | ServerMessage | Header | LogMessage) -> str:
    """Write a message as JSON."""
    return _encoder.encode(message).decode()


def schema() -> dict[str, Any]:
    """Return the JSON schema of all messages of both sides, and of the lines of recordings."""
    kinds = [ClientMessage, ServerMessage, Header | LogMessage]
    schemas, definitions = msgspec.json.schema_components(kinds, ref_template="#/$defs/{name}")
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": SUBPROTOCOL,
        "properties": dict(zip(("client", "server", "recording"), schemas, strict=True)),
        "$defs": definitions,
    }


if __name__ == "__main__":
    print(json.dumps(schema(), indent=2))  # noqa: T201
