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

pytestmark = pytest.mark.anyio
PING, PONG, PART = (bytes([first, 0x80, 0, 0, 0, 0]) for first in (0x89, 0x8A, 0x00))
"""Empty ones, as a client masks them."""
REQUEST, SLOW = (b"GET %b HTTP/1.1\r\nHost: here\r\n\r\n" % path for path in (b"/", b"/slow"))


async def answer(scope, receive, send):
    if scope["path"] == "/slow":
        await asyncio.Event().wait()
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
    await send({"type": "http.response.body", "body": b"ok"})


def made(kind, accounts=None):
    """Return a connection of some kind."""
    config = uvicorn.Config(answer, lifespan="off", timeout_keep_alive=60)
    config.load()
    accounts = accounts or Accounts(Rate(1.0, 1.0), Rate(1.0, 1.0))
    return kind(config, ServerState(), {"accounts": accounts}, asyncio.get_running_loop())


def connected(address, accounts=None):
    """Return a connection by which nothing was said yet; its `looks` are those that it will take."""
    one, known = made(BoundedHTTP, accounts), {"peername": (address, 5), "sockname": ("here", 80)}
    one.looks, one.loop = [], Mock(wraps=one.loop)
    one.loop.call_later = lambda _, act, *given: one.looks.append(given) if act == one._look else Mock()
    transport = Mock(get_extra_info=known.get, is_closing=lambda: transport.abort.called, get_protocol=lambda: one)
    one.connection_made(transport)
    return one


# --- WebSockets -----------------------------------------------------------------------------------


def test_who_sends_hardly_anything_but_pings_is_cut_off(table):
    client = table.visit()
    raw = client.socket.socket
    raw.sendall(PING * 20 + PONG * 20)
    client.say(protocol.Ping(1.0))
    assert client.hear(protocol.Pong), "a few are fine"
    raw.sendall(b"\x01" + PART[1:] + (PART + PING + PONG) * 50)
    with pytest.raises(ConnectionClosed):
        client.take()


async def test_nothing_more_is_read_of_a_peer_that_is_cut_off(monkeypatch):
    read, socket = [], made(BoundedWebSocket)
    monkeypatch.setattr(WebSocketsSansIOProtocol, "data_received", lambda _, data: read.append(data))
    socket._account, socket.transport = Mock(charged=contextlib.nullcontext), Mock(is_closing=lambda: len(read) == 2)
    socket.data_received(bytes(range(256)) * 16)
    assert b"".join(read) == bytes(range(256)) * 8


@pytest.mark.parametrize(("kind", "given"), [("handle_ping", ()), ("handle_pong", ("a",)), ("handle_cont", ("a",))])
async def test_what_is_sent_now_and_then_is_taken_and_never_cuts_off(kind, given, monkeypatch):
    now, taken = [0.0], []
    monkeypatch.setattr(sockets, "time", SimpleNamespace(monotonic=lambda: now[0]))
    monkeypatch.setattr(WebSocketsSansIOProtocol, kind, lambda self, *event: taken.append(event))
    socket = made(BoundedWebSocket)
    socket.transport = Mock()
    for _ in range(1000):
        now[0] += 1.0
        getattr(socket, kind)(*given)
    socket.transport.abort.assert_not_called()
    for _ in range(150):
        getattr(socket, kind)(*given)
    socket.transport.abort.assert_called()
    assert taken == [given] * (1000 + 99), "none once it is cut off"


async def test_a_peer_that_answers_no_ping_is_let_go_with_all_that_it_has_not_read():
    socket = made(BoundedWebSocket)
    socket.transport = Mock()
    socket.keepalive_timeout()
    socket.transport.abort.assert_called_once()


# --- requests -------------------------------------------------------------------------------------


async def test_who_asks_for_nothing_whole_in_time_is_let_go_and_whoever_does_is_answered():
    little = b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 100
    for asked, is_let_go in (
        ((b"", b""), [True, True]),
        ((little, b"X: z\r\n"), [True, True]),
        ((REQUEST, little), [False, True]),
        ((REQUEST, REQUEST), [False, False]),
        ((SLOW, b""), [False, False]),
    ):
        one, found = connected("a"), []
        for part in asked:
            if part:  # nothing would be the end
                one.data_received(part)
            for _ in range(20):
                await asyncio.sleep(0)
            for given in [one.looks.pop()] if one.looks else []:
                one._look(*given)
            found.append(one.transport.abort.called)
        assert found == is_let_go, asked
        assert (b"ok" in b"".join(call.args[0] for call in one.transport.write.mock_calls)) == (REQUEST in asked)


async def test_of_connections_that_ask_for_nothing_the_oldest_gives_way(monkeypatch):
    """Five addresses that connected without a word, thousands of times a second, held up every game."""
    monkeypatch.setattr(sockets, "MOST_SILENT", 5)
    monkeypatch.setattr(sockets, "MOST_SILENT_OF_ADDRESS", 3)
    accounts = Accounts(Rate(1.0, 1.0), Rate(1.0, 1.0))

    def closed(*connections):
        return [one.transport.abort.called for one in connections]

    asks = connected("a", accounts)
    asks.data_received(REQUEST)
    first, second, third = (connected("a", accounts) for _ in range(3))
    assert not any(closed(asks, first, second, third))
    fourth, other = (connected(address, accounts) for address in "ab")
    assert closed(asks, first, second, other) == [False, True, False, False]
    second.connection_lost(None)
    for _ in range(2):
        connected("b", accounts)
    assert not any(closed(second, third, fourth, other))
    connected("c", accounts)
    assert closed(asks, third, fourth, other) == [False, True, False, False], "the oldest of all"


async def test_a_request_of_thousands_of_headers_is_not_read():
    one = connected("a")
    one.data_received(REQUEST[:-2])
    one.data_received(b"a: b\r\n" * 200)
    one.transport.abort.assert_not_called()
    one.data_received(b"a: b\r\n" * 200)
    one.transport.abort.assert_called_once()
    assert one.conn.their_state is h11.IDLE


async def test_nothing_is_read_of_a_connection_in_debt_until_that_is_paid(monkeypatch):
    read, accounts = [], Accounts(Rate(1.0, 1.0), Rate(1.0, 1.0))
    monkeypatch.setattr(sockets.H11Protocol, "data_received", lambda _, data: read.append(data))
    one = connected("a", accounts)
    one._account.spend(3.0)
    one.loop = Mock()
    one.data_received(REQUEST)
    one.transport.pause_reading.assert_called_once()
    (debt_s, read_on, data), _ = one.loop.call_later.call_args
    assert debt_s == pytest.approx(2.0, abs=0.1) and not read
    one._account = accounts.of(("b", 1))
    read_on(data)
    one.transport.resume_reading.assert_called_once()
    assert read == [REQUEST]
