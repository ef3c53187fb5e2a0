"""Messages of the server and its clients in JSON, and the lines of recordings; `frames` has the binary messages.

`docs/protocol.md` explains both; this file defines them. Messages are structs with a ``type``; all others are
refused. ``python -m swarm_pz.play.protocol`` prints the JSON schema of all of them.
"""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

import msgspec
from msgspec import Meta, Struct

from swarm_pz.errors import ProtocolError
from swarm_pz.play.strokes import MOST_POINTS, Brush

SUBPROTOCOL = "swarm-pz.play.v2"
"""Name of this protocol, in connections and in recordings."""
MAX_MESSAGE_BYTES = 65_536
MAX_LINE_BYTES = 2 * MAX_MESSAGE_BYTES
"""Longest line of a recording, whose commands have strokes and density; a longer one would hold up other threads."""
MAX_MESSAGES_PER_SECOND = 20

LARGEST, SMALLEST = 1e22, 1e-300
"""Bounds on the size of numbers other than 0: msgspec reads those beyond up to a thousand times as slowly."""
_FAR = re.compile(rb"[eE](?:\+?[0-9]{2}|-[0-9]{3})")
"""Matches exponents that may lead beyond these bounds."""
T = TypeVar("T")

Side = Literal["red", "blue"]
SIDES: tuple[Side, Side] = ("red", "blue")
Place = Side | Literal["watch"]
Kind = Literal["free", "person", "program", "policy"]
Outcome = Literal["red", "blue", "draw", "stopped"]
EndedBy = Literal["capture", "time", "left", "server", "forfeit"]
SeatEvent = Literal["connected", "disconnected", "displaced", "hidden", "shown", "failed", "forfeit"]
Reason = Literal["malformed", "too_many", "out_of_turn", "not_valid", "taken", "unknown", "full"]
Milliseconds = Annotated[float, Meta(ge=-1e15, le=1e15)]
Count = Annotated[int, Meta(ge=0, lt=2**32)]
Tick = Count
Pixels = Annotated[int, Meta(ge=0, le=100_000)]
Code = Annotated[str, Meta(pattern="^[A-Za-z0-9]{4,8}$")]
Token = Annotated[str, Meta(pattern="^[0-9a-f]{32}$")]
Name = Annotated[str, Meta(min_length=1, max_length=200)]
# One line of text: no control characters (of terminals, too), line ends, or marks that change its direction.
Label = Annotated[
    str, Meta(max_length=40, pattern=r"^(?![\s\S]*[\u0000-\u001f\u007f-\u009f\u2028-\u202e\u2066-\u2069\ufeff])")
]
Density = list[list[float]]
Form = list[Any] | dict[str, Any]
"""A command as its control system reads it: the array of its kind, or a form that people write more easily."""


class Message(Struct, forbid_unknown_fields=True):
    """A message, or a part of one."""


class OfSeat(Message):
    """A message about a seat. Each declares `seat` itself, since only one base of a struct can have fields."""

    if TYPE_CHECKING:
        seat: Side

    @property
    def team(self) -> int:
        """0 red, 1 blue."""
        return SIDES.index(self.seat)


class Settings(Message):
    """The rules of a room.

    None means no time limit, or the server's control system.
    With `majority` the side with more drones wins when time is up.
    """

    red: Annotated[int, Meta(ge=0, le=200)] = 10
    blue: Annotated[int, Meta(ge=0, le=200)] = 10
    time_limit: Annotated[float, Meta(ge=1, le=36_000)] | None = 300.0
    speed: Annotated[float, Meta(ge=0.25, le=2)] = 1.0
    majority: bool = False
    red_system: Name | None = None
    blue_system: Name | None = None


# --- from clients ---------------------------------------------------------------------------------


class ClientInfo(Message):
    """A client's screen; programs leave it out."""

    viewport: tuple[Pixels, Pixels]
    pixel_ratio: Annotated[float, Meta(ge=0, le=100)] = 1.0


class Hello(Message, tag="hello"):
    """The first message of every connection; a token takes its seat back."""

    kind: Literal["person", "program"] = "program"
    token: Token | None = None
    client: ClientInfo | None = None


class Create(Message, tag="create"):
    """Open a room and take a seat against `opponent`; or watch `player` (red) against it.

    A `lesson` is left out of tables. A room with `once` has a single game. `seed` is for the first start.
    """

    settings: Settings = msgspec.field(default_factory=Settings)
    seat: Place = "red"
    opponent: Name | None = None
    player: Name | None = None
    label: Label = ""
    lesson: bool = False
    once: bool = False
    seed: Count | None = None


class Join(Message, tag="join"):
    """Take a seat in a room, or watch."""

    room: Code
    seat: Place = "watch"
    label: Label = ""


class Ready(Message, tag="ready"):
    """Set ready, also for the next game, and for two policies that one watches; False stops a countdown.

    A `label` replaces that of the seat.
    """

    ready: bool = True
    label: Label | None = None


class Pause(Message, tag="pause"):
    """Pause a game against a policy, or continue it."""

    paused: bool = True


class StrokeMessage(Message):
    """One line of a drawing; see `swarm_pz.play.strokes.Stroke`."""

    brush: Brush
    width: float
    points: Annotated[list[tuple[float, float]], Meta(min_length=1, max_length=MOST_POINTS)]


Strokes = Annotated[list[StrokeMessage], Meta(max_length=256)]


class Timing(Message):
    """Times of a command on the client's clock, and the offset of the server's clock from it."""

    input_ms: Milliseconds
    sent_ms: Milliseconds
    offset_ms: Milliseconds = 0.0
    round_trip_ms: Milliseconds = 0.0
    drawing_ms: Milliseconds = 0.0


class CommandMessage(Message, tag="command"):
    """A command in one of its forms: strokes, a density, or the form of the seat's control system."""

    number: Count
    strokes: Strokes | None = None
    density: Density | None = None
    command: Form | None = None
    timing: Timing | None = None


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
    """Leave the room, and give up its seat."""


ClientMessage = (
    Hello | Create | Join | Ready | Pause | CommandMessage | Acknowledge | Ping | Visibility | Leave
)  # fmt: skip

# --- from the server ------------------------------------------------------------------------------


class Card(Message):
    """A policy's rating (`uniform` has 1000), and one moment of a game it plays as blue.

    `target` has rows of digits from the bottom up; `drones` has x and y in hundredths of a map width.
    """

    rating: float
    target: list[str]
    drones: list[tuple[int, int]]


class PolicyInfo(Message):
    """A policy that may take a seat."""

    name: str
    about: str
    card: Card | None = None


class SystemInfo(Message):
    """A control system, and the kind of its commands."""

    name: str
    takes: str


class Commands(Message):
    """The commands of a seat: an array's shape, its bounds (one number, or nested as the shape), and its default."""

    system: str
    takes: str
    shape: list[int]
    low: float | list[Any]
    high: float | list[Any]
    default: list[Any]
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
    """Addresses of this page for other devices in the network."""
    records_labels: bool = False
    systems: list[SystemInfo] = msgspec.field(default_factory=list)
    default_systems: list[str] = msgspec.field(default_factory=list)
    """Control systems of red and blue where a room's settings name none."""
    opponents: list[str] = msgspec.field(default_factory=list)
    """Opponents that pages unlock one after the other, from the weakest on."""
    embedders: list[str] = msgspec.field(default_factory=list)
    """Origins of the pages that may embed this one in a frame."""
    guests: bool = True
    """True if others can come into a room."""


class SeatFactors(Message):
    """An experimenter's settings of a seat, as far as its client needs them.

    `hide` names what the client must not show: "opponents", "ground", "trails" or "target". Below 30 frames a second
    it should not interpolate. The policy `helper` makes a `share` of the commands.
    """

    hide: list[str] = msgspec.field(default_factory=list)
    frame_rate: int = 30
    helper: str = ""
    share: float = 0.0


class Seated(Message, tag="seated"):
    """A seat is yours; the token takes it back after a lost connection."""

    room: str
    seat: Side
    token: str
    commands: Commands
    factors: SeatFactors | None = None


class SeatState(Message):
    """A seat as everybody in the room sees it.

    A game waits for a policy that is loading; `reason` says why one failed. If the player is `gone`, they gave up the
    seat during the game, and the swarm keeps its last command.
    """

    kind: Kind = "free"
    name: str = ""
    label: str = ""
    connected: bool = False
    ready: bool = False
    policy_state: Literal["loading", "loaded", "failed"] | None = None
    reason: str = ""
    gone: bool = False


class RoomState(Message, tag="room"):
    """A room, sent whenever anything of it changes."""

    code: str
    phase: Literal["waiting", "starting", "playing", "over"]
    settings: Settings
    red: SeatState
    blue: SeatState
    sizes: list[tuple[int, int]]
    """Drones of red and blue, once a second since the start."""
    outcome: Outcome | None = None
    recording: str | None = None
    """Name of the game that is over."""
    starts_ms: float | None = None
    """End of the countdown on the server's clock; the first tick also waits for policies' first commands."""
    ended_by: str | None = None
    forfeit: str = ""
    """The fault of a control system that made its side lose."""
    once: bool = False
    paused: bool = False
    wins: tuple[int, int] = (0, 0)
    """Games that the players of red and blue have won against each other here; after a game two people change sides."""


class Received(Message, tag="received"):
    """A command has arrived; it waits if the last one is too recent."""

    number: int
    server_ms: float


class InForceMessage(OfSeat, tag="in_force"):
    """The swarm follows a command from this tick on.

    If a policy shares the command, `sender` is "shared:POLICY", and `number` is that of the player's latest command.
    """

    seat: Side
    number: Count
    tick: Tick
    server_ms: float
    sender: str = ""


class Refused(Message, tag="refused"):
    """A message was refused, and why; nothing has changed."""

    code: Reason
    reason: str
    about: str = ""


class Notice(Message, tag="notice"):
    """Something for everybody in the room."""

    text: str


class Displaced(Message, tag="displaced"):
    """Another connection has taken this seat; this one receives nothing more."""


class Pong(Message, tag="pong"):
    """The answer to a ping."""

    sent_ms: float
    server_ms: float


ServerMessage = (
    Welcome | Seated | RoomState | Received | InForceMessage | Refused | Notice | Displaced | Pong
)  # fmt: skip

# --- in recordings --------------------------------------------------------------------------------


class RecordedSeat(Message):
    """The player of a seat at the start: never a person's name, at most a label they chose."""

    kind: Kind
    policy: str = ""
    label: str = ""


class Header(Message, tag="game"):
    """The first line: the server's configuration with the rules, and the start in UTC and on the server's clock."""

    protocol: str
    software: str
    started: str
    began_ms: float
    table: dict[str, Any]
    seed: int
    red: RecordedSeat
    blue: RecordedSeat
    lesson: bool = False


class SeatCommand(CommandMessage, OfSeat, tag="command", kw_only=True):
    """A command as it arrived, with the density or array that is followed, even if strokes were sent.

    The first solve that counts it is at `tick` or later; `sender` is as in `in_force`.
    """

    seat: Side
    tick: Tick
    server_ms: float
    sender: str = ""


class CapturedMessage(OfSeat, tag="captured"):
    """A team captured a drone."""

    seat: Side
    tick: Tick
    drone: Count


class FrameMessage(Message, tag="frame"):
    """Positions, velocities and teams: a frame as it is sent, in base64."""

    tick: Tick
    data: bytes


class PosesMessage(Message, tag="poses"):
    """Poses of robots for the tick after this one: float32 (N, 4) as in `LiveGame.place`, in base64."""

    tick: Tick
    data: bytes


class SeatMessage(OfSeat, tag="seat"):
    """A connection came, went or changed; or a policy or control system failed, and why."""

    seat: Side
    event: SeatEvent
    server_ms: float
    client: ClientInfo | None = None
    reason: str = ""


class Delay(Message):
    """A requested delay, the median of the measured ones (None if nothing was delayed), and their number."""

    asked_ms: float
    got_ms: float | None
    count: int


class SeatDelays(Message):
    """The delays of a seat: of its commands, and of its frames."""

    command: Delay
    display: Delay


class EndMessage(Message, tag="end"):
    """The game's end: outcome "stopped" without a result; ended by "left" if a client was away, unless by a fault.

    `delays` are red's and blue's, if an experimenter varied anything.
    """

    outcome: Outcome
    tick: Tick
    sizes: tuple[Count, Count]
    server_ms: float
    ended_by: EndedBy
    delays: tuple[SeatDelays, SeatDelays] | None = None


LogMessage = (
    SeatCommand | InForceMessage | CapturedMessage | FrameMessage | PosesMessage | SeatMessage | EndMessage
)  # fmt: skip

# --- reading and writing --------------------------------------------------------------------------

_client_decoder: msgspec.json.Decoder[ClientMessage] = msgspec.json.Decoder(ClientMessage)
_server_decoder: msgspec.json.Decoder[ServerMessage] = msgspec.json.Decoder(ServerMessage)
_log_decoder: msgspec.json.Decoder[Header | LogMessage] = msgspec.json.Decoder(Header | LogMessage)
_encoder = msgspec.json.Encoder()


def decode_client(text: str | bytes) -> ClientMessage:
    """Read a client's message; raise ProtocolError if it is too long or fits none of the messages."""
    return decode(_client_decoder, text, MAX_MESSAGE_BYTES)


def decode_server(text: str | bytes) -> ServerMessage:
    """Read a server's message, as `decode_client`."""
    return decode(_server_decoder, text, MAX_MESSAGE_BYTES)


def decode_log(line: str | bytes) -> Header | LogMessage:
    """Read a line of a recording, as `decode_client`."""
    return decode(_log_decoder, line, MAX_LINE_BYTES)


def decode(decoder: msgspec.json.Decoder[T], text: str | bytes, most: int) -> T:
    """Read untrusted JSON of at most `most` bytes or characters; raise ProtocolError if it does not fit."""
    if len(text) > most:
        raise ProtocolError(f"a message may have {most} bytes, got {len(text)}")
    try:
        if _FAR.search(text.encode(errors="replace") if isinstance(text, str) else text) is not None:
            json.loads(text, parse_float=_near)
        return decoder.decode(text)
    except (ValueError, RecursionError) as error:  # msgspec's, json's and Unicode's errors are ValueErrors
        raise ProtocolError(f"not a message of {SUBPROTOCOL}: {str(error)[:300]}") from error


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
