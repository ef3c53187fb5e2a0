"""One client of a rosbridge: what it wants to hear, and what it is sent, in which order.

Who reads slowly is sent the latest message of each topic, not all of them, however long the queue that it asked for;
so nothing is ever old.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import time
from collections import deque
from dataclasses import dataclass, field
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

_MOST_WAITING = 2**22
"""Bytes that wait for one client of what may not be missed: then it is given up."""
_PINGS, _ANSWER_S = 3, 0.5
"""A client that is there answers one of so many pings within so many seconds; tablets deploy every two or more."""
LEVELS = ("none", "error", "warning", "info")
"""Of status messages; a client is sent those up to its own."""
_MOST_REFUSED, _PATIENCE_S = 100, 10.0
"""So many refusals in so many seconds, and a client is shown out."""


@dataclass
class Subscription:
    """What a client wants of a topic."""

    compression: str
    throttle_s: float
    ids: set[str] = field(default_factory=set)
    last_s: float = -1e9


class Client:
    """One connection.

    Attributes
    ----------
    address : str
        Where it comes from.
    advertised, subscriptions : dict
        Types and subscriptions by topic.
    level : str
        Up to which it is sent status messages: "none", unless it asks, since some clients cannot take them.
    ending : Task, optional
        What ends its connection.
    """

    def __init__(self, connection: ServerConnection) -> None:
        self.address = str((connection.remote_address or ("unknown",))[0])
        self.advertised: dict[str, str] = {}
        self.subscriptions: dict[str, Subscription] = {}
        self.level = "none"
        self._connection = connection
        self._latest: dict[str, str | bytes] = {}
        self._events: deque[str | bytes] = deque()
        self._waiting = 0
        """Bytes of the events that wait."""
        self._refused: deque[float] = deque(maxlen=_MOST_REFUSED)
        self._wake = asyncio.Event()
        self.ending: asyncio.Task[None] | None = None

    def put(self, frame: str | bytes, topic: str | None = None) -> None:
        """Send a frame when the client takes it; of a topic's frames that wait only the latest."""
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

    def tell(self, level: str, text: str, **more: Any) -> None:
        """Send a status message, if the client has asked for such ones."""
        if LEVELS.index(level) <= LEVELS.index(self.level):
            self.put(json.dumps({"op": "status", "level": level, "msg": text} | more))

    def refuse(self, text: str, **more: Any) -> None:
        """Say that a message was refused, and why; who does not stop is shown out."""
        self.tell("error", text, **more)
        now = time.monotonic()
        self._refused.append(now)
        if len(self._refused) == _MOST_REFUSED and now - self._refused[0] < _PATIENCE_S:
            self.end(f"{_MOST_REFUSED} messages were refused within {_PATIENCE_S:g} seconds")

    async def is_there(self) -> bool:
        """Ask whether somebody is at the other end."""
        # Several times: after a while in which this process did nothing, the answer is there, but not read yet.
        for _ in range(_PINGS):
            try:
                async with asyncio.timeout(_ANSWER_S):
                    await (await self._connection.ping())
                    return True
            except TimeoutError:
                continue
            except ConnectionClosed:
                break
        return False

    async def write(self) -> None:
        """Send what waits, until the connection ends."""
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
        """End the connection, and say why; what waits is dropped."""
        if self.ending is None:
            self._events.clear()
            self._latest.clear()
            self.ending = asyncio.create_task(self._connection.close(1008, reason))
