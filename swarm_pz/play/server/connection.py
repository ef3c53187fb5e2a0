"""One client's connection: messages in order, fresh frames, limits on what it sends."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from typing import Literal

from starlette.websockets import WebSocket, WebSocketDisconnect

from swarm_pz.errors import SwarmError
from swarm_pz.play import protocol
from swarm_pz.play.server.rate_limit import RateLimit

FRAMES_IN_FLIGHT = 12
"""Unacknowledged frames after which no more are sent."""
_MOST_WAITING = 256
"""Messages that may wait for a client before it is closed."""
LONG, MOST_LONG_PER_SECOND = 2048, 4
"""Characters of a long message, and such messages a second, as they take long to read, render and record."""
_MOST_REFUSED, _PATIENCE_S = 100, 10.0
"""Refusals within some seconds after which a client is closed."""


class RefusedError(SwarmError, ValueError):
    """A client's message is not obeyed; `code` is that of the protocol's `Refused`."""

    def __init__(self, code: protocol.Reason, reason: str) -> None:
        super().__init__(reason)
        self.code = code


class Connection:
    """The accepted socket of a client at an address; sending never waits.

    All messages arrive, in order. Of the frames, only the newest waits while the client is behind.
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
        self._received = RateLimit(protocol.MAX_MESSAGES_PER_SECOND, 1.0)
        self._long = RateLimit(MOST_LONG_PER_SECOND, 1.0)
        self._refused = RateLimit(_MOST_REFUSED - 1, _PATIENCE_S)
        self.closed = False
        self._reason = ""

    # --- sending ----------------------------------------------------------------------------------

    def send(self, message: protocol.ServerMessage | bytes) -> None:
        """Send a message, or bytes that must arrive."""
        if len(self._waiting) >= _MOST_WAITING:
            self.close(f"too slow: {_MOST_WAITING} messages wait to be received")
        if not self.closed:
            self._waiting.append(message if isinstance(message, bytes) else protocol.encode(message))
            self._wake.set()

    def show(self, frame: bytes, sequence: int) -> None:
        """Send a frame as soon as there is room for it, unless a newer one comes first."""
        if not self.closed:
            self._frame = frame, sequence
            if len(self._in_flight) < FRAMES_IN_FLIGHT:
                self._wake.set()

    def refuse(self, refusal: protocol.Refused) -> None:
        """Send a refusal; close the connection after too many."""
        self.send(refusal)
        if not self._refused.take():
            self.close(f"{_MOST_REFUSED} messages were refused within {_PATIENCE_S:g} seconds")

    def close(self, reason: str = "") -> None:
        """Close with a reason; waiting messages are dropped."""
        self._reason = self._reason or reason
        self.closed = True
        self._waiting.clear()
        self._frame = None
        self._wake.set()

    async def run(self) -> None:
        """Send waiting messages and frames until the connection is closed."""
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

    # --- receiving --------------------------------------------------------------------------------

    def acknowledge(self, sequence: int) -> bool:
        """Mark a frame and all earlier ones as received; return true unless they were already."""
        is_news = sequence in self._in_flight
        while sequence in self._in_flight:
            self._in_flight.popleft()
        if self._frame is not None:
            self._wake.set()
        return is_news

    def may_send(self, size: int) -> bool:
        """Count a message if it is long; return true within the limit."""
        self.last_heard = time.monotonic()
        return size <= LONG or self._long.take()

    def may_speak(self) -> bool:
        """Count a message; return true within the limit."""
        return self._received.take()
