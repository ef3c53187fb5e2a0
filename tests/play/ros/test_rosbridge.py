"""The rosbridge protocol: what clients say, what they are sent, and what is refused."""

from __future__ import annotations

import asyncio
import contextlib
import json

import cbor2
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from swarm_pz.errors import ProtocolError
from swarm_pz.play.ros.rosbridge import Rosbridge

TOPICS = {"/clock": "rosgraph_msgs/Clock", "/status": "std_msgs/String"}


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

    def left(self, client):
        self.gone += 1


def talk(conversation):
    """Run a conversation: a coroutine function of the bridge, its ear, and a function that connects."""

    async def run():
        ear = Ear()
        bridge = Rosbridge(ear, TOPICS, frozenset({"/status"}))
        port = await bridge.open("127.0.0.1", 0)
        try:
            await asyncio.wait_for(
                conversation(bridge, ear, lambda: connect(f"ws://127.0.0.1:{port}", max_size=None)), 30
            )
        finally:
            await bridge.close()

    asyncio.run(run())


async def say(socket, **told):
    await socket.send(json.dumps(told))


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
        assert pairs == TOPICS | {"/red_connection_service": "std_msgs/Empty"}
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
            time = (await ask(socket, "/rosapi/get_time"))["values"]["time"]
            assert time["secs"] == time["sec"] > 1e9

    talk(conversation)


def test_who_says_nothing_but_nonsense_is_shown_out():
    async def conversation(bridge, ear, join):
        async with join() as socket:
            with contextlib.suppress(ConnectionClosed):
                for _ in range(1000):
                    await socket.send("{")
            with pytest.raises(ConnectionClosed, match="101 messages were refused"):
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
