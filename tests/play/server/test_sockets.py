"""WebSockets below messages: floods of what reaches no application, and peers that read nothing."""

import asyncio
from types import SimpleNamespace
from unittest.mock import Mock

import pytest
import uvicorn
from uvicorn.protocols.websockets.websockets_sansio_impl import WebSocketsSansIOProtocol
from uvicorn.server import ServerState
from websockets.exceptions import ConnectionClosed

from swarm_pz.play import protocol
from swarm_pz.play.server import sockets
from swarm_pz.play.server.sockets import BoundedWebSocket

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
        socket = BoundedWebSocket(config, ServerState(), {}, asyncio.get_running_loop())
        socket.transport = Mock()
        socket.keepalive_timeout()
        socket.transport.abort.assert_called_once()

    asyncio.run(play())
