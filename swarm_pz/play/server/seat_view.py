"""What a seat's client is shown; an experimenter may delay it, lower its frame rate, or hide parts of it."""

from __future__ import annotations

import functools
from dataclasses import replace

import msgspec
import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.play import protocol
from swarm_pz.play.factors import FULL_RATE, Factors
from swarm_pz.play.frames import TARGET, Frame, decode_frame, encode_frame
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.delays import DelayLine, Measured


class SeatView:
    """The view of a seat's client, at a speed in seconds of game per second; it sends as a `Connection` does.

    - `measured`: delays of frames.
    """

    def __init__(self, connection: Connection, team: int, factors: Factors, speed: float) -> None:
        self._connection, self._factors = connection, factors
        self._line = DelayLine(factors.display_delay_ms)
        self._hidden_team = 1 - team if "opponents" in factors.hide else None
        self._ticks_a_second = TICKS_PER_SECOND * speed
        shows_less = factors.frame_rate < FULL_RATE or bool({"opponents", "ground"} & {*factors.hide})
        self._is_plain = not shows_less and not factors.display_delay_ms
        self._fields: NDArray[np.uint8] | None = None  # of frames that were left out
        self._left_out: tuple[Frame, int] | None = None  # the latest frame
        self.measured: Measured | None = None

    def send(self, message: protocol.ServerMessage | bytes) -> None:
        """Send a message, a frame that must arrive, or a target unless it is hidden.

        A game's last frame comes before its end.
        """
        if isinstance(message, bytes):
            if message[0] == TARGET and "target" in self._factors.hide:
                return
            if message[0] != TARGET and not self._is_plain:
                message = self._seen(decode_frame(message))
        elif isinstance(message, protocol.RoomState):
            if message.phase == "over" and self._left_out is not None:
                self._show(*self._left_out)
            # A copy, since the state may change meanwhile; the countdown ends later by the delay.
            starts = message.starts_ms + self._line.delay_ms if message.starts_ms is not None else None
            message = msgspec.structs.replace(message, starts_ms=starts, sizes=[*message.sizes])
        self._line.put(functools.partial(self._connection.send, message))

    def show(self, data: bytes, sequence: int) -> None:
        """Show a frame, if it is due at the frame rate."""
        if self._is_plain:
            self._pass_on(data, sequence)
            return
        frame, rate, ticks = decode_frame(data), self._factors.frame_rate, self._ticks_a_second
        if rate == FULL_RATE or int(frame.tick * rate / ticks) > int((frame.tick - 1) * rate / ticks):
            self._show(frame, sequence)
        else:
            self._left_out = frame, sequence
            self._fields = frame.fields if frame.fields is not None else self._fields

    def _show(self, frame: Frame, sequence: int) -> None:
        self._left_out = None
        self._pass_on(self._seen(frame), sequence)

    def _pass_on(self, data: bytes, sequence: int) -> None:
        self._line.put(functools.partial(self._connection.show, data, sequence), self.measured)

    def _seen(self, frame: Frame) -> bytes:
        """Return a frame as this seat sees it, with the time when it is shown."""
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
        """Drop waiting messages and frames."""
        self._line.close()
