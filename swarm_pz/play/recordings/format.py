"""Recorded games: a line of JSON for everything that happened, written as it happens.

The first line holds all that a game needs to be played again; the rest are events, in order. All times
named ``ms`` are milliseconds on the server's clock since the game began. A file that ends in the middle
of a line, because the power went, is read up to there.
"""

from __future__ import annotations

import base64
import binascii
import re
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from swarm_pz.errors import CommandError, ProtocolError, RecordingError, SwarmError
from swarm_pz.play.frames import Frame, decode_frame
from swarm_pz.play.game import Command, TableConfig
from swarm_pz.play.protocol import ClientInfo, StrokeMessage, Timing
from swarm_pz.simulator.commands import check_densities

VERSION = 1
SUFFIX = ".jsonl"
FRAME_TICKS = 3
"""Ticks between two recorded frames."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}\.jsonl")
SeatEvent = Literal["connected", "disconnected", "displaced", "hidden", "shown", "failed"]
Team = Annotated[int, Meta(ge=0, le=1)]
Tick = Annotated[int, Meta(ge=0)]


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
    config_hash: str
    seed: int
    red: RecordedSeat
    blue: RecordedSeat
    origin: Origin | None = None
    rules_hash: str = ""
    """Of the game that the table plays; empty in files of earlier versions."""


class CommandLine(_Line, tag="command"):
    """A command as it arrived; with ``strokes`` from a drawing, which ``density`` follows from."""

    team: Team
    number: int
    density: list[list[float]]
    received_ms: float
    strokes: list[StrokeMessage] | None = None
    timing: Timing | None = None
    """Its sender's clock, and how far it is from the server's."""


class InForceLine(_Line, tag="in_force"):
    """The swarm follows a command from the solve at this tick on."""

    team: Team
    number: int
    tick: Tick
    ms: float


class PaintedLine(_Line, tag="painted"):
    """The sender's screen showed the first frame that the command had changed."""

    team: Team
    number: int
    ms: float


class CapturedLine(_Line, tag="captured"):
    """A team took a drone."""

    tick: Tick
    drone: int
    team: Team


class FrameLine(_Line, tag="frame"):
    """Positions, velocities and teams: a frame as in the protocol, in base64."""

    tick: Tick
    data: str


class SeatLine(_Line, tag="seat"):
    """A connection came, went or changed; with what the client says about its screen."""

    team: Team
    event: SeatEvent
    ms: float
    client: ClientInfo | None = None
    reason: str = ""


class EndLine(_Line, tag="end"):
    """How the game ended; "stopped" if nobody played it to its end."""

    outcome: Literal["red", "blue", "draw", "stopped"]
    tick: Tick
    sizes: tuple[int, int]
    ms: float


EventLine = CommandLine | InForceLine | PaintedLine | CapturedLine | FrameLine | SeatLine | EndLine
L = TypeVar("L", bound=EventLine)

_decoder: msgspec.json.Decoder[Header | EventLine] = msgspec.json.Decoder(Header | EventLine)
_encoder = msgspec.json.Encoder()


def checked_name(name: str) -> str:
    """Return the name of a recording, if it is one and no path.

    Raises
    ------
    RecordingError
        If it is not a plain file name that ends in ``.jsonl``.
    """
    if not _NAME.fullmatch(name) or ".." in name:
        raise RecordingError(f"a recording's name must be letters, digits and . _ - with {SUFFIX}, got {name[:80]!r}")
    return name


class Recorder:
    """Writes a game down as it is played; a game goes on even if it can no longer be written down.

    Parameters
    ----------
    path : Path
        A file that is not there yet.
    header : Header

    Attributes
    ----------
    fault : str
        Why the recording broke off; empty if it did not.

    Raises
    ------
    OSError
        If the file cannot be made.
    """

    def __init__(self, path: Path, header: Header) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path = path
        self.fault = ""
        self._file = path.open("xb", buffering=0)
        self._waiting = [_encoder.encode(header)]
        self.flush()

    def write(self, line: EventLine) -> None:
        """Append a line."""
        if not self._file.closed:
            self._waiting.append(_encoder.encode(line))

    def flush(self) -> None:
        """Hand what was written to the system: a process that is killed loses what came after."""
        if self._waiting and not self._file.closed:
            try:
                self._file.write(b"\n".join(self._waiting) + b"\n")
            except OSError as error:
                self.fault = f"the recording breaks off: {error.strerror}"
                self._file.close()
            self._waiting = []

    def close(self) -> None:
        """Finish the file."""
        self.flush()
        self._file.close()


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
        except SwarmError as error:
            raise RecordingError(f"{name} was played by rules that are not known here: {error}") from error
        is_known = header.rules_hash in ("", self.config.game.rules_hash)
        if not is_known or not self.config.has_hash(header.config_hash):
            raise RecordingError(f"{name} says other rules than those whose hash it holds; it was changed")
        if any(line.drone >= self.config.game.num_drones for line in self.of(CapturedLine)):
            raise RecordingError(f"{name} tells of a drone that its game does not have")

    @classmethod
    def read(cls, path: Path) -> Recording:
        """Read a file, up to its last whole line.

        Raises
        ------
        RecordingError
            If it is not a recorded game, or corrupt.
        """
        try:
            text = path.read_bytes()
        except OSError as error:
            raise RecordingError(f"{path} cannot be read: {error.strerror}") from error
        header: Header | None = None
        events: list[EventLine] = []
        for number, line in enumerate(text[: text.rfind(b"\n") + 1].splitlines(), 1):
            try:
                decoded = _decoder.decode(line)
            except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
                raise RecordingError(f"line {number} of {path} is not one of a recorded game: {error}") from error
            if isinstance(decoded, Header) != (header is None):
                raise RecordingError(f"{path} is not one recorded game: its first line alone must be of type 'game'")
            if isinstance(decoded, Header):
                header = decoded
                if header.version != VERSION:
                    raise RecordingError(f"{path} is of version {header.version}, expected {VERSION}")
            else:
                events.append(decoded)
        if header is None:
            raise RecordingError(f"{path} is not a recorded game: it is empty")
        return cls(path.name, header, events)

    def of(self, kind: type[L]) -> list[L]:
        """Return the events of one kind."""
        return [line for line in self.events if isinstance(line, kind)]

    @property
    def end(self) -> EndLine | None:
        """How it ended; None if the recording breaks off."""
        ends = self.of(EndLine)
        return ends[-1] if ends else None

    @cached_property
    def last_tick(self) -> int:
        """The last tick that it knows of."""
        return max(
            (line.tick for line in self.events if isinstance(line, FrameLine | EndLine | InForceLine)), default=0
        )

    def in_force(self) -> list[tuple[int, Command]]:
        """Return the commands that were followed, each with its tick."""
        followed = []
        arrived: dict[tuple[int, int], Command] = {}
        # In order: a client that comes back may count its commands from the start again.
        for line in self.events:
            if isinstance(line, CommandLine):
                density = self._density(line)
                arrived[line.team, line.number] = Command(line.team, line.number, density)
            elif isinstance(line, InForceLine):
                command = arrived.get((line.team, line.number))
                if command is None:
                    raise RecordingError(
                        f"{self.name} lacks command {line.number} of team {line.team}, which was followed"
                    )
                followed.append((line.tick, command))
        return followed

    def _density(self, line: CommandLine) -> NDArray[np.float64]:
        cells = self.config.game.command_cells
        try:
            return check_densities(line.density, (cells, cells), f"command {line.number} of team {line.team}")
        except CommandError as error:
            raise RecordingError(f"{self.name} is corrupt: {error}") from error

    def until(self, tick: int) -> list[EventLine]:
        """Return what of the game itself had happened before the solve at a tick: commands, captures, frames."""
        kept: list[EventLine] = []
        for line in self.events:
            if isinstance(line, InForceLine) and line.tick >= tick:
                break
            if isinstance(line, CapturedLine | FrameLine) and line.tick > tick:
                break
            if isinstance(line, CommandLine | InForceLine | CapturedLine | FrameLine):
                kept.append(line)
        return kept

    def frames(self) -> Iterator[Frame]:
        """Return the recorded frames, one by one."""
        for line in self.of(FrameLine):
            try:
                frame = decode_frame(base64.b64decode(line.data))
            except (ProtocolError, binascii.Error) as error:
                raise RecordingError(f"{self.name}: the frame at tick {line.tick} is corrupt: {error}") from error
            if len(frame.teams) != self.config.game.num_drones:
                raise RecordingError(f"{self.name}: the frame at tick {line.tick} has another number of drones")
            yield frame


def frame_line(frame: bytes, tick: int) -> FrameLine:
    """Return a frame as a line."""
    return FrameLine(tick=tick, data=base64.b64encode(frame).decode())
