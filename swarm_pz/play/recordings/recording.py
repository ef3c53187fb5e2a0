"""A recorded game: a header with its start and its rules, and the log of its messages, a line of JSON each.

The messages are those of `swarm_pz.play.protocol`. An incomplete last line, as after a power cut, is ignored. A game
without the message `end` is unfinished.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config.values import check_densities
from swarm_pz.errors import CommandError, ProtocolError, RecordingError, SwarmError
from swarm_pz.play.commands import Command
from swarm_pz.play.forms import read_form
from swarm_pz.play.frames import Frame, decode_frame
from swarm_pz.play.game import SPEED_LIMIT, LiveGame, TableConfig
from swarm_pz.play.protocol import (
    SUBPROTOCOL,
    CapturedMessage,
    EndedBy,
    EndMessage,
    FrameMessage,
    Header,
    InForceMessage,
    LogMessage,
    Outcome,
    PosesMessage,
    SeatCommand,
    SeatMessage,
    decode_log,
)
from swarm_pz.play.recordings.folder import read_regular
from swarm_pz.simulator.spawn import check_seed

FRAME_TICKS = 3
"""Ticks between two recorded frames."""
_OF_GAME = (SeatCommand, InForceMessage, CapturedMessage, FrameMessage, PosesMessage, EndMessage)
"""Messages with a tick."""
L = TypeVar("L", bound=LogMessage)


def reason_of_end(outcome: Outcome, sizes: tuple[int, int], away: bool) -> EndedBy:
    """Return the reason of a game's end; `away` is True if a client was absent then."""
    if away:
        return "left"
    if outcome == "stopped":
        return "server"
    return "time" if outcome == "draw" or min(sizes) > 0 else "capture"


class Recording:
    """A recorded game: the name of its file, its header, its configuration, and its log."""

    def __init__(self, name: str, header: Header, log: list[LogMessage]) -> None:
        self.name, self.header, self.log = name, header, log
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
        for number, line in enumerate(self.log, 2):
            where = f"line {number} of {self.name}"
            if number > 2 and isinstance(self.log[number - 3], EndMessage):
                raise RecordingError(f"{where} comes after the game's end")
            if isinstance(line, CapturedMessage) and line.drone >= drones:
                raise RecordingError(f"{where}: drone must be below {drones}, the drones of its game, got {line.drone}")
            if isinstance(line, _OF_GAME):
                if not latest <= line.tick <= limit:
                    raise RecordingError(
                        f"{where}: tick must be from {latest}, the tick before it, to {limit}, the game's time limit, "
                        f"got {line.tick}"
                    )
                latest = line.tick

    @classmethod
    def read(cls, path: Path) -> Recording:
        """Read a file, up to its last whole line; raise RecordingError if it cannot be a recorded game."""
        header: Header | None = None
        log: list[LogMessage] = []
        for number, line in enumerate(io.BytesIO(read_regular(path)), 1):
            where = f"line {number} of {path}"
            if not line.endswith(b"\n"):
                if log and isinstance(log[-1], EndMessage):
                    raise RecordingError(f"{where} comes after the game's end")
                break
            try:
                message = decode_log(line)
            except ProtocolError as error:
                raise RecordingError(f"{where} is not one of a recorded game: {error}") from error
            if isinstance(message, Header) != (header is None):
                raise RecordingError(f"{path} is not one recorded game: its first line alone must be of type 'game'")
            if not isinstance(message, Header):
                log.append(message)
            elif message.protocol != SUBPROTOCOL:
                raise RecordingError(f"{path} is of protocol {message.protocol[:80]!r}, expected {SUBPROTOCOL!r}")
            else:
                header = message
        if header is None:
            raise RecordingError(f"{path} is not a recorded game: it is empty")
        # A name that is not valid Unicode is escaped, since tables and messages contain it.
        return cls(path.name.encode(errors="backslashreplace").decode(), header, log)

    def of(self, kind: type[L]) -> list[L]:
        """Return the messages of one kind."""
        return [line for line in self.log if isinstance(line, kind)]

    @property
    def end(self) -> EndMessage | None:
        """The end of the game; None if the recording breaks off."""
        return next(iter(self.of(EndMessage)), None)

    @property
    def is_somebody_away(self) -> bool:
        """True if a player's client was away at the end."""
        last = {line.seat: line.event for line in self.of(SeatMessage) if line.event in ("connected", "disconnected")}
        return "disconnected" in last.values()

    @property
    def forfeit(self) -> str:
        """The fault of a control system that made its side lose; empty if there was none."""
        return next((line.reason for line in self.of(SeatMessage) if line.event == "forfeit"), "")

    @cached_property
    def last_tick(self) -> int:
        """The last tick of a frame, a capture, a command in force or the end; else 0."""
        known = CapturedMessage | FrameMessage | EndMessage | InForceMessage
        return max((line.tick for line in self.log if isinstance(line, known)), default=0)

    def in_force(self) -> list[tuple[int, Command]]:
        """Return the commands that came into force, each with its tick."""
        followed = []
        arrived: dict[tuple[int, str, int], Command] = {}
        commands = iter(self.commands)
        # In order, since a client that comes back may count its commands from the start again.
        for line in self.log:
            if isinstance(line, SeatCommand):
                arrived[line.team, line.sender, line.number] = next(commands)
            elif isinstance(line, InForceMessage):
                command = arrived.get((line.team, line.sender, line.number))
                if command is None:
                    name = f"command {line.number} of {line.seat}"
                    raise RecordingError(f"{self.name} lacks {name}, which came into force")
                followed.append((line.tick, command))
        return followed

    @cached_property
    def commands(self) -> list[Command]:
        """All commands, in order."""
        return [self._command(line) for line in self.of(SeatCommand)]

    def _command(self, line: SeatCommand) -> Command:
        game, name = self.config.game, f"command {line.number} of {line.seat}"
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

    @cached_property
    def poses(self) -> dict[int, NDArray[np.float32]]:
        """The poses of robots (N, 4) by tick; empty if the game was simulated."""
        by_tick, drones = {}, self.config.game.num_drones
        low, high = (0.0, 0.0, -SPEED_LIMIT, -SPEED_LIMIT), (1.0, 1.0, SPEED_LIMIT, SPEED_LIMIT)
        for line in self.of(PosesMessage):
            poses = np.frombuffer(line.data, "<f4") if len(line.data) == 16 * drones else np.full(4, np.inf)
            poses = poses.reshape(-1, 4)
            if not (np.isnan(poses) | ((poses >= low) & (poses <= high))).all():
                raise RecordingError(f"{self.name}: poses at tick {line.tick} must be of {drones} drones on the map")
            by_tick[line.tick] = poses
        return by_tick

    def start(self) -> LiveGame:
        """Return the game at its start."""
        return LiveGame(self.config, self.header.seed, robots=bool(self.poses))

    def frames(self) -> Iterator[Frame]:
        """Yield the recorded frames."""
        for line in self.of(FrameMessage):
            where = f"{self.name}: the frame at tick {line.tick}"
            try:
                frame = decode_frame(line.data)
            except ProtocolError as error:
                raise RecordingError(f"{where} is corrupt: {error}") from error
            if len(frame.teams) != self.config.game.num_drones:
                raise RecordingError(f"{where} has another number of drones")
            if frame.tick != line.tick:
                raise RecordingError(f"{where} shows tick {frame.tick}")
            yield frame
