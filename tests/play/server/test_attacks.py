"""Attacks: whatever a client sends is limited, only that client is refused, and others play on."""

import asyncio
import threading
from collections import Counter
from unittest.mock import Mock

from swarm_pz.play import protocol
from swarm_pz.play.game import TableConfig
from swarm_pz.play.server import lobby as lobby_module
from swarm_pz.play.server import rendered_command
from swarm_pz.play.server.app import Server
from swarm_pz.play.server.client_handler import ClientHandler
from swarm_pz.play.server.connection import MOST_LONG_PER_SECOND
from swarm_pz.play.server.connection import Connection as RealConnection
from swarm_pz.play.server.lobby import MOST_GUESSES
from swarm_pz.play.server.middleware import MOST_CONNECTIONS, MOST_PATH_BYTES
from swarm_pz.play.server.room import MOST_WATCHERS
from swarm_pz.play.server.room_settings import RoomPlan
from tests.play.server.test_client_handler import Guest
from tests.play.server.test_connection import Socket
from tests.play.server.test_room import Client, code_of, until

ALONE = protocol.Create(settings=protocol.Settings(blue=0, time_limit=None))
LARGE = protocol.CommandMessage(
    1, strokes=[protocol.StrokeMessage("attract", 0.3, [(k % 2 + 0.01, round(k / 4500, 4)) for k in range(300)] * 12)]
)
ATTACKER, OTHER = "192.0.2.66", "192.0.2.1"


class Attacker:
    """A client with a real connection object."""

    def __init__(self, hall):
        self.connection = RealConnection(Socket(), ATTACKER)
        self.handler = ClientHandler(hall, self.connection)
        self.say(protocol.Hello())

    def say(self, message):
        self.handler.hear(protocol.encode(message))

    def refused(self):
        """Count the refusals that wait to be sent to it."""
        messages = [protocol.decode_server(data) for data in self.connection._waiting if isinstance(data, str)]
        return Counter(message.code for message in messages if isinstance(message, protocol.Refused))


def peaceful(hall):
    guest = Guest(hall)
    guest.say(ALONE)
    guest.say(protocol.Ready())
    return guest


async def plays_on(guest):
    """Return true if a game goes on without a missing frame."""
    count = len(guest.frames)
    await until(lambda: len(guest.frames) > count + 10)
    sequences = [sequence for _, sequence in guest.frames]
    return sequences == list(range(sequences[0], sequences[0] + len(sequences)))


# --- messages -------------------------------------------------------------------------------------


async def test_a_flood_of_drawings_is_painted_a_few_a_client_and_not_where_games_run(hall, clock, monkeypatch):
    threads, paint = [], rendered_command.density_of

    def noted(*given):
        threads.append(threading.current_thread())
        return paint(*given)

    monkeypatch.setattr(rendered_command, "density_of", noted)
    guest, attackers = peaceful(hall), [Attacker(hall) for _ in range(5)]
    for attacker in attackers:
        attacker.say(ALONE)
        attacker.say(protocol.Ready())
        for _ in range(15):
            attacker.say(LARGE)
    assert all(attacker.refused() == {"too_many": 15 - MOST_LONG_PER_SECOND} for attacker in attackers)
    await until(lambda: all(attacker.handler._rendering is None for attacker in attackers))
    assert 5 <= len(threads) <= 5 * MOST_LONG_PER_SECOND
    assert len(set(threads)) == 1 and threading.current_thread() not in threads
    assert await plays_on(guest)


async def test_a_command_without_a_seat_is_refused_before_it_is_read(hall, monkeypatch):
    stranger, player = Attacker(hall), Attacker(hall)
    player.say(ALONE)
    read = Mock(side_effect=protocol.decode_client)
    monkeypatch.setattr(protocol, "decode_client", read)
    stranger.say(LARGE)
    read.assert_not_called()
    assert stranger.refused() == {"out_of_turn": 1}
    player.say(LARGE)
    read.assert_called_once()


# --- connections and paths ------------------------------------------------------------------------


async def answer_of(app, path="/status", address=ATTACKER, receive=None):
    """Return the status and text of the response to a request."""
    scope = {"type": "http", "method": "GET", "path": path, "raw_path": path.encode(), "client": (address, 5)}
    scope |= {"headers": [(b"host", b"here")], "query_string": b""}
    sent = []

    async def send(message):
        sent.append(message)

    async def wait():
        await asyncio.Event().wait()

    await app(scope, receive or wait, send)
    return sent[0]["status"], b"".join(message.get("body", b"") for message in sent[1:]).decode()


async def test_an_address_has_so_many_connections_and_others_have_theirs(hall, monkeypatch):
    gate = asyncio.Event()

    async def slowly():
        await gate.wait()
        return []

    monkeypatch.setattr(hall, "recordings", slowly)
    app = Server(hall).app(["here"])
    held = [asyncio.create_task(answer_of(app, "/recordings")) for _ in range(MOST_CONNECTIONS)]
    await asyncio.sleep(0)
    status, text = await answer_of(app)
    assert status == 429 and f"{MOST_CONNECTIONS} connections" in text
    assert (await answer_of(app, address=OTHER))[0] == 200
    gate.set()
    assert {status for status, _ in await asyncio.gather(*held)} == {200}
    assert (await answer_of(app))[0] == 200


async def test_a_long_path_is_not_looked_for(hall):
    app = Server(hall).app(["here"])
    assert (await answer_of(app, "/" + "a" * (MOST_PATH_BYTES - 1)))[0] == 404
    assert (await answer_of(app, "/" + "a" * MOST_PATH_BYTES))[0] == 414


# --- rooms ----------------------------------------------------------------------------------------


async def test_a_room_has_so_many_watchers(hall):
    room = hall.open_room(RoomPlan(config=TableConfig()))
    watchers = [Client() for _ in range(MOST_WATCHERS)]
    for watcher in watchers:
        room.watch(watcher)
    assert code_of(room.watch, Client()) == "full"
    room.watch(watchers[0])
    room.sit(watchers[1], "red", "")
    room.watch(Client())


async def test_an_address_that_guesses_codes_is_told_of_no_room_any_more(hall, clock):
    room = hall.open_room(RoomPlan(config=TableConfig()))
    for _ in range(MOST_GUESSES):
        assert code_of(hall.find_room, "0000", ATTACKER) == "unknown"
    assert code_of(hall.find_room, room.code, ATTACKER) == "too_many"
    assert hall.find_room(room.code.lower(), OTHER) is room
    clock.now += lobby_module.GUESSES_S
    assert hall.find_room(room.code, ATTACKER) is room


async def test_policies_count_in_the_cost_of_a_room(hall, monkeypatch):
    monkeypatch.setattr(lobby_module, "MOST_ROOMS", 3.0)
    guest, other = Guest(hall), Guest(hall)
    assert guest.say(protocol.Create(opponent="ring")) is None and hall.room().cost == 1.25
    assert other.say(protocol.Create(seat="watch", player="ring", opponent="ring")) is None
    guest.say(protocol.Leave())
    assert guest.say(protocol.Create(opponent="ring")) is None
    assert sum(room.cost for room in hall.rooms.values()) == 2.75
    assert Guest(hall).say(protocol.Create(opponent="ring")) == "full"
