"""A rosbridge server, protocol version 2: topics and a few services over WebSockets, in JSON.

It is independent of games: `Rosbridge.heard` gets clients' messages, and `Rosbridge.publish` sends to subscribers.

A client that reads slowly gets only a topic's latest message, whatever queue length it asked for, so that messages are
never old. Only events, put without a topic, are all kept.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import re
import reprlib
import socket
import time
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import cbor2
import msgspec
from websockets import Origin
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from swarm_pz.errors import CommandError, ProtocolError, nearest
from swarm_pz.play.ros.definitions import definition, full_name, plain_name, serialise
from swarm_pz.play.ros.messages import LOG, Message
from swarm_pz.play.ros.messages import log as log_line
from swarm_pz.play.server.serve import names_of

MAX_MESSAGE_BYTES = 2**20
"""Room for an image of 200 x 200 cells with all digits; the tablet app needs a tenth of that at most."""
MAX_CLIENTS = 64
_MOST_IDS = 256
"""Subscriptions of one client to one topic."""
_MOST_CHARACTERS = 256
"""Length of a name, type or id."""
_BUFFER_BYTES = 2**16
"""The system's send buffer of a client; it is small, since messages in it grow old."""
_MOST_WAITING = 2**22
"""Most bytes of events that may wait for one client; with more, its connection ends."""
MESSAGES_PER_SECOND, BYTES_PER_SECOND = 200, 2**22
"""Most messages and bytes a second that are read from one client; the rest waits in its connection."""
_BURST_S = 1.0
"""Seconds of unused rates that a client may use at once."""
_COMPRESSIONS = ("none", "cbor-raw")
"""Foxglove and Lichtblick read only cbor-raw: CDR in CBOR."""
_IGNORED = ("unadvertise", "advertise_service", "unadvertise_service", "service_response", "status", "set_level")
"""Operations of clients that have no effect here."""

Origins = Sequence[Origin | re.Pattern[str] | None]
"""Origins of pages that may connect; None stands for programs, which send no origin."""
log = logging.getLogger("swarm_pz.play")


def origins_of(host: str, others: Sequence[str] = ()) -> Origins:
    """Return the origins that may connect to a host: programs, pages of this machine at any port, and `others`.

    Browsers let every page open a WebSocket to this machine, so other origins are refused. An origin is, for example,
    https://lab.example, or file:// for desktop programs made of pages. Raises CommandError if one is invalid.
    """
    for other in others:
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9+.-]*://[^/\s]*/?", other):
            raise CommandError(
                "--ros-origin takes the address of a page without its path, such as https://lab.example or file://, "
                f"got {other!r}"
            )
    names = "|".join(re.escape(name.removesuffix(":0")) for name in names_of(host, 0))
    home = re.compile(f"https?://({names})(:[0-9]+)?", re.IGNORECASE)
    return [None, home, *(Origin(re.sub("(?<=[^/])/$", "", other.lower())) for other in others)]


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
        """Queue a frame; with a topic, it replaces a frame of this topic that still waits.

        If too many bytes wait, the connection ends, and what waits is dropped.
        """
        if self.ending is not None:
            return
        if topic is not None:
            self._latest.pop(topic, None)
            self._latest[topic] = frame
        else:
            self._events.append(frame)
            self._waiting += len(frame)
            if self._waiting > _MOST_WAITING:
                self._events.clear()
                self._latest.clear()
                reason = f"too slow: {self._waiting} bytes wait to be received"
                self.ending = asyncio.create_task(self._connection.close(1008, reason))
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


class Rosbridge:
    """The server; a subclass handles the messages.

    `topics` are published, and `inputs` are read; their types are written as `pkg/Type`. Subscribers to a topic in
    `every` get all its messages, not only the latest.
    """

    def __init__(self, topics: Mapping[str, str], inputs: Mapping[str, str], every: frozenset[str]) -> None:
        self._topics, self._types, self._every = topics, {**inputs, **topics}, every
        self._clients: set[Client] = set()

    def heard(self, client: Client, topic: str, message: Message) -> None:
        """Handle a message that a client publishes; if it is invalid, raise ProtocolError with what is expected."""

    def left(self, client: Client) -> None:
        """Note that a client has gone."""

    async def serve_at(self, listening: socket.socket, origins: Origins) -> None:
        """Serve clients of `origins` at a socket until cancelled."""
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER_BYTES)  # accepted sockets inherit it
        serving = serve(
            self._meet,
            sock=listening,
            origins=origins,
            max_size=MAX_MESSAGE_BYTES,
            compression=None,
            ping_interval=20,
            ping_timeout=20,
            close_timeout=1,
        )
        async with serving:
            await asyncio.get_running_loop().create_future()

    # --- to clients -----------------------------------------------------------------------------

    def wanted(self, topic: str) -> bool:
        """Return True if a client has subscribed to a topic; else its messages need not be made."""
        return any(topic in client.subscriptions for client in self._clients)

    def publish(self, topic: str, message: Message, but: Client | None = None, to: Client | None = None) -> None:
        """Send a message to its topic's subscribers: to all except `but`, or only to `to`."""
        now = time.monotonic()
        frames: dict[str, str | bytes] = {}
        for client in self._clients if to is None else (to,):
            subscription = client.subscriptions.get(topic)
            if subscription is None or client is but or now - subscription.last_s < subscription.throttle_s:
                continue
            subscription.last_s = now
            compression = subscription.compression
            if compression not in frames:
                frames[compression] = self._encode(topic, message, compression)
            client.put(frames[compression], None if topic in self._every else topic)

    def _encode(self, topic: str, message: Message, compression: str) -> str | bytes:
        if compression == "none":
            return _json({"op": "publish", "topic": topic, "msg": message})
        seconds, nanoseconds = divmod(time.time_ns(), 1_000_000_000)
        raw = {"secs": seconds, "nsecs": nanoseconds, "bytes": serialise(self._topics[topic], message)}
        return cbor2.dumps({"op": "publish", "topic": topic, "msg": raw})

    # --- from clients ---------------------------------------------------------------------------

    async def _meet(self, connection: ServerConnection) -> None:
        client = Client(connection)
        if len(self._clients) >= MAX_CLIENTS:
            await connection.close(1013, f"{MAX_CLIENTS} clients are here: try later")
            return
        self._clients.add(client)
        writer = asyncio.create_task(client.write())
        try:
            async for frame in connection:
                self._obey(client, frame)
                if client.ending is not None:
                    await client.ending
                    return
                await asyncio.sleep(client.pause_after(len(frame)))
        except ConnectionClosed:
            pass
        finally:
            self._clients.discard(client)
            writer.cancel()
            self.left(client)

    def _obey(self, client: Client, frame: str | bytes) -> None:
        """Handle a message; its sender gets errors on `/rosout`, since many clients take no status messages."""
        try:
            self._do(client, _read(frame))
            return
        except ProtocolError as error:
            reason = str(error)
        except Exception:  # any other error concerns only this message
            log.exception("a message was not obeyed")
            reason = "the server could not do that"
        self.publish(LOG, log_line(reason, time.time(), True), to=client)

    def _do(self, client: Client, request: Message) -> None:
        match request.get("op"):
            case "publish":
                message = request.get("msg", {})
                if not isinstance(message, dict):
                    raise ProtocolError(f"msg must be an object, got {reprlib.repr(message)}")
                self.heard(client, _topic(request), message)
            case "advertise":
                self._check_type(request)
            case "subscribe":
                self._subscribe(client, request)
            case "unsubscribe":
                self._unsubscribe(client, request)
            case "call_service":
                self._call(client, request)
            case op if op not in _IGNORED:
                known = "publish, advertise, subscribe, unsubscribe or call_service"
                raise ProtocolError(f"op must be {known}, got {reprlib.repr(op)}")

    def _check_type(self, request: Message) -> None:
        topic, kind = _topic(request), plain_name(_text(request, "type"))
        if self._types.get(topic, kind) != kind:
            raise ProtocolError(f"{topic} is of type {self._types[topic]}, got {reprlib.repr(kind)}")

    def _subscribe(self, client: Client, request: Message) -> None:
        topic, compression = _topic(request), request.get("compression") or "none"
        if topic not in self._topics:
            raise ProtocolError(f"nothing is published on {topic}; {nearest(topic, self._topics)}")
        if compression not in _COMPRESSIONS:
            expected = " or ".join(_COMPRESSIONS)
            raise ProtocolError(f"compression must be {expected}, got {reprlib.repr(compression)}")
        throttle = request.get("throttle_rate") or 0
        if not isinstance(throttle, int | float) or not 0 <= throttle <= 1e9:
            raise ProtocolError(f"throttle_rate must be milliseconds, 0 or more, got {reprlib.repr(throttle)}")
        if request.get("type"):
            self._check_type(request)
        known = client.subscriptions.setdefault(topic, Subscription(compression, throttle / 1000.0))
        if len(known.ids) >= _MOST_IDS:
            raise ProtocolError(f"a client may subscribe to a topic {_MOST_IDS} times")
        known.compression, known.throttle_s = compression, min(known.throttle_s, throttle / 1000.0)
        known.ids.add(_id(request))

    def _unsubscribe(self, client: Client, request: Message) -> None:
        topic = _topic(request)
        if (known := client.subscriptions.get(topic)) is not None:
            known.ids.discard(_id(request))
            if "id" not in request or not known.ids:
                del client.subscriptions[topic]

    def _call(self, client: Client, request: Message) -> None:
        service, arguments = _full(_text(request, "service")), request.get("args") or {}
        response: Message = {"op": "service_response", "service": request["service"], "result": True}
        response |= {"id": request["id"]} if "id" in request else {}
        try:
            response["values"] = self._values(service, arguments if isinstance(arguments, dict) else {})
        except ProtocolError as error:
            response |= {"values": str(error), "result": False}
        client.put(_json(response))

    def _values(self, service: str, arguments: Message) -> Message:
        match service:
            case "/rosapi/topics_and_raw_types":
                return {
                    "topics": list(self._types),
                    "types": [full_name(kind) for kind in self._types.values()],
                    "typedefs_full_text": [definition(kind) for kind in self._types.values()],
                }
            case "/rosapi/topics":
                return {"topics": list(self._types), "types": list(self._types.values())}
            case "/rosapi/topic_type":
                return {"type": self._types.get(_topic(arguments), "")}
            case "/rosapi/nodes":
                return {"nodes": ["/swarm_pz"]}
            case "/rosapi/get_time":
                seconds, nanoseconds = divmod(time.time_ns(), 1_000_000_000)
                ros1, ros2 = {"secs": seconds, "nsecs": nanoseconds}, {"sec": seconds, "nanosec": nanoseconds}
                return {"time": ros1 | ros2}
        raise ProtocolError(f"there is no service {service}; a seat is taken by publishing on /red_connection_service")


def _json(message: Message) -> str:
    return msgspec.json.encode(message).decode()


def _read(frame: str | bytes) -> Message:
    try:
        return msgspec.json.decode(frame, type=dict[str, Any])
    except (ValueError, RecursionError) as error:
        raise ProtocolError(f"a message must be a JSON object, got {reprlib.repr(frame)}: {error}") from error


def _full(name: str) -> str:
    """Return the name of a topic or service with its leading slash, which some clients leave out."""
    return name if name.startswith("/") else f"/{name}"


def _topic(request: Message) -> str:
    return _full(_text(request, "topic"))


def _id(request: Message) -> str:
    return _text(request, "id") if "id" in request else ""


def _text(request: Message, key: str) -> str:
    value = request.get(key)
    if not isinstance(value, str) or not 0 < len(value) <= _MOST_CHARACTERS:
        raise ProtocolError(f"{key} must be a text of 1 to {_MOST_CHARACTERS} characters, got {reprlib.repr(value)}")
    return value
