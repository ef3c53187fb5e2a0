"""Recorded games: a line of JSON for everything that happened, written as it happens.

The first line holds all that a game needs to be played again; the rest are events, in order, and the last one
says how it ended: a file without it is unfinished. All times named ``ms`` are milliseconds on the server's clock
since the game began. A file that ends in the middle of a line, because the power went, is read up to there.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import msgspec
from msgspec import Meta, Struct

from swarm_pz.config.values import check_densities
from swarm_pz.errors import CommandError, ProtocolError, RecordingError, SwarmError
from swarm_pz.play.commands import Command
from swarm_pz.play.forms import read_form
from swarm_pz.play.frames import Frame, decode_frame
from swarm_pz.play.game import LiveGame, TableConfig
from swarm_pz.play.protocol import MAX_MESSAGE_BYTES, ClientInfo, StrokeMessage, Timing, decode
from swarm_pz.play.recordings.folder import read_regular
from swarm_pz.simulator.spawn import check_seed

VERSION = 2
MOST_LINE_BYTES = 2 * MAX_MESSAGE_BYTES
"""Of a line: reading a longer one would hold up other threads."""
FRAME_TICKS = 3
"""Ticks between two recorded frames."""
SeatEvent = Literal["connected", "disconnected", "displaced", "hidden", "shown", "failed", "forfeit"]
Outcome = Literal["red", "blue", "draw", "stopped"]
EndedBy = Literal["capture", "time", "left", "server", "forfeit"]
Team = Annotated[int, Meta(ge=0, le=1)]
Tick = Annotated[int, Meta(ge=0, lt=2**32)]
Drone = Annotated[int, Meta(ge=0, lt=2**16)]
Number = Annotated[int, Meta(ge=0, lt=2**32)]
Size = Annotated[int, Meta(ge=0, lt=2**16)]


class _Line(Struct, omit_defaults=True):
    """A line of the file; names that a later version adds are passed over."""


class RecordedSeat(_Line):
    """Who sat in a seat when the game began: never a person's name, at most a label they chose."""

    kind: Literal["person", "program", "policy", "free"]
    policy: str = ""
    label: str = ""


class Origin(_Line):
    """The recorded game, and its moment, from which this one was played on."""

    recording: str
    tick: Tick
    lines: int
    """So many lines after the first are from there."""


class Header(_Line, tag="game"):
    """The first line."""

    version: int
    software: str
    started: str
    """In UTC, ISO 8601."""
    table: dict[str, Any]
    """The table's configuration, the rules among it."""
    seed: int
    red: RecordedSeat
    blue: RecordedSeat
    origin: Origin | None = None
    lesson: bool = False
    """It was a lesson, not a match."""


class CommandLine(_Line, tag="command"):
    """A command as it arrived, a density or of another kind; with ``strokes`` from a drawing, which it follows from."""

    team: Team
    number: Number
    density: list[list[float]] | None
    received_ms: float
    tick: Tick
    """When it arrived: a solve at this tick already counts it."""
    strokes: list[StrokeMessage] | None = None
    timing: Timing | None = None
    """Its sender's clock, and how far it is from the server's."""
    command: list[Any] | None = None
    """In place of a density: what the team's control system takes, nested as its space."""
    sender: str = ""
    """Of a command that an automatic response gave in the player's place: "auto:" and its policy, or "auto:saved".
    Of one that the player and a policy made together: "shared:" and that policy, with the number of the player's."""


class InForceLine(_Line, tag="in_force"):
    """The swarm follows a command from the solve at this tick on."""

    team: Team
    number: Number
    tick: Tick
    ms: float
    sender: str = ""


class PaintedLine(_Line, tag="painted"):
    """The sender's screen showed the first frame that the command had changed."""

    team: Team
    number: Number
    ms: float


class CapturedLine(_Line, tag="captured"):
    """A team took a drone."""

    tick: Tick
    drone: Drone
    team: Team


class FrameLine(_Line, tag="frame"):
    """Positions, velocities and teams: a frame as in the protocol, in base64."""

    tick: Tick
    data: str


class SeatLine(_Line, tag="seat"):
    """A connection came, went or changed, with what the client says about its screen; or a seat failed, and why."""

    team: Team
    event: SeatEvent
    ms: float
    client: ClientInfo | None = None
    reason: str = ""


class Delay(_Line):
    """A delay that was asked for, the median of what was got (null if there was nothing to delay), and of how many."""

    asked_ms: float
    got_ms: float | None
    count: int


class SeatDelays(_Line):
    """The delays of a seat: of its commands, and of the moments that it was shown."""

    command: Delay
    display: Delay


class EndLine(_Line, tag="end"):
    """How the game ended; "stopped" if nobody played it to its end."""

    outcome: Outcome
    tick: Tick
    sizes: tuple[Size, Size]
    ms: float
    ended_by: EndedBy
    """A game that a client had left when it ended is "left", however it ended."""
    delays: tuple[SeatDelays, SeatDelays] | None = None
    """Red's and blue's, where the table varied anything."""


EventLine = CommandLine | InForceLine | PaintedLine | CapturedLine | FrameLine | SeatLine | EndLine
L = TypeVar("L", bound=EventLine)

_decoder: msgspec.json.Decoder[Header | EventLine] = msgspec.json.Decoder(Header | EventLine)


def reason_of_end(outcome: Outcome, sizes: tuple[int, int], away: bool) -> EndedBy:
    """Return what ended a game with such teams, of which a client may have been away then."""
    if away:
        return "left"
    if outcome == "stopped":
        return "server"
    return "time" if outcome == "draw" or min(sizes) > 0 else "capture"


class Recording:
    """A recorded game.

    Attributes
    ----------
    name : str
    header : Header
    config : TableConfig
    events : list of EventLine
    """

    def __init__(self, name: str, header: Header, events: list[EventLine]) -> None:
        self.name, self.header, self.events = name, header, events
        try:
            self.config = TableConfig.from_dict(header.table)
            check_seed(header.seed)
        except (SwarmError, RecursionError) as error:
            reason = str(error)[:1000]
            raise RecordingError(f"{name} was played by rules that are not known here: {reason}") from error
        self._check_order()

    def _check_order(self) -> None:
        """Check that drones and ticks are the game's, that ticks follow each other, and that the end comes last."""
        latest, drones, limit = 0, self.config.game.num_drones, self.config.game.limit_ticks
        is_over = False
        for number, line in enumerate(self.events, 2):
            where = f"line {number} of {self.name}"
            if is_over:
                raise RecordingError(f"{where} comes after the game's end")
            is_over = isinstance(line, EndLine)
            if isinstance(line, CapturedLine) and line.drone >= drones:
                raise RecordingError(f"{where}: drone must be below {drones}, the drones of its game, got {line.drone}")
            if isinstance(line, PaintedLine | SeatLine):
                continue
            if line.tick < latest:
                raise RecordingError(f"{where}: tick must be {latest} or later, as before it, got {line.tick}")
            if line.tick > limit:
                raise RecordingError(f"{where}: tick must be at most {limit}, the game's time limit, got {line.tick}")
            latest = line.tick
        origin = self.header.origin
        if origin is not None and not 0 <= origin.lines <= len(self.events):
            raise RecordingError(f"line 1 of {self.name}: origin.lines must be at most {len(self.events)}")

    @classmethod
    def read(cls, path: Path) -> Recording:
        """Read a file, up to its last whole line.

        Raises
        ------
        RecordingError
            If it is not a recorded game, or corrupt: what it says cannot be, or its lines do not hold together.
        """
        header: Header | None = None
        events: list[EventLine] = []
        for number, line in enumerate(io.BytesIO(read_regular(path)), 1):
            where = f"line {number} of {path}"
            if not line.endswith(b"\n"):
                if events and isinstance(events[-1], EndLine):
                    raise RecordingError(f"{where} comes after the game's end")
                break
            if len(line) > MOST_LINE_BYTES:
                raise RecordingError(f"{where} must have at most {MOST_LINE_BYTES} bytes, got {len(line)}")
            try:
                decoded = decode(_decoder, line)
            except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
                # What is wrong may be quoted, however long it is.
                raise RecordingError(f"{where} is not one of a recorded game: {str(error)[:300]}") from error
            if isinstance(decoded, Header) != (header is None):
                raise RecordingError(f"{path} is not one recorded game: its first line alone must be of type 'game'")
            if not isinstance(decoded, Header):
                events.append(decoded)
            elif decoded.version != VERSION:
                raise RecordingError(f"{path} is of version {decoded.version}, expected {VERSION}")
            else:
                header = decoded
        if header is None:
            raise RecordingError(f"{path} is not a recorded game: it is empty")
        # A name that is no text is written as text: tables and messages hold it.
        return cls(path.name.encode(errors="backslashreplace").decode(), header, events)

    def of(self, kind: type[L]) -> list[L]:
        """Return the events of one kind."""
        return [line for line in self.events if isinstance(line, kind)]

    @property
    def end(self) -> EndLine | None:
        """How it ended; None if the recording breaks off."""
        return next(iter(self.of(EndLine)), None)

    @property
    def live(self) -> list[EventLine]:
        """The lines of this game itself, without those of one that it was taken over from."""
        origin = self.header.origin
        return self.events[origin.lines if origin is not None else 0 :]

    @property
    def away(self) -> set[int]:
        """The teams whose client was away at the end."""
        seats = [line for line in self.live if isinstance(line, SeatLine)]
        last = {line.team: line.event for line in seats if line.event in ("connected", "disconnected")}
        return {team for team, event in last.items() if event == "disconnected"}

    @property
    def forfeit(self) -> str:
        """How a control system failed, so that its side lost; empty if none did."""
        return next((line.reason for line in self.of(SeatLine) if line.event == "forfeit"), "")

    @cached_property
    def last_tick(self) -> int:
        """The last tick that it knows of."""
        known = CapturedLine | FrameLine | EndLine | InForceLine
        return max((line.tick for line in self.events if isinstance(line, known)), default=0)

    def in_force(self) -> list[tuple[int, Command]]:
        """Return the commands that were followed, each with its tick."""
        followed = []
        arrived: dict[tuple[int, str, int], Command] = {}
        commands = iter(self.commands)
        # In order: a client that comes back may count its commands from the start again.
        for line in self.events:
            if isinstance(line, CommandLine):
                arrived[line.team, line.sender, line.number] = next(commands)
            elif isinstance(line, InForceLine):
                command = arrived.get((line.team, line.sender, line.number))
                if command is None:
                    number = f"command {line.number} of team {line.team}"
                    raise RecordingError(f"{self.name} lacks {number}, which was followed")
                followed.append((line.tick, command))
        return followed

    @cached_property
    def commands(self) -> list[Command]:
        """All commands, in order."""
        return [self._command(line) for line in self.of(CommandLine)]

    def _command(self, line: CommandLine) -> Command:
        game, name = self.config.game, f"command {line.number} of team {line.team}"
        cells, system = game.command_cells, game.team_systems[line.team]
        try:
            if (line.density is None) == (line.command is None):
                raise CommandError(f"{name} must be a density or of another kind")
            if line.density is not None:
                kind, values = "density", check_densities(line.density, (cells, cells), name)
            else:
                kind, values = system.takes, read_form(line.command, system, game, name)
        except CommandError as error:
            raise RecordingError(f"{self.name} is corrupt: {error}") from error
        return Command(line.team, line.number, values, kind, line.sender)

    def until(self, tick: int) -> list[EventLine]:
        """Return what of the game itself had happened before the solve at a tick: commands, captures, frames."""
        kept: list[EventLine] = []
        for line in self.events:
            if isinstance(line, CommandLine | InForceLine | CapturedLine | FrameLine):
                if line.tick > tick or (line.tick == tick and isinstance(line, InForceLine)):
                    break
                kept.append(line)
        return kept

    def frames(self) -> Iterator[Frame]:
        """Return the recorded frames, one by one."""
        for line in self.of(FrameLine):
            where = f"{self.name}: the frame at tick {line.tick}"
            try:
                frame = decode_frame(base64.b64decode(line.data, validate=True))
            except (ProtocolError, ValueError) as error:
                raise RecordingError(f"{where} is corrupt: {error}") from error
            if len(frame.teams) != self.config.game.num_drones:
                raise RecordingError(f"{where} has another number of drones")
            if frame.tick != line.tick:
                raise RecordingError(f"{where} shows tick {frame.tick}")
            yield frame


@dataclass(frozen=True, kw_only=True)
class Moment:
    """A moment of a recorded game, to play on from: the game at that moment, and the recording's lines up to there.

    `sizes` are the drones of red and blue, once a second since the start, which `seed` decides.
    """

    game: LiveGame
    seed: int
    sizes: list[tuple[int, int]]
    origin: Origin
    past: list[EventLine]


def frame_line(frame: bytes, tick: int) -> FrameLine:
    """Return a frame as a line."""
    return FrameLine(tick=tick, data=base64.b64encode(frame).decode())
