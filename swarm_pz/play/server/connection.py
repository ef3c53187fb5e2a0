"""One client's connection: what it is sent, in which order, and what is left out when it is slow."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from typing import Literal

from starlette.websockets import WebSocket, WebSocketDisconnect

from swarm_pz.errors import SwarmError
from swarm_pz.play import protocol
from swarm_pz.play.server.budget import Budget

FRAMES_IN_FLIGHT = 12
"""Frames that a client may leave unacknowledged; then it is sent none until it answers."""
_MOST_WAITING = 256
"""Messages that may wait for a client; then it is closed."""
_BYTES_PER_SECOND = 2 * protocol.MAX_MESSAGE_BYTES
"""What a client may say in a second, and at once: reading, rendering and writing down take as long as it is large."""
SHORT = 256
"""Bytes of a message that is not counted by its bytes: so no acknowledgement is lost to a drawing."""
_MOST_REFUSED, _PATIENCE_S = 100, 10.0
"""So many refusals in so many seconds, and a client is closed."""


class RefusedError(SwarmError, ValueError):
    """What a client asked for is not done.

    - `code`: one of those of the protocol's `Refused`.
    - `recording`: the recorded game that there is instead.
    """

    def __init__(self, code: protocol.Reason, reason: str, recording: str | None = None) -> None:
        super().__init__(reason)
        self.code, self.recording = code, recording


class Connection:
    """A client at an address, by an accepted socket; whoever sends to it never waits.

    All messages arrive, in order. Of frames only the newest waits, and it is left out while the client is behind.
    """

    def __init__(self, socket: WebSocket, address: str = "") -> None:
        self.address = address
        self.last_heard = time.monotonic()
        self.kind: Literal["person", "program"] = "program"
        self.client: protocol.ClientInfo | None = None
        self._socket = socket
        self._waiting: deque[str | bytes] = deque()
        self._frame: tuple[bytes, int] | None = None
        self._in_flight: deque[int] = deque()
        self._wake = asyncio.Event()
        self._received: deque[float] = deque(maxlen=protocol.MAX_MESSAGES_PER_SECOND)
        self._refused: deque[float] = deque(maxlen=_MOST_REFUSED)
        self._bytes = Budget(_BYTES_PER_SECOND, _BYTES_PER_SECOND, self.last_heard)
        self.closed = False
        self._reason = ""

    # --- what it is sent --------------------------------------------------------------------------

    def send(self, message: protocol.ServerMessage) -> None:
        """Send a message."""
        self._put(protocol.encode(message))

    def send_bytes(self, data: bytes) -> None:
        """Send something binary that must arrive."""
        self._put(data)

    def _put(self, data: str | bytes) -> None:
        if len(self._waiting) >= _MOST_WAITING:
            self.close(f"too slow: {_MOST_WAITING} messages wait to be received")
        if not self.closed:
            self._waiting.append(data)
            self._wake.set()

    def show(self, frame: bytes, sequence: int) -> None:
        """Send a frame as soon as there is room for it, unless a newer one comes first."""
        if not self.closed:
            self._frame = frame, sequence
            if len(self._in_flight) < FRAMES_IN_FLIGHT:
                self._wake.set()

    def refuse(self, refusal: protocol.Refused) -> None:
        """Send a refusal; a client that is refused again and again is closed."""
        self.send(refusal)
        now = time.monotonic()
        self._refused.append(now)
        if len(self._refused) == _MOST_REFUSED and now - self._refused[0] < _PATIENCE_S:
            self.close(f"{_MOST_REFUSED} messages were refused within {_PATIENCE_S:g} seconds")

    def close(self, reason: str = "") -> None:
        """Send nothing more, and say why; what waits is dropped."""
        self._reason = self._reason or reason
        self.closed = True
        self._waiting.clear()
        self._frame = None
        self._wake.set()

    async def run(self) -> None:
        """Send what there is to send until the connection is closed."""
        try:
            while not self.closed:
                await self._wake.wait()
                self._wake.clear()
                while self._waiting:
                    data = self._waiting.popleft()
                    await (self._socket.send_text(data) if isinstance(data, str) else self._socket.send_bytes(data))
                if self._frame is not None and len(self._in_flight) < FRAMES_IN_FLIGHT:
                    frame, sequence = self._frame
                    self._frame = None
                    self._in_flight.append(sequence)
                    await self._socket.send_bytes(frame)
            await self._socket.close(code=1008, reason=self._reason)
        except (WebSocketDisconnect, RuntimeError, OSError):
            self.closed = True

    # --- what it says -----------------------------------------------------------------------------

    def acknowledge(self, sequence: int) -> bool:
        """Note that this frame, and all before it, have arrived; return whether that was news."""
        is_news = sequence in self._in_flight
        while sequence in self._in_flight:
            self._in_flight.popleft()
        if self._frame is not None:
            self._wake.set()
        return is_news

    def may_send(self, size: int) -> bool:
        """Count a message's bytes, and return whether they are within what a client may send in a second."""
        self.last_heard = time.monotonic()
        return size <= SHORT or self._bytes.take(size, self.last_heard)

    def may_speak(self) -> bool:
        """Count a message, and return whether it is within what a client may send in a second."""
        now = time.monotonic()
        if len(self._received) == self._received.maxlen and now - self._received[0] < 1.0:
            return False
        self._received.append(now)
        return True
