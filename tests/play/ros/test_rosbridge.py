"""The rosbridge protocol: what clients send, what they receive, and what is refused."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
import time
from types import SimpleNamespace

import cbor2
import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed, InvalidStatus

from swarm_pz.errors import CommandError, ProtocolError
from swarm_pz.play.ros import rosbridge
from swarm_pz.play.ros.rosbridge import Rosbridge, origins_of

TOPICS = {"/clock": "rosgraph_msgs/Clock", "/status": "std_msgs/String", "/rosout": "rcl_interfaces/Log"}
INPUTS = {"/clear_locs": "std_msgs/Empty"}
HOME = origins_of("127.0.0.1")


class Hub(Rosbridge):
    """A rosbridge that keeps what it hears."""

    def __init__(self):
        super().__init__(TOPICS, INPUTS, every=frozenset({"/status"}))
        self.received = []

    def heard(self, client, topic, message):
        if topic == "/bad":
            raise ProtocolError("expected nothing here")
        self.received.append((topic, message if topic != "/odd" else 1 / 0))

    def join(self, **options):
        return connect(f"ws://127.0.0.1:{self.port}", max_size=None, **options)


@contextlib.asynccontextmanager
async def opened(origins=HOME):
    """Give a hub that serves."""
    hub, listening = Hub(), socket.create_server(("127.0.0.1", 0))
    hub.port = listening.getsockname()[1]
    serving = asyncio.create_task(hub.serve_at(listening, origins))
    try:
        yield hub
    finally:
        serving.cancel()
        await asyncio.wait([serving])


@pytest.fixture
def anyio_backend():
    return "asyncio"


@pytest.fixture
async def hub():
    async with opened() as hub:
        yield hub


async def say(socket, **message):
    await socket.send(json.dumps(message))


async def hear(socket):
    return json.loads(await socket.recv())


async def hear_all(socket):
    """Receive until the connection ends."""
    while True:
        await socket.recv()


async def ask(socket, service="/rosapi/nodes", **arguments):
    """Call a service, and return its response; all earlier messages have been handled by then."""
    await say(socket, op="call_service", service=service, args=arguments, id="q")
    while True:
        answer = await hear(socket)
        if answer["op"] == "service_response":
            assert answer["id"] == "q" and answer["service"] == service
            return answer


async def test_a_subscriber_is_sent_what_is_published_until_its_last_subscription_ends(hub):
    async with hub.join() as socket:
        await say(
            socket, op="subscribe", topic="clock", type="rosgraph_msgs/msg/Clock", throttle_rate=0, queue_length=1
        )
        await ask(socket)
        assert hub.wanted("/clock") and not hub.wanted("/status")
        hub.publish("/clock", {"clock": {"sec": 1, "nanosec": 2}})
        assert await hear(socket) == {"op": "publish", "topic": "/clock", "msg": {"clock": {"sec": 1, "nanosec": 2}}}
        await say(socket, op="unsubscribe", topic="/clock")
        await ask(socket)
        hub.publish("/clock", {})
        assert (await ask(socket))["values"] == {"nodes": ["/swarm_pz"]}
        for name in ("a", "b"):
            await say(socket, op="subscribe", topic="/status", id=name)
        for name, is_wanted in (("a", True), ("c", True), ("b", False)):
            await say(socket, op="unsubscribe", topic="status", id=name)
            await ask(socket)
            assert hub.wanted("/status") == is_wanted, "an unsubscription is of the subscription that it names"


async def test_publications_reach_the_hub_by_full_name_and_services_answer_or_say_that_they_fail(hub):
    async with hub.join() as socket:
        await say(socket, op="advertise", topic="own", type="std_msgs/msg/String")
        await say(socket, op="publish", topic="own", msg={"data": [1.5]})
        listed = (await ask(socket, "/rosapi/topics"))["values"]
        assert hub.received == [("/own", {"data": [1.5]})]
        assert dict(zip(listed["topics"], listed["types"], strict=True)) == TOPICS | INPUTS
        for name, kind in (("clock", "rosgraph_msgs/Clock"), ("/own", "")):
            assert (await ask(socket, "/rosapi/topic_type", topic=name))["values"] == {"type": kind}
        answer = await ask(socket, "/teleport")
        assert answer["result"] is False and "no service /teleport" in answer["values"]
        before = time.time_ns()
        now = (await ask(socket, "/rosapi/get_time"))["values"]["time"]
        assert (now["secs"], now["nsecs"]) == (now["sec"], now["nanosec"])
        assert before <= now["secs"] * 10**9 + now["nsecs"] <= time.time_ns() and now["nsecs"] < 10**9


async def test_viewers_of_ros_2_are_told_all_types_and_sent_bytes(hub):
    async with hub.join() as socket:
        listed = (await ask(socket, "/rosapi/topics_and_raw_types"))["values"]
        assert listed["topics"] == ["/clear_locs", "/clock", "/status", "/rosout"]
        assert listed["types"][:2] == ["std_msgs/msg/Empty", "rosgraph_msgs/msg/Clock"]
        assert listed["typedefs_full_text"][1].startswith("builtin_interfaces/Time clock\n====")
        await say(socket, op="subscribe", topic="/status", compression="cbor-raw")
        await ask(socket)
        before = time.time_ns()
        hub.publish("/status", {"data": "agent3 red"})
        sent = cbor2.loads(await socket.recv())
        assert sent["topic"] == "/status"
        assert before <= sent["msg"]["secs"] * 10**9 + sent["msg"]["nsecs"] <= time.time_ns()
        assert sent["msg"]["bytes"] == b"\x00\x01\x00\x00\x0b\x00\x00\x00agent3 red\x00"


async def test_a_slow_reader_is_sent_the_latest_and_of_events_all(hub):
    async with hub.join() as socket:
        for topic in TOPICS:
            await say(socket, op="subscribe", topic=topic)
        await ask(socket)
        for number in range(100):
            hub.publish("/clock", {"n": number})
            hub.publish("/status", {"n": number})
        received = [await hear(socket) for _ in range(101)]
        assert [(one["topic"], one["msg"]["n"]) for one in received] == [
            *(("/status", number) for number in range(100)),
            ("/clock", 99),
        ]


async def test_a_throttled_subscriber_is_sent_a_message_when_so_many_milliseconds_have_passed(hub, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(rosbridge, "time", SimpleNamespace(monotonic=lambda: now[0]))
    for throttles, expected in (([100], [0, 2, 4]), ([100, 0, 100], [0, 1, 2, 3, 4, 5])):  # the smallest one counts
        async with hub.join() as socket:
            for name, milliseconds in enumerate(throttles):
                await say(socket, op="subscribe", topic="/status", throttle_rate=milliseconds, id=str(name))
            await ask(socket)
            for number in range(6):
                now[0] += 0.0625
                hub.publish("/status", {"n": number})
            assert [(await hear(socket))["msg"]["n"] for _ in expected] == expected
            assert await ask(socket)


@pytest.mark.parametrize(
    ("frame", "said"),
    [
        (b"\xff\xfe", "JSON object"),
        ("[]", "JSON object"),
        ("[" * 100_000, "JSON object"),
        ('{"op": ["publish"]}', "op must be publish, "),
        ('{"op": "publish", "topic": "/bad"}', "expected nothing here"),
        ('{"op": "publish", "topic": "/odd"}', "could not do that"),
        ('{"op": "publish", "topic": "/x", "msg": 3}', "msg must be an object"),
        ('{"op": "advertise", "topic": "clear_locs", "type": "std_msgs/String"}', "of type std_msgs/Empty"),
        ('{"op": "subscribe", "topic": "/clock", "type": "std_msgs/String"}', "of type rosgraph_msgs/Clock"),
        ('{"op": "subscribe", "topic": "/clok"}', "did you mean '/clock'"),
        ('{"op": "subscribe", "topic": "/clock", "compression": "png"}', "none or cbor-raw, got 'png'"),
        ('{"op": "subscribe", "topic": "/clock", "throttle_rate": -1}', "0 or more"),
        ('{"op": "subscribe", "topic": "/clock", "id": "%s"}' % (257 * "x"), "1 to 256 characters"),
    ],
    ids=range(13),
)
async def test_a_message_that_makes_no_sense_is_refused_in_the_log_of_its_sender(hub, frame, said):
    async with hub.join() as quiet, hub.join() as socket:
        await say(socket, op="subscribe", topic="/rosout")
        for one in (quiet, socket):
            await one.send(frame)
        refusal = await hear(socket)
        assert refusal["topic"] == "/rosout" and said in refusal["msg"]["msg"]
        assert (await ask(quiet))["result"] is True


async def test_subscriptions_of_one_client_are_bounded(hub):
    async with hub.join() as socket:
        await say(socket, op="subscribe", topic="/rosout")
        for number in range(257):
            await say(socket, op="subscribe", topic="/clock", id=f"{number}")
        assert "256 times" in (await hear(socket))["msg"]["msg"]


async def test_a_client_that_never_reads_is_given_up_and_disturbs_nobody(hub, monkeypatch):
    monkeypatch.setattr(rosbridge, "_MOST_WAITING", 100_000)
    async with hub.join() as deaf, hub.join() as other:
        await say(deaf, op="subscribe", topic="/status")
        await ask(deaf)
        for _ in range(200):
            hub.publish("/status", {"data": 1000 * "x"})
        assert (await ask(other))["result"] is True
        with pytest.raises(ConnectionClosed, match="too slow"):
            await hear_all(deaf)


async def test_a_message_may_be_of_a_megabyte_and_a_larger_one_ends_the_connection(hub):
    async with hub.join() as socket:
        await say(socket, op="publish", topic="/x", msg={"data": "x" * (2**20 - 1000)})
        await ask(socket)
        await say(socket, op="publish", topic="/x", msg={"data": "x" * 2**20})
        with pytest.raises(ConnectionClosed, match="1009"):
            await hear_all(socket)
    assert [len(message["data"]) for _, message in hub.received] == [2**20 - 1000]


def test_a_client_over_its_messages_or_bytes_a_second_is_read_no_faster(monkeypatch):
    client = rosbridge.Client(None)
    monkeypatch.setattr(rosbridge.time, "monotonic", lambda: 100.0)
    pauses = [client.pause_after(10) for _ in range(1000)]
    assert pauses[100] == 0.0 and pauses[-1] == pytest.approx(4.0), "1,000 messages take 5 s, of which 1 s is a burst"
    other = rosbridge.Client(None)
    assert max(other.pause_after(2**20) for _ in range(40)) == pytest.approx(9.0)


PAGES = (None, "http://localhost:8000", "http://127.0.0.1", "https://lab.example", "http://localhost.evil.example")


async def admitted(hub):
    """Return which pages may connect."""
    found = []
    for page in (*PAGES, "file://"):
        try:
            async with hub.join(origin=page):
                found.append(True)
        except InvalidStatus:
            found.append(False)
    return found


async def test_programs_and_pages_of_this_machine_are_let_in_and_others_when_they_are_named(hub):
    assert await admitted(hub) == [True, True, True, False, False, False]
    async with opened(origins_of("127.0.0.1", ["https://LAB.example/", "file://"])) as named:
        assert await admitted(named) == [True, True, True, True, False, True]
    with pytest.raises(CommandError, match="--ros-origin"):
        origins_of("127.0.0.1", ["lab.example"])
