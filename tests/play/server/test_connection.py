"""One client's connection, over a stand-in socket: message order, newest frames, and limits."""

import asyncio

import pytest
from starlette.websockets import WebSocketDisconnect

from swarm_pz.play import protocol
from swarm_pz.play.server.connection import Connection


class Socket:
    """Keeps what it is sent; with a fault, sending text raises it."""

    def __init__(self, fault=None):
        self.sent, self.closed, self.reason, self.fault = [], None, "", fault

    async def send_text(self, text):
        if self.fault is not None:
            raise self.fault
        self.sent.append(protocol.decode_server(text))

    async def send_bytes(self, data):
        self.sent.append(data)

    async def close(self, code, reason):
        self.closed, self.reason = code, reason


@pytest.fixture
async def talk():
    """Give a connection, its socket, and a way to let it send; it is closed at the end."""
    socket = Socket()
    connection = Connection(socket)
    sender = asyncio.create_task(connection.run())

    async def settle():
        for _ in range(200):
            await asyncio.sleep(0)

    yield connection, socket, settle
    connection.close()
    await asyncio.wait_for(sender, 30)
    assert socket.closed == (1008 if socket.fault is None else None)


def pong(number):
    return protocol.Pong(float(number), 0.0)


async def test_messages_come_in_order_and_before_the_frame_of_which_only_the_newest_is_sent(talk):
    connection, socket, settle = talk
    connection.show(b"old", 1)
    connection.send(pong(1))
    connection.send(b"target")
    connection.show(b"new", 2)
    connection.send(pong(2))
    await settle()
    assert socket.sent == [pong(1), b"target", pong(2), b"new"]


async def test_twelve_frames_are_on_their_way_and_an_answer_makes_room_for_the_newest(talk):
    connection, socket, settle = talk

    async def show(first, last):
        for sequence in range(first, last + 1):
            connection.show(b"%d" % sequence, sequence)
            await settle()

    await show(1, 15)
    assert socket.sent == [b"%d" % sequence for sequence in range(1, 13)]
    connection.send(pong(1))
    await settle()
    assert socket.sent[12:] == [pong(1)], "messages are sent even so, and frames are not"
    assert not connection.acknowledge(99) and not connection.acknowledge(0)
    await settle()
    assert socket.sent[13:] == [], "nor for an answer to a frame that is not on its way"
    assert connection.acknowledge(4)  # and so frames 1 to 4
    assert not connection.acknowledge(4)
    await settle()
    assert socket.sent[13:] == [b"15"]
    await show(16, 20)
    assert socket.sent[14:] == [b"16", b"17", b"18"]


async def test_a_client_for_whom_too_much_waits_is_given_up_and_told_so(talk):
    connection, socket, settle = talk
    for number in range(256):
        connection.send(pong(number))
    assert not connection.closed
    connection.send(pong(256))
    assert connection.closed
    connection.show(b"frame", 1)
    await settle()
    assert socket.sent == [] and socket.reason.startswith("too slow")


@pytest.mark.parametrize("fault", [WebSocketDisconnect(), RuntimeError("it is closed"), OSError(32, "Broken pipe")])
async def test_a_socket_that_is_gone_closes_its_connection(fault, talk):
    connection, socket, settle = talk
    socket.fault = fault
    connection.send(pong(1))
    await settle()
    assert connection.closed


def test_twenty_messages_and_four_long_ones_a_second_are_heard_and_those_that_were_not_count_for_nothing(clock):
    connection, most = Connection(None), protocol.MAX_MESSAGE_BYTES
    assert [connection.may_send(most) for _ in range(5)] == [True] * 4 + [False]
    assert all(connection.may_send(200) for _ in range(100)), "short ones are not counted here"
    assert [connection.may_speak() for _ in range(25)] == [True] * 20 + [False] * 5
    clock.now += 0.99
    assert not connection.may_send(most)
    assert not connection.may_speak()
    clock.now += 0.02
    assert [connection.may_speak() for _ in range(21)] == [True] * 20 + [False]
    assert connection.may_send(most)


async def test_who_is_refused_again_and_again_is_closed_and_told_why(clock):
    refusal = protocol.Refused(code="too_many", reason="")
    patient, socket = Connection(Socket()), Socket()
    for _ in range(150):
        patient.refuse(refusal)
        patient._waiting.clear()  # it was sent
        clock.now += 0.2
    assert not patient.closed
    hasty = Connection(socket)
    for count in range(100):
        assert not hasty.closed, count
        hasty.refuse(refusal)
    await hasty.run()
    assert socket.reason.startswith("100 messages were refused")


def test_whoever_says_anything_is_no_longer_silent():
    """Catches a client that is closed as silent though it speaks."""
    connection = Connection(None)
    connection.last_heard = 0.0
    assert connection.may_send(10) and connection.last_heard > 0.0
