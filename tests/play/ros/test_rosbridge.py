"""The rosbridge protocol: what clients say, what they are sent, and what is refused."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import time
from types import SimpleNamespace
from unittest.mock import AsyncMock, Mock

import cbor2
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from swarm_pz.errors import ProtocolError
from swarm_pz.play.ros import connection, rosbridge
from swarm_pz.play.ros.rosbridge import Rosbridge

TOPICS = {"/clock": "rosgraph_msgs/Clock", "/status": "std_msgs/String"}
INPUTS = {"/clear_locs": "std_msgs/Empty"}


class Ear:
    """Keeps what it hears."""

    def __init__(self):
        self.told, self.gone = [], 0

    def heard(self, client, topic, message):
        if topic == "/bad":
            raise ProtocolError("expected nothing here")
        self.told.append((topic, message))

    def called(self, client, service, arguments):
        raise ProtocolError(f"there is no service {service}")

    def refused(self, client, text):
        pass

    def left(self, client):
        self.gone += 1


def talk(conversation):
    """Run a conversation: a coroutine function of the bridge, its ear, and a function that connects."""

    async def run():
        ear = Ear()
        bridge = Rosbridge(ear, TOPICS, frozenset({"/status"}), INPUTS)
        listening = socket.create_server(("127.0.0.1", 0))
        port = listening.getsockname()[1]
        await bridge.open(listening)
        try:
            await asyncio.wait_for(
                conversation(bridge, ear, lambda: connect(f"ws://127.0.0.1:{port}", max_size=None)), 300
            )
        finally:
            await bridge.close()

    asyncio.run(run())


async def say(socket, **told):
    await socket.send(json.dumps(told))


async def hear_all(socket):
    """Receive until the connection ends."""
    while True:
        await socket.recv()


async def ask(socket, service, **arguments):
    """Call a service, and return its answer; all that was said before has been heard then."""
    await say(socket, op="call_service", service=service, args=arguments, id="q")
    while True:
        answer = json.loads(await socket.recv())
        if answer["op"] == "service_response":
            assert answer["id"] == "q" and answer["service"] == service
            return answer


def test_a_subscriber_is_sent_what_is_published_in_json_or_cbor():
    async def conversation(bridge, ear, join):
        async with join() as one, join() as other:
            await say(
                one, op="subscribe", topic="clock", type="rosgraph_msgs/msg/Clock", throttle_rate=0, queue_length=1
            )
            await say(other, op="subscribe", topic="/clock", compression="cbor", fragment_size=1000)
            for socket in (one, other):
                await ask(socket, "/rosapi/nodes")
            assert bridge.wanted("/clock") and not bridge.wanted("/status")
            bridge.publish("/clock", {"clock": {"sec": 1, "nanosec": 2}})
            expected = {"op": "publish", "topic": "/clock", "msg": {"clock": {"sec": 1, "nanosec": 2}}}
            assert json.loads(await one.recv()) == expected
            assert cbor2.loads(await other.recv()) == expected
            await say(one, op="unsubscribe", topic="/clock")
            await ask(one, "/rosapi/nodes")
            bridge.publish("/clock", {})
            assert (await ask(one, "/rosapi/nodes"))["values"] == {"nodes": ["/swarm_pz"]}

    talk(conversation)


def test_what_is_published_is_heard_with_the_topics_full_name():
    async def conversation(bridge, ear, join):
        async with join() as socket:
            await say(socket, op="advertise", topic="red_connection_service", type="std_msgs/Empty")
            await say(socket, op="publish", topic="red_connection_service", msg={})
            await socket.send(cbor2.dumps({"op": "publish", "topic": "/x", "msg": {"data": [1.5]}}))
            found = await ask(socket, "/rosapi/topics")
            kind = await ask(socket, "/rosapi/topic_type", topic="red_connection_service")
        assert ear.told == [("/red_connection_service", {}), ("/x", {"data": [1.5]})]
        pairs = dict(zip(found["values"]["topics"], found["values"]["types"], strict=True))
        assert pairs == TOPICS | INPUTS | {"/red_connection_service": "std_msgs/Empty"}
        assert kind["values"] == {"type": "std_msgs/Empty"} and kind["result"] is True

    talk(conversation)


def test_who_reads_slowly_is_sent_the_latest_and_of_events_all():
    async def conversation(bridge, ear, join):
        async with join() as socket:
            for topic in TOPICS:
                await say(socket, op="subscribe", topic=topic)
            await ask(socket, "/rosapi/nodes")
            for number in range(100):
                bridge.publish("/clock", {"n": number})
                bridge.publish("/status", {"n": number})
            events = [json.loads(await socket.recv()) for _ in range(100)]
            assert [(told["topic"], told["msg"]["n"]) for told in events] == [("/status", n) for n in range(100)]
            last = json.loads(await socket.recv())
            assert (last["topic"], last["msg"]["n"]) == ("/clock", 99)

    talk(conversation)


def test_a_subscriber_may_want_fewer_messages():
    async def conversation(bridge, ear, join):
        async with join() as socket:
            await say(socket, op="subscribe", topic="/status", throttle_rate=1e6)
            await ask(socket, "/rosapi/nodes")
            for number in range(3):
                bridge.publish("/status", {"n": number})
            assert json.loads(await socket.recv())["msg"] == {"n": 0}
            await ask(socket, "/rosapi/nodes")
            with pytest.raises(TimeoutError):
                await asyncio.wait_for(socket.recv(), 0.1)

    talk(conversation)


def test_who_wants_fewer_messages_is_sent_one_when_so_many_milliseconds_have_passed(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(rosbridge, "time", SimpleNamespace(monotonic=lambda: now[0]))

    async def conversation(bridge, ear, join):
        async with join() as socket, join() as both:
            for one in (socket, both):
                await say(one, op="subscribe", topic="/status", throttle_rate=100, id="a")
            await say(both, op="subscribe", topic="/status", throttle_rate=0, id="b")  # who asks for most gets it
            for one in (socket, both):
                await ask(one, "/rosapi/nodes")
            for number in range(6):
                now[0] = 0.0625 * number
                bridge.publish("/status", {"n": number})
            for one, expected in ((socket, [0, 2, 4]), (both, [0, 1, 2, 3, 4, 5])):
                await say(one, op="call_service", service="/rosapi/nodes", id="q")
                came = []
                while (told := json.loads(await one.recv()))["op"] == "publish":
                    came.append(told["msg"]["n"])
                assert came == expected

    talk(conversation)


def test_an_unsubscription_is_of_the_subscription_that_it_names():
    async def conversation(bridge, ear, join):
        async with join() as socket:
            for name in ("a", "b"):
                await say(socket, op="subscribe", topic="/status", id=name)
            for name, is_wanted in (("a", True), ("c", True), ("b", False)):
                await say(socket, op="unsubscribe", topic="status", id=name)
                await ask(socket, "/rosapi/nodes")
                assert bridge.wanted("/status") == is_wanted

    talk(conversation)


@pytest.mark.parametrize("name", ["own", "/own"])
def test_a_topic_is_one_with_and_without_its_slash(name):
    async def conversation(bridge, ear, join):
        async with join() as socket:
            await say(socket, op="advertise", topic="own", type="std_msgs/msg/String")
            kind = await ask(socket, "/rosapi/topic_type", topic=name)
            await say(socket, op="call_service", service="/rosapi/topic_type", args=[name], id="q")
            assert kind["values"] == json.loads(await socket.recv())["values"] == {"type": "std_msgs/String"}
            await say(socket, op="unadvertise", topic=name)
            assert (await ask(socket, "/rosapi/topic_type", topic="own"))["values"] == {"type": ""}

    talk(conversation)


@pytest.mark.parametrize(
    ("frame", "said"),
    [
        ("{", "must be a JSON object"),
        ("[1]", "an object with an op"),
        ('{"op": 3}', "an object with an op"),
        ('{"op": "fly"}', "op must be one of advertise"),
        ('{"op": "publish", "topic": "/x", "msg": {"data": NaN}}', "NaN is no number of JSON"),
        ('{"op": "publish", "topic": "/x", "msg": 7}', "msg must be an object"),
        ('{"op": "publish", "topic": 7}', "topic must be a text"),
        ('{"op": "publish", "topic": "/bad"}', "expected nothing here"),
        ('{"op": "advertise", "topic": "/x"}', "type must be a text"),
        ('{"op": "advertise", "topic": "clear_locs", "type": "std_msgs/String"}', "is of type std_msgs/Empty, got"),
        ('{"op": "subscribe", "topic": "/x", "compression": "cbor-raw"}', "cbor-raw is for the topics that"),
        (cbor2.dumps({"op": "subscribe", "topic": "/x", "throttle_rate": 10**5000}), "got a large number"),
        (cbor2.dumps({"op": "set_level", "level": "info", "id": 10**5000}), "id must be a text, got a large number"),
        ('{"op": "subscribe", "topic": "/x", "compression": "png"}', "compression must be one of none, cbor"),
        ('{"op": "subscribe", "topic": "/x", "throttle_rate": -1}', "throttle_rate must be milliseconds"),
        ('{"op": "subscribe", "topic": "/clock", "type": "std_msgs/String"}', "is of type rosgraph_msgs/Clock"),
        ('{"op": "set_level", "level": "loud"}', "level must be one of"),
        (b"\xff\xff", "must be a JSON object"),
        ("[" * 100_000, "must be a JSON object"),
    ],
)
def test_a_message_that_is_none_is_refused_in_words_to_who_asks_for_words(frame, said):
    async def conversation(bridge, ear, join):
        async with join() as quiet, join() as socket:
            await say(socket, op="set_level", level="warning")
            for one in (quiet, socket):
                await one.send(frame)
            told = json.loads(await socket.recv())
            assert told["op"] == "status" and told["level"] == "error" and said in told["msg"]
            assert (await ask(quiet, "/rosapi/nodes"))["result"] is True

    talk(conversation)


def test_a_call_that_nobody_answers_is_said_to_fail():
    async def conversation(bridge, ear, join):
        async with join() as socket:
            answer = await ask(socket, "/teleport")
            assert (answer["result"], answer["values"]) == (False, "there is no service /teleport")
            before = time.time_ns()
            told = (await ask(socket, "/rosapi/get_time"))["values"]["time"]
            assert (told["secs"], told["nsecs"]) == (told["sec"], told["nanosec"])
            assert before <= told["secs"] * 10**9 + told["nsecs"] <= time.time_ns() and told["nsecs"] < 10**9

    talk(conversation)


def number_of(size):
    """Return a whole number of so many bytes, as CBOR has it."""
    return b"\xc2" + cbor2.dumps(b"\xff" * size)


@pytest.mark.parametrize(
    "bomb",
    [
        b"\xc4\x82\x01" + number_of(10**6),  # a decimal fraction of millions of digits
        b"\xc5\x82\x01" + number_of(10**6),
        b"\xd8\x1e\x82" + number_of(4 * 10**5) + number_of(4 * 10**5),
        b"\xd8\x23" + cbor2.dumps("(a|b)*" * 100_000),  # a pattern to be compiled
        b"\xd8\x24" + cbor2.dumps("X: " + " \n" * 100_000),  # a mail to be read
        cbor2.dumps({(2**61 - 1) * number: 0 for number in range(1, 30_000)}),  # numbers of one hash
        cbor2.dumps(cbor2.CBORTag(70_000, [])),
        b"\x81" * 10**6,
    ],
)
def test_what_takes_long_to_decode_is_not_decoded(bomb):
    async def conversation(bridge, ear, join):
        async with join() as socket:
            await say(socket, op="set_level", level="error")
            await socket.send(b"\xa2\x62op\x67publish\x61x" + bomb)
            told = json.loads(await socket.recv())
            assert told["op"] == "status" and "a message must be a JSON object" in told["msg"]
            assert (await ask(socket, "/rosapi/nodes"))["result"]

    talk(conversation)


def test_what_nobody_thought_of_is_refused_to_that_client_alone():
    async def conversation(bridge, ear, join):
        async with join() as socket:
            ear.heard = lambda *_: 1 / 0
            await say(socket, op="set_level", level="error")
            await say(socket, op="publish", topic="/x", msg={})
            assert json.loads(await socket.recv())["msg"] == "the server could not do that"
            answer = await ask(socket, "/rosapi/topic_type", topic=["/clock"])
            assert answer["result"] is False and "topic must be a text" in answer["values"]

    talk(conversation)


def test_names_are_bounded_however_many_clients_there_are():
    async def conversation(bridge, ear, join):
        async with contextlib.AsyncExitStack() as stack:
            sockets = [await stack.enter_async_context(join()) for _ in range(4)]
            for number, socket in enumerate(sockets):
                for topic in range(5):
                    await say(socket, op="advertise", topic=f"/own/{number}/{topic}", type="std_msgs/String")
                await say(socket, op="advertise", topic="/clear_locs", type="std_msgs/Empty")
                assert (await ask(socket, "/rosapi/nodes"))["result"]
            found = (await ask(sockets[0], "/rosapi/topics"))["values"]["topics"]
            assert len([topic for topic in found if topic.startswith("/own")]) == 12
            await say(sockets[0], op="set_level", level="error")
            for number in range(257):
                await say(sockets[0], op="subscribe", topic="/clock", id=f"{number}")
            assert "256 times" in json.loads(await sockets[0].recv())["msg"]
            await say(sockets[0], op="subscribe", topic="/clock", id="x" * 257)
            assert "id must be a text of at most 256" in json.loads(await sockets[0].recv())["msg"]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rosbridge, "_MOST_OTHERS", 12)
        talk(conversation)


def test_who_says_nothing_but_nonsense_is_shown_out(monkeypatch):
    monkeypatch.setattr(connection, "_PATIENCE_S", 1e9)

    async def conversation(bridge, ear, join):
        async with join() as socket:
            with contextlib.suppress(ConnectionClosed):
                for _ in range(1000):
                    await socket.send("{")
            with pytest.raises(ConnectionClosed, match="100 messages were refused"):
                await socket.recv()
        async with join() as other:
            await ask(other, "/rosapi/nodes")
            assert ear.gone == 1

    talk(conversation)


def test_topics_of_one_client_are_bounded():
    async def conversation(bridge, ear, join):
        async with join() as socket:
            await say(socket, op="set_level", level="error")
            for number in range(257):
                await say(socket, op="advertise", topic=f"/{number}", type="std_msgs/Empty")
            assert "may advertise 256 topics" in json.loads(await socket.recv())["msg"]

    talk(conversation)


def test_viewers_of_ros_2_are_told_all_types_and_sent_bytes():
    async def conversation(bridge, ear, join):
        async with join() as socket:
            told = (await ask(socket, "/rosapi/topics_and_raw_types"))["values"]
            assert told["topics"] == ["/clear_locs", "/clock", "/status"]
            assert told["types"] == ["std_msgs/msg/Empty", "rosgraph_msgs/msg/Clock", "std_msgs/msg/String"]
            assert told["typedefs_full_text"][1].startswith("builtin_interfaces/Time clock\n====")
            await say(socket, op="subscribe", topic="/status", compression="cbor-raw")
            await ask(socket, "/rosapi/nodes")
            before = time.time_ns()
            bridge.publish("/status", {"data": "agent3 red"})
            sent = cbor2.loads(await socket.recv())
            assert sent["topic"] == "/status"
            assert before <= sent["msg"]["secs"] * 10**9 + sent["msg"]["nsecs"] <= time.time_ns()
            assert sent["msg"]["bytes"] == b"\x00\x01\x00\x00\x0b\x00\x00\x00agent3 red\x00"

    talk(conversation)


def test_who_never_reads_is_given_up_and_disturbs_nobody(monkeypatch):
    monkeypatch.setattr(connection, "_MOST_WAITING", 100_000)

    async def conversation(bridge, ear, join):
        async with join() as deaf, join() as other:
            for socket in (deaf, other):
                await say(socket, op="subscribe", topic="/status")
                await ask(socket, "/rosapi/nodes")
            await say(other, op="unsubscribe", topic="/status")
            await ask(other, "/rosapi/nodes")
            for _ in range(200):
                bridge.publish("/status", {"data": 1000 * "x"})
            assert (await ask(other, "/rosapi/nodes"))["result"] is True
            with pytest.raises(ConnectionClosed, match="too slow"):
                await hear_all(deaf)

    talk(conversation)


def test_a_message_may_be_of_a_megabyte():
    async def conversation(bridge, ear, join):
        async with join() as socket:
            await say(socket, op="publish", topic="/x", msg={"data": "x" * (2**20 - 1000)})
            await ask(socket, "/rosapi/nodes")
            assert len(ear.told[0][1]["data"]) > 10**6

    talk(conversation)


def test_a_larger_message_ends_the_connection(monkeypatch):
    monkeypatch.setattr(rosbridge, "MAX_MESSAGE_BYTES", 1000)

    async def conversation(bridge, ear, join):
        async with join() as socket:
            await say(socket, op="publish", topic="/x", msg={"data": "x" * 1000})
            with pytest.raises(ConnectionClosed, match="1009"):
                await hear_all(socket)
        async with join() as other:
            await ask(other, "/rosapi/nodes")
        assert not ear.told

    talk(conversation)


def test_what_a_client_says_is_charged_and_who_overdraws_is_told_why_it_is_read_more_slowly(monkeypatch):
    account = Mock(charged=Mock(side_effect=contextlib.nullcontext), debt_s=lambda: 9.0, turn=AsyncMock())
    monkeypatch.setattr(rosbridge, "Accounts", lambda *_: Mock(of=lambda _: account))

    async def conversation(bridge, ear, join):
        async with join() as socket:
            await say(socket, op="set_level", level="warning")
            assert "read more slowly" in json.loads(await socket.recv())["msg"]
            await say(socket, op="publish", topic="/x", msg={"data": 2000 * "x"})
            await ask(socket, "/rosapi/nodes")
        assert [call.kwargs["in_line"] for call in account.turn.await_args_list] == [False, True, False]
        assert account.charged.call_count == 3

    talk(conversation)
