"""A rosbridge server, protocol version 2: topics and a few services over WebSockets, in JSON or CBOR.

It knows nothing of games: what clients publish goes to `Rosbridge.heard`, and what is published goes to subscribers.
"""

from __future__ import annotations

import asyncio
import json
import logging
import re
import socket
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

from websockets import Origin
from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from swarm_pz.errors import CommandError, ProtocolError, require_extra
from swarm_pz.play.ros.connection import Client, Subscription
from swarm_pz.play.ros.definitions import DEFINITIONS, definition, full_name, plain_name, serialise
from swarm_pz.play.ros.messages import LOG, Message
from swarm_pz.play.ros.messages import log as log_line
from swarm_pz.play.server.serve import names_of

MAX_MESSAGE_BYTES = 2**20
"""Room for an image of 200 x 200 cells, every number written out; the tablet app's has a tenth of that at most."""
MAX_CLIENTS = 64
_MOST_TOPICS = 256
"""That one client may advertise, or subscribe to, or subscriptions to one topic; and characters of a name."""
_MOST_OTHERS = 2048
"""Topics without a meaning here that all clients together may advertise: `topics` lists them all."""
_BUFFER_BYTES = 2**16
"""The system's buffer for a client that does not read; messages in it grow old."""
_LARGE_NUMBERS = {2, 3}
_KNOWN_TAGS = 2**16
"""Of CBOR, that a decoder may know: some are texts to be compiled, or numbers of a million digits, in few bytes."""
_COMPRESSIONS = ("none", "cbor", "cbor-raw")

Origins = Sequence[Origin | re.Pattern[str] | None]
"""Origins of pages that may connect; None stands for programs, which send no origin."""
log = logging.getLogger("swarm_pz.play")


def origins_of(host: str, others: Sequence[str] = ()) -> Origins:
    """Return the origins that may connect to a host: programs, pages of this machine at any port, and `others`.

    Browsers let every page open a WebSocket to this machine, so others are refused. An address is such as
    https://lab.example, or file:// for programs that are pages themselves; CommandError if it is none.
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


class Rosbridge:
    """The server; a subclass says what messages mean.

    `topics` and `inputs` are what is published and what is listened to, with the types, written as `pkg/Type`; of the
    topics in `every` a subscriber is sent every message, not only the latest.
    """

    def __init__(self, topics: Mapping[str, str], inputs: Mapping[str, str], every: frozenset[str]) -> None:
        self._topics, self._types, self._every = topics, {**inputs, **topics}, every
        self._clients: set[Client] = set()
        self._server: Server | None = None
        self._cbor = require_extra("cbor2", "lab")
        self._no_tags = dict.fromkeys(set(range(_KNOWN_TAGS)) - _LARGE_NUMBERS, _refuse_tag)

    def heard(self, client: Client, topic: str, message: Message) -> None:
        """Take what a client publishes, or raise ProtocolError with words that say what was expected."""

    def left(self, client: Client) -> None:
        """Learn that a client has gone."""

    async def open(self, listening: socket.socket, origins: Origins | None = None) -> None:
        """Begin to meet those that come to a socket: programs, and pages of origins, if not given of this machine."""
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _BUFFER_BYTES)  # and so each that comes in
        self._server = await serve(
            self._meet,
            sock=listening,
            origins=origins if origins is not None else origins_of("127.0.0.1"),
            max_size=MAX_MESSAGE_BYTES,
            compression=None,
            ping_interval=20,
            ping_timeout=20,
            close_timeout=1,
        )

    async def close(self) -> None:
        """Stop listening, and end all connections."""
        if self._server is not None:
            self._server.close()
            await self._server.wait_closed()

    # --- to clients -----------------------------------------------------------------------------

    def wanted(self, topic: str) -> bool:
        """Return True if a client has subscribed to a topic; else its messages need not be made."""
        return any(topic in client.subscriptions for client in self._clients)

    def publish(self, topic: str, message: Message, but: Client | None = None, to: Client | None = None) -> None:
        """Send a message to all that have subscribed to its topic, but one; or to one alone."""
        now = time.monotonic()
        frames: dict[str, str | bytes] = {}
        for client in self._clients if to is None else (to,):
            subscription = client.subscriptions.get(topic)
            if subscription is None or client is but or now - subscription.last_s < subscription.throttle_s:
                continue
            subscription.last_s = now
            how = subscription.compression
            if how not in frames:
                frames[how] = self._encode(topic, message, how)
            client.put(frames[how], None if topic in self._every else topic)

    def _encode(self, topic: str, message: Message, how: str) -> str | bytes:
        told = {"op": "publish", "topic": topic, "msg": message}
        if how == "cbor-raw":
            seconds, nanoseconds = divmod(time.time_ns(), 1_000_000_000)
            raw = serialise(self._topics[topic], message)
            told["msg"] = {"secs": seconds, "nsecs": nanoseconds, "bytes": raw}
        return json.dumps(told) if how == "none" else cast("bytes", self._cbor.dumps(told))

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
        told: Message = {}
        try:
            told = self._read(frame)
            if told["op"] not in self._operations:
                raise ProtocolError(f"op must be one of {', '.join(self._operations)}, got {_shown(told['op'])}")
            self._operations[told["op"]](self, client, told)
        except ProtocolError as error:
            self._refuse(client, str(error))
        except Exception:  # whatever it is, it is refused to this client alone
            log.exception("a message was not obeyed")
            self._refuse(client, "the server could not do that")

    def _refuse(self, client: Client, reason: str) -> None:
        """Say why a message was refused, in the log of its sender alone: many clients take no status messages."""
        self.publish(LOG, log_line(reason, time.time(), True), to=client)

    def _read(self, frame: str | bytes) -> Message:
        is_cbor = isinstance(frame, bytes) and not frame.startswith(b"{")
        try:
            told = self._of_cbor(frame) if is_cbor else json.loads(frame, parse_constant=_refuse_constant)
        except Exception as error:  # whatever a decoder makes of it, it is refused to this client alone
            raise ProtocolError(f"a message must be a JSON object, got {_shown(frame)}: {error}") from error
        if not isinstance(told, dict) or not isinstance(told.get("op"), str):
            raise ProtocolError(f"a message must be an object with an op, got {_shown(frame)}")
        name = told.get("id", "")
        fits = len(name) <= _MOST_TOPICS if isinstance(name, str) else isinstance(name, int) and name.bit_length() <= 64
        if not fits:
            raise ProtocolError(f"id must be a text of at most {_MOST_TOPICS} characters, got {_shown(name)}")
        return told

    def _of_cbor(self, frame: str | bytes) -> Any:
        """Return a CBOR message that JSON could express: without tags, and with texts as keys."""
        rules = {"semantic_decoders": self._no_tags, "tag_hook": _refuse_tag, "strict_hashable_types": True}
        return self._cbor.loads(frame, **rules)

    def _advertise(self, client: Client, told: Message) -> None:
        topic, kind = _topic(told), plain_name(_text(told, "type"))
        self._check_type(topic, kind)
        if topic not in client.advertised and len(client.advertised) >= _MOST_TOPICS:
            raise ProtocolError(f"a client may advertise {_MOST_TOPICS} topics")
        others = sum(len(one.advertised.keys() - self._types) for one in self._clients)
        if topic not in self._types and others >= _MOST_OTHERS:
            raise ProtocolError(f"clients may advertise {_MOST_OTHERS} topics that mean nothing here")
        client.advertised[topic] = kind

    def _unadvertise(self, client: Client, told: Message) -> None:
        client.advertised.pop(_topic(told), None)

    def _publish(self, client: Client, told: Message) -> None:
        message = told.get("msg", {})
        if not isinstance(message, dict):
            raise ProtocolError(f"msg must be an object, got {_shown(message)}")
        self.heard(client, _topic(told), message)

    def _subscribe(self, client: Client, told: Message) -> None:
        topic, compression = _topic(told), told.get("compression") or "none"
        if compression not in _COMPRESSIONS:
            raise ProtocolError(f"compression must be one of {', '.join(_COMPRESSIONS)}, got {_shown(compression)}")
        throttle = told.get("throttle_rate") or 0
        if not isinstance(throttle, int | float) or isinstance(throttle, bool) or not 0 <= throttle <= 1e9:
            raise ProtocolError(f"throttle_rate must be milliseconds, 0 or more, got {_shown(throttle)}")
        if told.get("type"):
            self._check_type(topic, plain_name(_text(told, "type")))
        if compression == "cbor-raw" and topic not in self._topics:
            raise ProtocolError(f"compression cbor-raw is for the topics that are published here, got {topic}")
        if topic not in client.subscriptions and len(client.subscriptions) >= _MOST_TOPICS:
            raise ProtocolError(f"a client may subscribe to {_MOST_TOPICS} topics")
        known = client.subscriptions.setdefault(topic, Subscription(compression, throttle / 1000.0))
        if len(known.ids) >= _MOST_TOPICS:
            raise ProtocolError(f"a client may subscribe to a topic {_MOST_TOPICS} times")
        known.compression, known.throttle_s = compression, min(known.throttle_s, throttle / 1000.0)
        known.ids.add(str(told.get("id", "")))

    def _check_type(self, topic: str, kind: str) -> None:
        if self._types.get(topic, kind) != kind:
            raise ProtocolError(f"{topic} is of type {self._types[topic]}, got {_shown(kind)}")

    def _unsubscribe(self, client: Client, told: Message) -> None:
        topic = _topic(told)
        if (known := client.subscriptions.get(topic)) is not None:
            known.ids.discard(str(told.get("id", "")))
            if "id" not in told or not known.ids:
                del client.subscriptions[topic]

    def _call(self, client: Client, told: Message) -> None:
        service, arguments = _full(_text(told, "service")), told.get("args") or {}
        answer: Message = {"op": "service_response", "service": told["service"]}
        answer |= {"id": told["id"]} if "id" in told else {}
        try:
            if not isinstance(arguments, dict | list):
                raise ProtocolError(f"args must be an object or a list, got {_shown(arguments)}")
            named = arguments if isinstance(arguments, dict) else {"topic": arguments[0]} if arguments else {}
            client.put(json.dumps(answer | {"values": self._answer(service, named), "result": True}))
        except ProtocolError as error:
            client.put(json.dumps(answer | {"values": str(error), "result": False}))

    def _answer(self, service: str, arguments: Message) -> Message:
        types = {**{topic: kind for one in self._clients for topic, kind in one.advertised.items()}, **self._types}
        match service:
            case "/rosapi/topics_and_raw_types":
                known = {topic: kind for topic, kind in types.items() if kind in DEFINITIONS}
                return {
                    "topics": list(known),
                    "types": [full_name(kind) for kind in known.values()],
                    "typedefs_full_text": [definition(kind) for kind in known.values()],
                }
            case "/rosapi/topics":
                return {"topics": list(types), "types": list(types.values())}
            case "/rosapi/topic_type":
                return {"type": types.get(_topic(arguments), "")}
            case "/rosapi/nodes":
                return {"nodes": ["/swarm_pz"]}
            case "/rosapi/get_time":
                seconds, nanoseconds = divmod(time.time_ns(), 1_000_000_000)
                ros1, ros2 = {"secs": seconds, "nsecs": nanoseconds}, {"sec": seconds, "nanosec": nanoseconds}
                return {"time": ros1 | ros2}
        raise ProtocolError(f"there is no service {service}; a seat is taken by publishing on /red_connection_service")

    def _pass(self, client: Client, told: Message) -> None:
        """Take what asks for nothing here: an answer, a status or its level, a service of the client's own."""

    _operations: Mapping[str, Callable[[Rosbridge, Client, Message], None]] = {
        "advertise": _advertise,
        "unadvertise": _unadvertise,
        "publish": _publish,
        "subscribe": _subscribe,
        "unsubscribe": _unsubscribe,
        "call_service": _call,
        **dict.fromkeys(("service_response", "advertise_service", "unadvertise_service", "status", "set_level"), _pass),
    }


def _full(name: str) -> str:
    """Return a name of a topic or service with its slash, which clients leave out at times."""
    return name if name.startswith("/") else f"/{name}"


def _topic(told: Message) -> str:
    return _full(_text(told, "topic"))


def _text(told: Message, key: str) -> str:
    value = told.get(key)
    if not isinstance(value, str) or not 0 < len(value) <= _MOST_TOPICS:
        raise ProtocolError(f"{key} must be a text of 1 to {_MOST_TOPICS} characters, got {_shown(value)}")
    return value


def _refuse_constant(constant: str) -> float:
    raise ValueError(f"{constant} is no number of JSON")


def _refuse_tag(*_: object) -> object:
    raise ValueError("tags mean nothing here")


def _shown(value: object) -> str:
    if isinstance(value, int) and value.bit_length() > 64:
        return "a large number"
    if not isinstance(value, str | bytes | int | float | None):
        return f"a {type(value).__name__}"
    text = repr(value[:60] if isinstance(value, str | bytes) else value)
    return text if len(text) <= 80 else f"{text[:77]}..."
