"""What a seat's client is shown, where an experimenter varies that: later, less often, or not all of it.

What is hidden is not sent: who reads the socket sees no more than who looks at the page. What nothing is varied of
goes to the connection as it is.
"""

from __future__ import annotations

import functools
from dataclasses import replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import BLUE, RED, TICKS_PER_SECOND
from swarm_pz.play import protocol
from swarm_pz.play.factors import FULL_RATE, Factors
from swarm_pz.play.frames import TARGET, Frame, decode_frame, encode_frame
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.delays import DelayLine, Measured


class SeatView:
    """What the client of a seat is shown; it is sent to as its connection would be.

    Parameters
    ----------
    connection : Connection
    team : int
    factors : Factors
    speed : float
        Seconds of game a second.

    Attributes
    ----------
    measured : Measured or None
        What notes how much later moments were handed to the connection than they were made.
    """

    def __init__(self, connection: Connection, team: int, factors: Factors, speed: float) -> None:
        self._connection, self._factors = connection, factors
        self._line = DelayLine(factors.display_delay_ms)
        self._hidden_team = (BLUE if team == RED else RED) if "opponents" in factors.hide else None
        self._ticks_a_second = TICKS_PER_SECOND * speed
        shows_less = factors.frame_rate < FULL_RATE or bool({"opponents", "ground"} & {*factors.hide})
        self._is_as_made = not shows_less and not factors.display_delay_ms
        self._fields: NDArray[np.uint8] | None = None
        """Capture fields that came in moments that were left out."""
        self._left_out: tuple[Frame, int] | None = None
        """The latest moment, if it was left out."""
        self.measured: Measured | None = None

    def send(self, message: protocol.ServerMessage) -> None:
        """Send a message; a game's end comes after its last moment."""
        if isinstance(message, protocol.RoomState):
            if message.phase == "over" and self._left_out is not None:
                self._show(*self._left_out)
            message = self._later(message)
        self._line.put(functools.partial(self._connection.send, message))

    def _later(self, room: protocol.RoomState) -> protocol.RoomState:
        """Return a room's state as it is now, for when it is shown: its countdown is over as much later."""
        starts = room.starts_ms + self._line.delay_ms if room.starts_ms is not None else None
        return msgspec.structs.replace(room, starts_ms=starts, sizes=[*room.sizes])

    def send_bytes(self, data: bytes) -> None:
        """Send a target, unless it is hidden, or a moment that must arrive."""
        if data[0] == TARGET:
            if "target" in self._factors.hide:
                return
        elif not self._is_as_made:
            data = self._seen(decode_frame(data))
        self._line.put(functools.partial(self._connection.send_bytes, data))

    def show(self, data: bytes, sequence: int) -> None:
        """Show a moment, if it is one of those that are shown."""
        if self._is_as_made:
            self._pass_on(data, sequence)
            return
        frame = decode_frame(data)
        if self._is_due(frame.tick):
            self._show(frame, sequence)
        else:
            self._left_out = frame, sequence
            self._fields = frame.fields if frame.fields is not None else self._fields

    def _is_due(self, tick: int) -> bool:
        """Whether a moment is shown: evenly so many a second."""
        rate, ticks = self._factors.frame_rate, self._ticks_a_second
        return rate == FULL_RATE or int(tick * rate / ticks) > int((tick - 1) * rate / ticks)

    def _show(self, frame: Frame, sequence: int) -> None:
        self._left_out = None
        self._pass_on(self._seen(frame), sequence)

    def _pass_on(self, data: bytes, sequence: int) -> None:
        self._line.put(functools.partial(self._connection.show, data, sequence), self.measured)

    def _seen(self, frame: Frame) -> bytes:
        """Return a moment as this seat sees it: by its clock it is of when it is shown."""
        fields = frame.fields if frame.fields is not None else self._fields
        self._fields = None
        return encode_frame(
            replace(
                frame,
                server_ms=frame.server_ms + self._line.delay_ms,
                hidden=self._hidden_team,
                fields=None if "ground" in self._factors.hide else fields,
            )
        )

    def close(self) -> None:
        """Show nothing more of what waits: the client is elsewhere, or gone."""
        self._line.close()
