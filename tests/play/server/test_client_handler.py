"""One client, message by message, without a network."""

import json
import re
import threading
from pathlib import Path

import numpy as np

from swarm_pz.play import protocol
from swarm_pz.play.protocol import SeatCommand, SeatMessage
from swarm_pz.play.server import rendered_command
from swarm_pz.play.server.app import Server
from swarm_pz.play.server.client_handler import HELLO_S, SILENT_S, ClientHandler
from swarm_pz.play.server.lobby import Lobby
from swarm_pz.play.server.server_context import ServerContext
from swarm_pz.play.strokes import density_of
from tests.play.server.test_room import Client, Workers, playing, read, until

ALONE = protocol.Create(settings=protocol.Settings(blue=0))
EYE = np.eye(10).tolist()


class Guest(Client):
    """A client with its handler, that has said hello."""

    def __init__(self, lobby, token=None, client=None):
        super().__init__()
        self.patience, self.acknowledged = True, []
        self.handler = ClientHandler(lobby, self)
        self.say(protocol.Hello(kind="person", token=token, client=client))

    def may_speak(self):
        return self.patience

    def may_send(self, size):
        return True

    def acknowledge(self, sequence):
        self.acknowledged.append(sequence)
        return True

    def refuse(self, refusal):
        self.messages.append(refusal)

    def say(self, message):
        """Send a message; return the code of its refusal, or None."""
        before = len(self.heard(protocol.Refused))
        self.handler.hear(protocol.encode(message))
        refused = self.heard(protocol.Refused)[before:]
        return refused[-1].code if refused else None

    async def refused(self, count=1):
        """Wait for `count` refusals, and return the last."""
        await until(lambda: len(self.heard(protocol.Refused)) >= count)
        return self.heard(protocol.Refused)[-1]


class Hall(Lobby):
    """A lobby without policy processes."""

    def __init__(self, folder, **options):
        workers = Workers()
        workers.close = lambda: None
        context = ServerContext(folder=folder, workers=workers, countdown_s=0.0)
        super().__init__(context, {"ring": "", "uniform": ""}, **options)

    def room(self):
        """Return the only room."""
        (room,) = self.rooms.values()
        return room


def dot(number, width=0.1):
    return protocol.CommandMessage(number, strokes=[protocol.StrokeMessage("attract", width, [(0.5, 0.5)])])


# --- rooms ----------------------------------------------------------------------------------------


async def test_an_opponent_faces_whoever_opens_a_room_and_two_policies_are_watched(hall):
    for seat, facing in (("red", 1), ("blue", 0), ("watch", 1)):
        guest = Guest(hall)
        assert guest.say(protocol.Create(seat=seat, opponent="ring", label="P1")) is None
        seats = hall.room().seats
        assert (seats[facing].policy, seats[1 - facing].policy) == ("ring", "")
        assert seats[1 - facing].label == ("" if seat == "watch" else "P1")
        assert guest.say(protocol.Leave()) is None and not hall.rooms
    guest.say(protocol.Create(seat="watch", player="ring", opponent="uniform"))
    assert [seat.policy for seat in hall.room().seats] == ["ring", "uniform"] and guest.say(dot(1)) == "out_of_turn"


async def test_what_a_client_says_reaches_its_room_and_its_connection(hall):
    screen = protocol.ClientInfo(viewport=(360, 640))
    red, blue = Guest(hall, client=screen), Guest(hall)
    assert red.kind == "person" and red.client == screen
    assert red.say(protocol.Ping(12.5)) is None and red.heard(protocol.Pong)[0].sent_ms == 12.5
    assert red.say(protocol.Acknowledge(7)) is None and red.acknowledged == [7]
    assert red.say(protocol.Visibility(hidden=True)) is None, "wherever one is"
    red.say(protocol.Create(lesson=True))
    room = hall.room()
    assert room.plan.lesson
    assert blue.say(protocol.Join(room.code.lower(), "blue", "P2")) is None and room.seats[1].label == "P2"
    red.say(protocol.Ready())
    red.say(protocol.Ready(ready=False))
    assert blue.say(protocol.Ready()) is None and room.phase == "waiting"
    red.say(protocol.Ready())
    await playing(room)
    assert red.say(protocol.Visibility(hidden=True)) is None
    recording = read(room)
    assert [line.event for line in recording.of(SeatMessage)] == ["connected", "connected", "hidden"]


async def test_what_is_out_of_turn_or_unknown_is_refused(hall):
    guest, dumb = Guest(hall), Guest(hall)
    for message, code in (
        (dot(1), "out_of_turn"),
        (protocol.Hello(), "out_of_turn"),
        (protocol.Ready(), "out_of_turn"),
        (protocol.Join("ZZZZ"), "unknown"),
        (protocol.Create(opponent="nobody"), "unknown"),
        (protocol.Create(seat="watch", player="nobody"), "unknown"),
        (protocol.Create(opponent="mine.py:ring"), "unknown"),  # a file would run code
        (protocol.Create(player="ring"), "not_valid"),
    ):
        assert guest.say(message) == code and not hall.rooms, message
    dumb.handler = ClientHandler(hall, dumb)
    assert dumb.say(protocol.Ping(0.0)) == "out_of_turn", "the first message is a hello"
    dumb.handler.hear(None)
    assert (await dumb.refused(2)).code == "malformed", "bytes are no message"


async def test_who_is_cut_off_comes_back_by_their_token_and_who_leaves_does_not(hall):
    guest, other = Guest(hall), Guest(hall)
    guest.say(protocol.Create())
    (seated,) = guest.heard(protocol.Seated)
    guest.handler.end()
    again = Guest(hall, seated.token)
    assert again.heard(protocol.Seated) == [seated] and hall.room().seats[0].connection is again
    other.say(protocol.Create())
    again.say(protocol.Create(seat="blue"))
    assert len(hall.rooms) == 2 and seated.room not in hall.rooms, "who opens another room leaves the one they were in"
    assert Guest(hall, seated.token).heard(protocol.Refused)[0].code == "unknown"


async def test_a_room_that_cannot_be_is_not_left_behind(hall, tmp_path):
    guest = Guest(hall)
    assert guest.say(protocol.Create(settings=protocol.Settings(red=0))) == "not_valid"
    assert guest.say(protocol.Create(settings=protocol.Settings(blue=0), opponent="ring")) == "not_valid"
    (tmp_path / "file").touch()
    object.__setattr__(hall.context, "folder", tmp_path / "file")
    assert guest.say(protocol.Create()) == "not_valid" and not hall.rooms
    assert str(tmp_path) not in guest.heard(protocol.Refused)[-1].reason


async def test_a_room_for_one_game_begins_it_as_its_seed_says_and_plays_no_other(hall):
    guest = Guest(hall)
    guest.say(protocol.Create(opponent="ring", once=True, seed=41))
    guest.say(protocol.Ready())
    room = hall.room()
    await playing(room)
    assert guest.heard(protocol.RoomState)[-1].once
    room.session.stop("red")
    assert guest.say(protocol.Ready()) == "out_of_turn"
    assert read(room).header.seed == 41
    guest.say(protocol.Create(opponent="ring"))
    assert not guest.heard(protocol.RoomState)[-1].once


# --- commands -------------------------------------------------------------------------------------


async def test_a_drawing_is_painted_elsewhere_one_at_a_time_and_the_latest_command_waits(hall, monkeypatch):
    threads, gate = [], threading.Event()

    def slowly(strokes, cells, mapping):
        threads.append(threading.current_thread())
        assert gate.wait(60)
        return density_of(strokes, cells, mapping)

    def received():
        return [message.number for message in guest.heard(protocol.Received)]

    def even(number):
        return protocol.CommandMessage(number, density=EYE)

    monkeypatch.setattr(rendered_command, "density_of", slowly)
    guest = Guest(hall)
    guest.say(ALONE)
    guest.say(protocol.Ready())
    guest.say(dot(1))
    await until(lambda: threads)
    for message in (dot(2), even(3), dot(4), even(5)):
        assert guest.say(message) is None
    assert not received()
    gate.set()
    await until(lambda: len(received()) == 2)
    assert received() == [1, 5], "none comes before an earlier"
    guest.say(even(6))
    assert received()[-1] == 6, "nothing is in its way"
    guest.say(dot(7))
    await until(lambda: len(received()) == 4)
    assert len(threads) == 2 and len({*threads}) == 1 and threading.current_thread() not in threads
    drawn, *_ = read(hall.room()).of(SeatCommand)
    assert drawn.density[0][0] == 0.0 < drawn.density[4][4] == 1.0, "what was drawn is what is flown"
    assert not guest.heard(protocol.Refused)


async def test_what_cannot_be_drawn_is_refused_and_a_room_that_was_left_hears_of_no_drawing(hall):
    guest = Guest(hall)
    guest.say(ALONE)
    guest.say(protocol.Ready())
    guest.say(dot(1, width=0.9))
    refused = await guest.refused()
    assert (refused.code, refused.about) == ("not_valid", "command") and "0.05 to 0.3" in refused.reason
    assert guest.say(protocol.CommandMessage(2)) == "not_valid"
    guest.say(dot(3))
    guest.say(protocol.Leave())
    guest.say(ALONE)
    guest.messages.clear()
    await until(lambda: guest.handler._rendering is None)
    assert not guest.messages


# --- limits ---------------------------------------------------------------------------------------


async def test_acknowledgements_count_only_if_they_are_none(hall):
    guest, news = Guest(hall), True
    guest.acknowledge = lambda sequence: news
    guest.patience = False
    assert guest.say(protocol.Ping(0.0)) == "too_many"
    assert guest.say(protocol.Acknowledge(1)) is None, "or frames would stop for good"
    news = False
    assert guest.say(protocol.Acknowledge(1)) == "too_many"
    guest.patience, guest.may_send = True, lambda size: False
    assert guest.say(protocol.Ping(0.0)) == "too_many"


async def test_who_says_nothing_is_closed_unless_they_are_somewhere(hall):
    closed, everybody, server = {}, {}, Server(hall)
    for name in ("player", "idler", "dumb"):
        guest = everybody[name] = Guest(hall)
        guest.close = lambda reason, name=name: closed.setdefault(name, reason)
    everybody["player"].say(protocol.Create())
    everybody["dumb"].handler = ClientHandler(hall, everybody["dumb"])
    server._handlers = {guest.handler for guest in everybody.values()}
    for now, expected in ((HELLO_S - 1, set()), (SILENT_S - 1, {"dumb"}), (SILENT_S + 1, {"dumb", "idler"})):
        server.sweep(now)
        assert set(closed) == expected
    assert "no hello" in closed["dumb"] and "outside of any room" in closed["idler"]


# --- the documentation ----------------------------------------------------------------------------

PAGE = (Path(__file__).parents[3] / "docs" / "protocol.md").read_text()
OF_THEIR_TIME = {"room", "token", "server_ms", "tick"}


async def test_what_clients_say_on_the_protocols_page_is_answered_as_it_says(hall):
    lines = re.search(r"## Commands of other kinds\n.*?```\n(.*?)```", PAGE, re.DOTALL).group(1).splitlines()
    guest = Guest(hall)

    def came(expected):
        """Return true if a message came as expected but for times and tokens."""
        messages = [json.loads(protocol.encode(message)) for message in guest.messages]
        same = {key: value for key, value in expected.items() if key not in OF_THEIR_TIME}
        return any(set(one) == set(expected) and same.items() <= one.items() for one in messages)

    for line in lines:
        message = json.loads(line[2:])
        if line.startswith(">"):
            guest.handler.hear(line[2:])
            if message["type"] == "ready":
                await playing(hall.room())
        else:
            protocol.decode_server(line[2:])
            await until(lambda expected=message: came(expected))
