"""Connections below messages: what a peer does there reaches no application, and keeps nobody waiting."""

from __future__ import annotations

import asyncio
import time
from typing import Any

import h11
from uvicorn.protocols.http.h11_impl import H11Protocol
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol

from swarm_pz.play.server.budget import Account, Accounts, Budget

_MOST_PARTS, _PARTS_PER_SECOND = 100.0, 10.0
"""Pings, pongs and parts of messages that a peer may send, at once and in a second: browsers send hardly any."""
_READ_AT_ONCE = 1024
RECEIVED_AT_ONCE = 16 * 1024
"""Bytes that the system keeps of what a peer sent: all of it is read at once, and in six bytes is a ping."""
MOST_LINES = 256
"""Of what a request begins with: thousands of headers are work."""
MOST_SILENT, MOST_SILENT_OF_ADDRESS = 256, 64
"""Connections that have asked for nothing yet; beyond these, the oldest is closed. Browsers open some ahead."""
ACCEPTED_AT_ONCE = 32
"""Connections that are taken in one turn of the event loop: games wait meanwhile."""
REQUEST_S = 10.0
"""Seconds within which a connection must have asked for something whole, and then again and again."""


class BoundedHTTP(H11Protocol):
    """A connection that is closed if no whole request comes; uvicorn itself waits for the first one for ever."""

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Close the oldest silent connections if there are too many, and watch whether requests come."""
        super().connection_made(transport)
        accounts: Accounts = self.app_state["accounts"]
        self._account, self._silent = accounts.of(self.client), accounts.silent
        self._lines = 0
        self._silent[self] = address = self.client[0] if self.client else ""
        neighbours = [one for one, where in self._silent.items() if where == address]
        if len(neighbours) > MOST_SILENT_OF_ADDRESS or len(self._silent) > MOST_SILENT:
            oldest = neighbours[0] if len(neighbours) > MOST_SILENT_OF_ADDRESS else next(iter(self._silent))
            del self._silent[oldest]
            oldest.transport.abort()
        self.loop.call_later(REQUEST_S, self._look, None)

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self._silent.pop(self, None)
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        """Read what came, once the connection has no debt."""
        debt_s = self._account.debt_s()
        if debt_s > 0.0:
            self.transport.pause_reading()
            self.loop.call_later(debt_s, self._read_on, data)
            return
        self._lines += data.count(b"\n")
        if self._lines > MOST_LINES:
            self.transport.abort()
            return
        with self._account.charged():
            super().data_received(data)
        if self.conn.their_state is not h11.IDLE:
            self._lines = 0
            self._silent.pop(self, None)

    def _read_on(self, data: bytes) -> None:
        if not self.transport.is_closing():
            if not self.flow.read_paused:
                self.transport.resume_reading()
            self.data_received(data)

    def _look(self, before: Any) -> None:
        """Close a connection that has begun no request since that one, and is not answered now; no WebSocket."""
        transport, cycle = self.transport, self.cycle
        if transport.is_closing() or transport.get_protocol() is not self:
            return
        if cycle is before and (cycle is None or cycle.response_complete):
            transport.abort()
            return
        self.loop.call_later(REQUEST_S, self._look, cycle)


class BoundedWebSocket(WebSocketsSansIOProtocol):
    """A WebSocket that is closed if its peer sends more than a few pings, pongs and parts of messages, or is gone."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        self._parts = Budget(_MOST_PARTS, _PARTS_PER_SECOND, time.monotonic())

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Keep the account that the connection had before."""
        super().connection_made(transport)
        self._account: Account = self.app_state["accounts"].of(self.client)

    def _count(self) -> bool:
        """Count one, and tell whether the peer may go on."""
        may_go_on = self._parts.take(1.0, time.monotonic())
        if not may_go_on:
            self.transport.abort()
        return may_go_on

    def data_received(self, data: bytes) -> None:
        """Read what came in small parts, and nothing more of it once the peer is cut off."""
        with self._account.charged():
            for start in range(0, len(data), _READ_AT_ONCE):
                if not self.transport.is_closing():
                    super().data_received(data[start : start + _READ_AT_ONCE])

    def handle_ping(self) -> None:
        """Answer a ping."""
        if self._count():
            super().handle_ping()

    def handle_pong(self, event: Any) -> None:
        """Hear a pong."""
        if self._count():
            super().handle_pong(event)

    def handle_cont(self, event: Any) -> None:
        """Take one more part of a message."""
        if self._count():
            super().handle_cont(event)

    def keepalive_timeout(self) -> None:
        """Let go of a peer that does not answer, and of what it has not read: that would keep it for ever."""
        super().keepalive_timeout()
        self.transport.abort()
