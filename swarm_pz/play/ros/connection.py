"""One client of a rosbridge: its subscriptions, and the queue of its messages.

A client that reads slowly gets only a topic's latest message, whatever queue length it asked for, so that messages are
never old. Only events, put without a topic, are all kept.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections import deque
from dataclasses import dataclass, field

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

_MOST_WAITING = 2**22
"""Most bytes of events that may wait for one client; with more, its connection ends."""
MESSAGES_PER_SECOND, BYTES_PER_SECOND = 200, 2**22
"""Most messages and bytes a second that are read from one client; the rest waits in its connection."""
_BURST_S = 1.0
"""Seconds of unused rates that a client may use at once."""


@dataclass
class Subscription:
    """A client's subscription to a topic."""

    compression: str
    throttle_s: float
    ids: set[str] = field(default_factory=set)
    last_s: float = -1e9


class Client:
    """One connection."""

    def __init__(self, connection: ServerConnection) -> None:
        self.subscriptions: dict[str, Subscription] = {}
        self.ending: asyncio.Task[None] | None = None
        self._connection = connection
        self._latest: dict[str, str | bytes] = {}
        self._events: deque[str | bytes] = deque()
        self._waiting = 0
        """Bytes of the events that wait."""
        self._read_until_s = -1e9
        self._wake = asyncio.Event()

    def pause_after(self, size: int) -> float:
        """Return the seconds to wait after a message of `size` bytes, so that the client keeps to both rates."""
        now = time.monotonic()
        cost = max(1.0 / MESSAGES_PER_SECOND, size / BYTES_PER_SECOND)
        self._read_until_s = max(self._read_until_s, now - _BURST_S) + cost
        return max(self._read_until_s - now, 0.0)

    def put(self, frame: str | bytes, topic: str | None = None) -> None:
        """Queue a frame; with a topic, it replaces a frame of this topic that still waits."""
        if self.ending is not None:
            return
        if topic is not None:
            self._latest.pop(topic, None)
            self._latest[topic] = frame
        else:
            self._events.append(frame)
            self._waiting += len(frame)
            if self._waiting > _MOST_WAITING:
                self.end(f"too slow: {self._waiting} bytes wait to be received")
        self._wake.set()

    async def write(self) -> None:
        """Send queued frames, until the connection ends."""
        with contextlib.suppress(ConnectionClosed):
            while True:
                await self._wake.wait()
                self._wake.clear()
                while self._events or self._latest:
                    if self._events:
                        frame = self._events.popleft()
                        self._waiting -= len(frame)
                    else:
                        frame = self._latest.pop(next(iter(self._latest)))
                    await self._connection.send(frame)

    def end(self, reason: str) -> None:
        """End the connection with a reason; queued frames are dropped."""
        if self.ending is None:
            self._events.clear()
            self._latest.clear()
            self.ending = asyncio.create_task(self._connection.close(1008, reason))
