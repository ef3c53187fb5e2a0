"""Five clients do their worst at once: what that costs is bounded, whatever they send, and others play on."""

import asyncio
import threading
import time
from collections import Counter
from types import SimpleNamespace

import pytest

from swarm_pz.play import protocol
from swarm_pz.play.recordings.sandbox import Sandbox
from swarm_pz.play.server import connection, orders, replays
from swarm_pz.play.server.app import Server
from swarm_pz.play.server.client_handler import HELLO_S, ClientHandler
from swarm_pz.play.server.connection import Connection
from swarm_pz.play.server.lobby import MOST_EMPTY_ROOMS_OF_ADDRESS, MOST_ROOMS_OF_ADDRESS
from tests.play.recordings.test_format import record
from tests.play.recordings.test_playback import CALM
from tests.play.server.test_client_handler import Guest, visiting
from tests.play.server.test_connection import Socket
from tests.play.server.test_room import until

ALONE = protocol.Create(settings=protocol.Settings(blue=0, time_limit=None))
LARGE = protocol.CommandMessage(
    1, strokes=[protocol.StrokeMessage("attract", 0.3, [(k % 2 + 0.01, round(k / 4500, 4)) for k in range(300)] * 12)]
)


class Attacker:
    """A client with a connection as the server has it, whose clock stands still."""

    def __init__(self, hall, greets=True):
        self.connection = Connection(Socket(), "192.0.2.66")
        self.handler = ClientHandler(hall, self.connection)
        if greets:
            self.say(protocol.Hello())

    def say(self, message):
        self.handler.hear(protocol.encode(message))

    def told(self):
        """Return the messages that wait to be sent to it."""
        return [protocol.decode_server(data) for data in self.connection._waiting if isinstance(data, str)]

    def refused(self):
        return Counter(message.code for message in self.told() if isinstance(message, protocol.Refused))


@pytest.fixture
def still(monkeypatch):
    """Hold the clock by which messages are counted."""
    now = time.monotonic()
    monkeypatch.setattr(connection, "time", SimpleNamespace(monotonic=lambda: now))


@pytest.fixture
def elsewhere(monkeypatch):
    """Give the threads in which each kind of work was done."""
    threads = {}

    def note(place, name):
        work = getattr(place, name)

        def noted(*what):
            threads.setdefault(name, []).append(threading.current_thread())
            return work(*what)

        monkeypatch.setattr(place, name, noted)

    note(orders, "density_of")
    do = Sandbox.do

    def noted(sandbox, name, work, *given):
        threads.setdefault(given[1] if work is replays._ask else work.__name__, []).append(threading.current_thread())
        return do(sandbox, name, work, *given)

    monkeypatch.setattr(Sandbox, "do", noted)
    return threads


async def plays_on(guest):
    """Whether a game goes on, no tick left out."""
    count = len(guest.frames)
    await until(lambda: len(guest.frames) > count + 10)
    sequences = [sequence for _, sequence in guest.frames]
    return sequences == list(range(sequences[0], sequences[0] + len(sequences)))


def peaceful(hall):
    guest = Guest(hall)
    guest.say(ALONE)
    guest.say(protocol.Ready())
    return guest


def test_a_flood_of_drawings_is_painted_twice_a_client_and_not_where_games_run(still, elsewhere, tmp_path):
    assert 20_000 < len(protocol.encode(LARGE)) < protocol.MAX_MESSAGE_BYTES

    async def script(hall):
        guest, attackers = peaceful(hall), [Attacker(hall) for _ in range(5)]
        for attacker in attackers:
            attacker.say(ALONE)
            attacker.say(protocol.Ready())
            for _ in range(15):
                attacker.say(LARGE)
        affordable = 2 * protocol.MAX_MESSAGE_BYTES // len(protocol.encode(LARGE))
        assert all(attacker.refused() == {"too_many": 15 - affordable} for attacker in attackers)
        await until(lambda: all(attacker.handler._drawing is None for attacker in attackers))
        assert 5 <= len(elsewhere["density_of"]) <= 5 * affordable
        assert len(set(elsewhere["density_of"])) == 1 and threading.current_thread() not in elsewhere["density_of"]
        assert await plays_on(guest)

    visiting(tmp_path, script)


def test_floods_of_openings_seeks_and_take_overs_are_one_at_a_time_and_not_where_games_run(still, elsewhere, tmp_path):
    record(tmp_path / "a.jsonl", ticks=300, config=CALM)

    async def script(hall):
        guest, attackers = peaceful(hall), [Attacker(hall) for _ in range(5)]
        for attacker in attackers:
            for _ in range(3):
                attacker.say(protocol.OpenReplay("a.jsonl"))
        await until(lambda: len(hall.watched) == 5)
        assert len(elsewhere["_load"]) <= 2 * 5, "who asks again is read for once, and what had begun ends"
        await asyncio.sleep(0.1)
        elsewhere["picture"].clear()
        for attacker in attackers:
            attacker.say(protocol.Pace(0.0))
            for tick in range(10):
                attacker.say(protocol.Seek(20 * tick))
        await until(lambda: len(elsewhere["picture"]) >= 5)
        await asyncio.sleep(0.2)
        assert len(elsewhere["picture"]) <= 2 * 5, "of ten"
        for attacker in attackers:
            for _ in range(5):
                attacker.say(protocol.TakeOver("red", "uniform"))
        await until(lambda: len(hall.rooms) == 6)
        await asyncio.sleep(0.1)
        assert len(hall.rooms) == 6 and not hall.watched
        for kind in ("_load", "picture", "moment"):
            assert len(set(elsewhere[kind])) == 1 and threading.current_thread() not in elsewhere[kind], kind
        assert await plays_on(guest)

    visiting(tmp_path, script)


def test_who_fills_the_house_with_rooms_leaves_most_of_it_to_others(tmp_path):
    async def script(hall):
        guest = peaceful(hall)
        for _ in range(30):
            attackers = [Attacker(hall) for _ in range(5)]
            for attacker in attackers:
                attacker.say(ALONE)
                attacker.say(protocol.Ready())
            refused = attackers[-1].refused()
            for attacker in attackers:
                attacker.handler.end()
        assert refused == {"full": 1, "out_of_turn": 1}
        assert len(hall.rooms) <= MOST_EMPTY_ROOMS_OF_ADDRESS + 5 + 1
        assert len(list(tmp_path.glob("*.jsonl"))) <= MOST_ROOMS_OF_ADDRESS + 5, "nor are so many games begun"
        assert await plays_on(guest)

    visiting(tmp_path, script)


def test_who_says_nothing_and_who_reads_nothing_is_closed(tmp_path):
    async def script(hall):
        guest, server = peaceful(hall), Server(hall)
        silent = [Attacker(hall, greets=False) for _ in range(5)]
        deaf = [Attacker(hall) for _ in range(5)]
        server._handlers = {attacker.handler for attacker in (*silent, *deaf)}
        server.sweep(time.monotonic() + HELLO_S + 1.0)
        assert all(attacker.connection.closed for attacker in silent)
        assert not any(attacker.connection.closed for attacker in deaf)
        for attacker in deaf:
            for _ in range(300):
                attacker.connection.send(protocol.Pong(0.0, 0.0))
            assert attacker.connection.closed and not attacker.connection._waiting, "what waits is bounded"
        assert await plays_on(guest)

    visiting(tmp_path, script)
