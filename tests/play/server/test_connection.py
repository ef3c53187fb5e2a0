"""One client's connection, over a socket that keeps what it is sent: order, fresh frames, and patience."""

import asyncio

import pytest
from starlette.websockets import WebSocketDisconnect

from swarm_pz.play import protocol
from swarm_pz.play.server import connection as module
from swarm_pz.play.server.connection import Connection


class Socket:
    """Keeps what it is sent; with a fault, raises it instead."""

    def __init__(self, fault=None):
        self.sent, self.closed, self.fault = [], None, fault

    async def send_text(self, text):
        if self.fault is not None:
            raise self.fault
        self.sent.append(protocol.decode_server(text))

    async def send_bytes(self, data):
        self.sent.append(data)

    async def close(self, code, reason):
        self.closed, self.reason = code, reason


def talk(script, fault=None):
    """Run a connection beside a script, that is given it, what was sent, and a way to let it send."""

    async def play():
        socket = Socket(fault)
        connection = Connection(socket)
        sender = asyncio.create_task(connection.run())

        async def settle():
            for _ in range(200):
                await asyncio.sleep(0)

        await script(connection, socket.sent, settle)
        await settle()
        connection.close()
        await asyncio.wait_for(sender, 30)
        return socket

    return asyncio.run(play())


def pong(number):
    return protocol.Pong(float(number), 0.0)


def test_messages_come_in_order_and_before_the_frame_of_which_only_the_newest_is_sent():
    async def script(connection, sent, settle):
        connection.show(b"old", 1)
        connection.send(pong(1))
        connection.send_bytes(b"target")
        connection.show(b"new", 2)
        connection.send(pong(2))
        await settle()
        assert sent == [pong(1), b"target", pong(2), b"new"]

    assert talk(script).closed == 1008


def test_twelve_frames_are_on_their_way_and_an_answer_makes_room_for_the_newest():
    async def script(connection, sent, settle):
        async def show(first, last):
            for sequence in range(first, last + 1):
                connection.show(b"%d" % sequence, sequence)
                await settle()

        await show(1, 15)
        assert sent == [b"%d" % sequence for sequence in range(1, 13)]
        connection.send(pong(1))
        await settle()
        assert sent[12:] == [pong(1)], "messages are sent even so, and frames are not"
        assert not connection.acknowledge(99) and not connection.acknowledge(0)
        await settle()
        assert sent[13:] == [], "nor for an answer to a frame that is not on its way"
        assert connection.acknowledge(4)  # and so the four of them
        assert not connection.acknowledge(4)
        await settle()
        assert sent[13:] == [b"15"]
        await show(16, 20)
        assert sent[14:] == [b"16", b"17", b"18"]

    talk(script)


def test_a_client_for_whom_too_much_waits_is_given_up():
    async def script(connection, sent, settle):
        await settle()
        for number in range(256):
            connection.send(pong(number))
        assert not connection.closed
        connection.send(pong(256))
        assert connection.closed
        connection.send(pong(257))
        connection.show(b"frame", 1)
        await settle()
        assert sent == []

    assert talk(script).closed == 1008


@pytest.mark.parametrize("fault", [WebSocketDisconnect(), RuntimeError("it is closed"), OSError(32, "Broken pipe")])
def test_a_socket_that_is_gone_closes_its_connection(fault):
    async def script(connection, sent, settle):
        connection.send(pong(1))
        await settle()
        assert connection.closed

    assert talk(script, fault).closed is None


def test_what_is_said_in_a_second_has_so_many_bytes_and_short_messages_none(monkeypatch):
    now = 100.0
    monkeypatch.setattr(module.time, "monotonic", lambda: now)
    connection = Connection(None)
    assert [connection.may_send(protocol.MAX_MESSAGE_BYTES) for _ in range(4)] == [True, True, False, False]
    assert all(connection.may_send(200) for _ in range(100))
    now += 0.5
    assert [connection.may_send(protocol.MAX_MESSAGE_BYTES) for _ in range(2)] == [True, False]
    now += 60.0
    assert [connection.may_send(protocol.MAX_MESSAGE_BYTES) for _ in range(3)] == [True, True, False]


def test_who_is_refused_again_and_again_is_shown_out_and_told_why(monkeypatch):
    now = 100.0
    monkeypatch.setattr(module.time, "monotonic", lambda: now)
    refusal = protocol.Refused(code="too_many", reason="")
    patient, hasty = Connection(Socket()), Connection(Socket())
    for _ in range(150):
        patient.refuse(refusal)
        patient._waiting.clear()  # it was sent
        now += 0.2
    assert not patient.closed
    for count in range(100):
        assert not hasty.closed, count
        hasty.refuse(refusal)
    assert hasty.closed
    asyncio.run(hasty.run())
    assert hasty._socket.reason == "100 messages were refused within 10 seconds"


def test_a_client_is_told_that_it_is_slow_only_if_it_is():
    async def script(connection, sent, settle):
        for number in range(257):
            connection.send(pong(number))

    assert talk(script).reason == "too slow: 256 messages wait to be received"


def test_twenty_messages_a_second_are_heard_and_those_that_were_not_count_for_nothing(monkeypatch):
    now = 100.0
    monkeypatch.setattr(module.time, "monotonic", lambda: now)
    connection = Connection(None)
    assert [connection.may_speak() for _ in range(25)] == [True] * 20 + [False] * 5
    now += 0.99
    assert not connection.may_speak()
    now += 0.02
    assert [connection.may_speak() for _ in range(21)] == [True] * 20 + [False]
