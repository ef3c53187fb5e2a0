"""Connections below messages: floods of what reaches no application, and peers that ask or read nothing."""

import asyncio
import contextlib
from types import SimpleNamespace
from unittest.mock import Mock

import h11
import pytest
import uvicorn
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from uvicorn.server import ServerState
from websockets.exceptions import ConnectionClosed

from swarm_pz.play import protocol
from swarm_pz.play.server import sockets
from swarm_pz.play.server.budget import Accounts, Rate
from swarm_pz.play.server.sockets import BoundedHTTP, BoundedWebSocket

ACCOUNTS = Accounts(Rate(1.0, 1.0), Rate(1.0, 1.0))
PING, PONG, PART = (bytes([first, 0x80, 0, 0, 0, 0]) for first in (0x89, 0x8A, 0x00))
"""Empty ones, as a client masks them."""


@pytest.mark.parametrize("flood", [PING, PONG, PART], ids=["pings", "pongs", "parts"])
def test_who_sends_hardly_anything_but_pings_pongs_or_parts_of_messages_is_cut_off(flood, table):
    client = table.visit()
    raw = client.socket.socket
    raw.sendall(PING * 20 + PONG * 20)
    client.say(protocol.Ping(1.0))
    assert client.hear(protocol.Pong), "a few are fine"
    raw.sendall((b"\x01" + PART[1:] if flood is PART else b"") + flood * 150)
    with pytest.raises(ConnectionClosed):
        client.take(timeout=10)


def test_nothing_more_is_read_of_a_peer_that_is_cut_off(monkeypatch):
    socket, read = BoundedWebSocket.__new__(BoundedWebSocket), []
    monkeypatch.setattr(WebSocketsSansIOProtocol, "data_received", lambda _, data: read.append(data))
    socket._account = ACCOUNTS.of(None)
    socket.transport = Mock(is_closing=lambda: len(read) == 2)
    socket.data_received(bytes(range(256)) * 16)
    assert b"".join(read) == bytes(range(256)) * 8


@pytest.mark.parametrize(("kind", "given"), [("handle_ping", ()), ("handle_pong", ("a",)), ("handle_cont", ("a",))])
def test_what_is_sent_now_and_then_is_taken_and_never_cuts_off(kind, given, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(sockets, "time", SimpleNamespace(monotonic=lambda: now[0]))
    monkeypatch.setattr(WebSocketsSansIOProtocol, "__init__", lambda self: None)
    monkeypatch.setattr(WebSocketsSansIOProtocol, kind, lambda self, *event: taken.append(event))
    socket, taken = BoundedWebSocket(), []
    socket.transport = Mock()
    for _ in range(1000):
        now[0] += 1.0
        getattr(socket, kind)(*given)
    socket.transport.abort.assert_not_called()
    for _ in range(150):
        getattr(socket, kind)(*given)
    socket.transport.abort.assert_called()
    assert taken == [given] * (1000 + 99), "none once it is cut off"


def test_a_peer_that_answers_no_ping_is_let_go_with_all_that_it_has_not_read():
    async def play():
        config = uvicorn.Config(lambda *_: None)
        config.load()
        socket = BoundedWebSocket(config, ServerState(), {"accounts": ACCOUNTS}, asyncio.get_running_loop())
        socket.transport = Mock()
        socket.keepalive_timeout()
        socket.transport.abort.assert_called_once()

    asyncio.run(play())


REQUEST = b"GET / HTTP/1.1\r\nHost: here\r\n\r\n"


async def answer(scope, receive, send):
    """Answer a request, after a while."""
    await asyncio.sleep(0.5)
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
    await send({"type": "http.response.body", "body": b"ok"})


@pytest.mark.parametrize(
    ("first", "parts"),
    [(b"", b""), (b"", REQUEST), (REQUEST, b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 100)],
    ids=["nothing", "little", "one and then little"],
)
def test_who_asks_for_nothing_whole_is_let_go_and_whoever_does_is_answered(first, parts, monkeypatch):
    monkeypatch.setattr(sockets, "REQUEST_S", 0.2)
    state = ServerState()

    async def play():
        config = uvicorn.Config(answer, http=BoundedHTTP, lifespan="off", timeout_keep_alive=60)
        config.load()
        loop = asyncio.get_running_loop()
        server = await loop.create_server(lambda: BoundedHTTP(config, state, {"accounts": ACCOUNTS}), "127.0.0.1", 0)
        reader, writer = await asyncio.open_connection(*server.sockets[0].getsockname()[:2])
        writer.write(first)
        if first:
            heard = await asyncio.wait_for(reader.readuntil(b"ok"), 60)
            assert heard.startswith(b"HTTP/1.1 200")
        closing = asyncio.create_task(reader.read())
        for byte in parts[:-1]:
            if closing.done():
                break
            writer.write(bytes([byte]))
            await asyncio.sleep(0.05)
        with contextlib.suppress(ConnectionError):
            assert await asyncio.wait_for(closing, 60) == b""
        assert not state.connections
        writer.transport.abort()
        server.close()
        await asyncio.sleep(0)

    asyncio.run(play())


def test_of_connections_that_ask_for_nothing_the_oldest_gives_way(monkeypatch):
    """Five addresses that connected without a word, thousands of times a second, held up every game."""
    monkeypatch.setattr(sockets, "MOST_SILENT", 5)
    monkeypatch.setattr(sockets, "MOST_SILENT_OF_ADDRESS", 3)

    async def play():
        config, accounts = uvicorn.Config(answer, lifespan="off"), Accounts(Rate(1.0, 1.0), Rate(1.0, 1.0))
        config.load()

        def connected(address):
            one = BoundedHTTP(config, ServerState(), {"accounts": accounts}, asyncio.get_running_loop())
            known = {"peername": (address, 5), "sockname": ("here", 80)}
            one.connection_made(Mock(get_extra_info=known.get, is_closing=lambda: False))
            return one

        def closed(*connections):
            return [one.transport.abort.called for one in connections]

        asks = connected("a")
        asks.data_received(REQUEST)
        first, second, third = (connected("a") for _ in range(3))
        assert not any(closed(asks, first, second, third))
        fourth, other = connected("a"), connected("b")
        assert closed(asks, first, second, other) == [False, True, False, False]
        second.connection_lost(None)
        connected("b"), connected("b")
        assert not any(closed(second, third, fourth, other))
        connected("c")
        assert closed(asks, third, fourth, other) == [False, True, False, False], "the oldest of all"

    asyncio.run(play())


def test_a_request_of_thousands_of_headers_is_not_read(monkeypatch):
    read = []
    monkeypatch.setattr(sockets.H11Protocol, "data_received", lambda _, data: read.append(data))
    socket = BoundedHTTP.__new__(BoundedHTTP)
    socket._account, socket._lines, socket.transport, socket._silent = ACCOUNTS.of(None), 0, Mock(), {}
    socket.conn = SimpleNamespace(their_state=h11.IDLE)
    socket.data_received(REQUEST)
    socket.data_received(b"a: b\r\n" * 200)
    socket.transport.abort.assert_not_called()
    socket.data_received(b"a: b\r\n" * 200)
    socket.transport.abort.assert_called_once()
    assert len(read) == 2


def test_nothing_is_read_of_a_connection_in_debt_until_that_is_paid(monkeypatch):
    read = []
    monkeypatch.setattr(sockets.H11Protocol, "data_received", lambda _, data: read.append(data))
    socket = BoundedHTTP.__new__(BoundedHTTP)
    socket._account, socket._lines, socket.transport = Mock(debt_s=lambda: 2.0), 0, Mock(is_closing=lambda: False)
    socket._silent = {}
    socket.loop, socket.flow, socket.conn = Mock(), Mock(read_paused=False), SimpleNamespace(their_state=h11.DONE)
    socket.data_received(REQUEST)
    socket.transport.pause_reading.assert_called_once()
    socket.loop.call_later.assert_called_once_with(2.0, socket._read_on, REQUEST)
    assert not read
    socket._account = ACCOUNTS.of(None)
    socket._read_on(REQUEST)
    socket.transport.resume_reading.assert_called_once()
    assert read == [REQUEST]
