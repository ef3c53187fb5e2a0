"""Rooms, without a network: seats, beginnings and ends of games, and their recordings."""

import asyncio
import contextlib
import time
from types import SimpleNamespace

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.play import protocol
from swarm_pz.play.commands import as_followed
from swarm_pz.play.frames import decode_frame
from swarm_pz.play.game import TableConfig
from swarm_pz.play.protocol import InForceMessage, SeatCommand, SeatMessage
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.server import audience, live_session
from swarm_pz.play.server import room as module
from swarm_pz.play.server.connection import RefusedError
from swarm_pz.play.server.rate_limit import RateLimit
from swarm_pz.play.server.rendered_command import render
from swarm_pz.play.server.room import AWAY_S, Room
from swarm_pz.play.server.room_settings import RoomPlan, table_config
from swarm_pz.play.server.server_context import ServerContext
from swarm_pz.play.strokes import Stroke, density_of

CALM = TableConfig(game=GameConfig(capture=CaptureConfig(enabled=False)))
EYE = np.eye(10).tolist()


class Client:
    """Keeps all messages."""

    kind, client, address, last_heard = "person", None, "", 0.0

    def __init__(self):
        self.messages, self.bytes, self.frames = [], [], []

    def send(self, message):
        (self.bytes if isinstance(message, bytes) else self.messages).append(message)

    def show(self, frame, sequence):
        self.frames.append((frame, sequence))

    def heard(self, kind):
        """Return the messages of a kind."""
        return [message for message in self.messages if isinstance(message, kind)]

    @property
    def notices(self):
        return [message.text for message in self.heard(protocol.Notice)]


class Workers:
    """Stands in for policy processes: answers at once or with `answer`, and keeps all questions."""

    def __init__(self, answer=None, loading=None):
        self.loaded, self.asked, self.seeds, self.paused, self.forgotten = [], [], {}, [], []
        self.answer, self.loading = answer, loading

    async def load(self, seat):
        if self.loading is not None:
            await self.loading(seat)
        self.loaded.append(seat.key)

    async def ask(self, seat, games, seed, *, begins=False):
        assert seat.key in self.loaded
        assert begins == (seed is not self.seeds.get(seat.key)), "once, with a new stream"
        self.seeds[seat.key] = seed
        self.asked.append((seat, int(games.ticks[0])))
        return np.ones((10, 10)) if self.answer is None else await self.answer(seat)

    def pause(self, seat):
        self.paused.append(seat.key)

    def forget(self, seat):
        self.forgotten.append(seat.key)


@contextlib.contextmanager
def opened(tmp_path, workers=None, table=None, countdown_s=0.0, **settings):
    """Give a room without policy processes and, by default, without captures; close it at the end."""
    workers, table = workers or Workers(), table or CALM
    shared = ServerContext(folder=tmp_path, workers=workers, table=table, countdown_s=countdown_s)
    options = {key: settings.pop(key) for key in ("seed", "lesson") if key in settings}
    room = Room("ABCD", RoomPlan(config=table_config(protocol.Settings(**settings), table), **options), shared)
    try:
        yield room
    finally:
        room.close()


def seated(room, *sides):
    """Seat a client on each side, and return them."""
    clients = [Client() for _ in sides]
    for side, client in zip(sides, clients, strict=True):
        room.sit(client, side, f"label of {side}")
    return clients


def starting(room):
    """Start the countdown of a game of two people, and return them."""
    red, blue = seated(room, "red", "blue")
    room.ready(red, True)
    room.ready(blue, True)
    assert room.phase == "starting"
    return red, blue


async def running(room):
    """Begin a game of two people, and return them."""
    players = starting(room)
    await playing(room)
    return players


async def playing(room):
    """Wait until a room's game runs."""
    await until(lambda: room.phase == "playing")


async def ticks(room, count):
    """Wait until a room's game has reached tick `count`."""
    await until(lambda: room.phase == "playing" and room.session.game.tick >= count)


def against(room, policy):
    """Return a client that is ready in red's seat, against a policy."""
    (red,) = seated(room, "red")
    room.place_policy("blue", policy)
    room.ready(red, True)
    return red


def watched(room):
    """Begin a game of two policies, and return its watcher."""
    client = Client()
    room.watch(client)
    room.place_policy("red", "one")
    room.place_policy("blue", "two")
    room.ready(client, True)
    return client


def give(room, client, message):
    """Let a client give a command."""
    team = room.commanding(client).team
    room.command(client, message, render(message, room.reader, room.plan.config.mapping, team))


def code_of(act, *what):
    """Return the code of a refusal."""
    with pytest.raises(RefusedError) as refused:
        act(*what)
    return refused.value.code


def read(room):
    """Return the recording of a room's game so far."""
    room.session.recorder.flush()
    return Recording.read(room.session.recorder.path)


async def until(holds, seconds=120.0):
    for _ in range(int(seconds / 0.02)):
        if holds():
            return
        await asyncio.sleep(0.02)
    raise AssertionError("it did not come to that")


# --- seats ----------------------------------------------------------------------------------------


async def test_a_seat_has_one_owner(tmp_path):
    with opened(tmp_path) as room:
        red, other, watcher = Client(), Client(), Client()
        room.watch(red)
        room.watch(watcher)
        room.sit(red, "red", "")
        assert code_of(room.sit, red, "blue", "") == code_of(room.watch, red) == "out_of_turn"
        assert room.connections == [red, watcher], "who sits down no longer watches"
        assert code_of(room.sit, other, "red", "") == "taken"
        room.sit(other, "blue", "")
        room.ready(red, True)
        room.ready(other, True)
        await playing(room)
        assert code_of(room.ready, red, True) == "out_of_turn"
        state = watcher.messages[-1]
        assert state.blue.kind == "person"
    with opened(tmp_path, blue=0) as room:
        assert code_of(room.place_policy, "blue", "ring") == "not_valid"


async def test_a_seat_taken_back_is_said_to_have_changed_hands_and_shown_all(tmp_path):
    with opened(tmp_path, red=3, blue=5) as room:
        red, blue = await running(room)
        new, watcher, seat = Client(), Client(), room.seats[0]
        room.resume(red, seat)
        assert not red.heard(protocol.Displaced), "it is its own"
        room.resume(new, seat)
        assert len(red.heard(protocol.Displaced)) == 1 and seat.connection is new and not blue.heard(protocol.Displaced)
        (reply,) = new.heard(protocol.Seated)
        assert (reply.room, reply.seat, reply.token, reply.commands.takes) == ("ABCD", "red", seat.token, "density")
        room.watch(watcher)
        for client in (new, watcher):
            frame = decode_frame(client.bytes[0])
            assert frame.altitudes is not None and frame.fields is not None
            assert frame.teams.tolist() == [0] * 3 + [1] * 5
        assert new.bytes[1:] == [seat.target] and len(watcher.bytes) == 1, "targets are for their own side"
        state = watcher.messages[-1]
        assert (state.phase, state.outcome, state.recording) == ("playing", None, None)
        assert (state.red.label, state.blue.label) == ("label of red", "label of blue")
        events = [line.event for line in read(room).of(SeatMessage) if line.team == 0]
        assert events == ["connected", "connected", "displaced", "connected"]


async def test_nobody_comes_back_to_a_seat_that_was_given_up_in_a_game(tmp_path):
    with opened(tmp_path) as room:
        red, blue = await running(room)
        room.disconnect(blue)
        assert room.seats[1].token and not room.abandoned, "that is a lost connection"
        room.leave(red)
        assert not room.seats[0].token and not room.abandoned
        room.resume(blue, room.seats[1])
        room.leave(blue)
        assert room.abandoned and room.phase == "playing" and all(seat.gone for seat in room.seats)
        events = [(line.team, line.event) for line in read(room).of(SeatMessage)]
        assert events[2:] == [(1, "disconnected"), (0, "disconnected"), (1, "connected"), (1, "disconnected")]
        room.stop()
        assert [(seat.kind, seat.gone) for seat in room.seats] == [("free", False)] * 2


async def test_seats_of_those_who_stay_away_are_freed_between_games(tmp_path, monkeypatch):
    now = time.monotonic()
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: now))
    with opened(tmp_path) as room:
        red = against(room, "ring")
        await playing(room)
        now += 10 * AWAY_S
        room.free_absent()
        room.disconnect(red)
        room.free_absent()
        assert room.seats[0].kind == "person", "a game waits for its players"
        room.stop()
        room.seats[0].away_since = now
        now += AWAY_S - 1
        room.free_absent()
        assert room.seats[0].kind == "person"
        now += 2
        room.free_absent()
        assert [seat.kind for seat in room.seats] == ["free", "policy"]


# --- how games begin ------------------------------------------------------------------------------


async def test_a_game_begins_when_both_are_ready_and_each_says_so_again_for_the_next(tmp_path):
    with opened(tmp_path) as room:
        red, blue = seated(room, "red", "blue")
        room.ready(red, True)
        room.ready(red, False)
        room.ready(blue, True)
        room.ready(blue, False)
        room.ready(red, True)
        room.disconnect(red)
        state = blue.messages[-1]
        assert not state.red.connected and not state.red.ready, "no game begins without its players"
        room.ready(blue, True)
        assert room.phase == "waiting"
        room.resume(red, room.seats[0])
        room.ready(red, True)
        await playing(room)
        assert [seat.ready for seat in room.seats] == [False, False]
        room.stop()
        room.ready(red, True)
        assert room.phase == "over"


async def test_policies_load_while_the_room_waits_and_act_from_the_first_tick_on(tmp_path):
    gates, answered = {"one": asyncio.Event(), "two": asyncio.Event()}, asyncio.Event()

    async def answer(seat):
        await answered.wait()
        return np.eye(10)

    workers = Workers(answer, loading=lambda seat: gates[seat.policy].wait())
    with opened(tmp_path, workers, time_limit=None) as room:
        client = watched(room)
        gates["one"].set()
        await until(lambda: client.messages[-1].red.policy_state == "loaded")
        state = client.messages[-1]
        assert (state.phase, state.blue.policy_state) == ("waiting", "loading")
        assert not workers.asked and not client.bytes
        gates["two"].set()
        await until(lambda: len(workers.asked) == 2)
        await asyncio.sleep(0.1)  # the countdown is long over
        assert room.phase == "starting" and room.session.game.tick == 0 and not client.frames
        answered.set()
        await ticks(room, 4)
        recording = read(room)
    assert {(line.team, line.tick) for line in recording.of(InForceMessage)} == {(0, 0), (1, 0)}
    assert all(line.server_ms <= recording.header.began_ms for line in recording.of(SeatCommand))


async def test_a_policy_that_cannot_be_loaded_is_told_of(tmp_path):
    async def loading(seat):
        raise module.SwarmError("no such file")

    with opened(tmp_path, Workers(loading=loading)) as room:
        red = against(room, "broken")
        assert (red.messages[-1].blue.policy_state, red.messages[-1].blue.reason) == ("loading", "")
        await until(lambda: red.messages[-1].blue.policy_state == "failed")
        assert red.messages[-1].blue.reason == "no such file" and room.phase == "waiting"
        assert code_of(room.ready, red, True) == "not_valid"


async def test_a_policy_stays_loaded_for_the_next_game_and_is_let_go_with_its_seat(tmp_path):
    workers = Workers()
    with opened(tmp_path, workers, time_limit=None) as room:
        red = against(room, "one")
        for _ in range(2):
            await playing(room)
            room.stop()
            room.ready(red, True)
        await playing(room)
        (one,) = workers.loaded
        assert workers.paused == [one] * 2 and not workers.forgotten
    assert workers.forgotten == workers.loaded


async def test_the_start_is_in_view_in_the_countdown_and_what_is_commanded_then_is_in_force_at_the_first_tick(tmp_path):
    with opened(tmp_path, countdown_s=0.2) as room:
        watcher, late = Client(), Client()
        room.watch(watcher)
        red, blue = starting(room)
        state, frame = red.messages[-1], decode_frame(red.bytes[0])
        assert state.phase == "starting" and state.red.ready and state.blue.ready and state.starts_ms > 0.0
        assert frame.tick == 0 and frame.altitudes is not None and watcher.bytes == red.bytes[:1]
        room.watch(late)
        np.testing.assert_array_equal(decode_frame(late.bytes[0]).positions, frame.positions)
        room.ready(red, True)
        assert room.phase == "starting" and not red.frames, "who says so twice has said it"
        for number in (1, 2):
            give(room, red, protocol.CommandMessage(number, density=EYE))
        assert [message.number for message in red.heard(protocol.Received)] == [1, 2]
        await playing(room)
        give(room, blue, protocol.CommandMessage(1, density=EYE))
        await ticks(room, 4)
        room.stop()
        recording = read(room)
    (in_force,) = red.heard(protocol.InForceMessage)
    assert (in_force.number, in_force.tick) == (2, 0)
    early, latest, later = recording.of(SeatCommand)
    assert early.server_ms <= latest.server_ms < recording.header.began_ms <= later.server_ms
    first = recording.of(InForceMessage)[0]
    assert (first.number, first.tick) == (2, 0) and first.server_ms >= recording.header.began_ms
    seats = recording.of(SeatMessage)
    assert len(seats) == 2 and all(line.server_ms < recording.header.began_ms for line in seats), "before they draw"
    assert Playback(recording).verify().verified


async def test_two_people_who_play_again_change_sides_and_their_wins_are_counted(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "PAUSE_S", 0.0)
    with opened(tmp_path, red=3, blue=5) as room:
        ann, bob = await running(room)
        assert code_of(room.pause, ann, True) == "out_of_turn", "the other one plays on"
        tokens = [seat.token for seat in room.seats]
        room.session.stop("red", "capture")
        assert (ann.messages[-1].phase, ann.messages[-1].wins) == ("over", (1, 0))
        for client in (ann, bob):
            room.ready(client, True, "Ann" if client is ann else None)
        assert [client.heard(protocol.Seated)[-1].seat for client in (ann, bob)] == ["blue", "red"]
        assert [seat.token for seat in room.seats] == tokens[::-1]
        state = bob.messages[-1]
        assert (state.phase, state.wins) == ("starting", (0, 1))
        assert (state.red.label, state.blue.label) == ("label of blue", "Ann")
        room.ready(ann, False)  # they change back, and their result is shown again
        state = bob.messages[-1]
        assert (state.phase, state.outcome, state.wins, state.red.label) == ("over", "red", (1, 0), "Ann")
        room.ready(ann, True)
        await playing(room)
        room.session.stop("red", "capture")
        assert bob.messages[-1].wins == (1, 1)
        room.leave(ann)
        (other,) = seated(room, "blue")
        assert other.messages[-1].wins == (0, 0)
        room.ready(other, True)
        room.ready(bob, True)
        assert (room.phase, room.seats[0].connection) == ("starting", bob), "they have not played each other yet"
        room.leave(bob)
        assert room.seats[1].connection is other and room.seats[0].kind == "free"


async def test_a_game_against_a_policy_alone_is_paused(tmp_path):
    with opened(tmp_path, red=2, blue=2) as room:
        red, watcher = against(room, "ring"), Client()
        room.watch(watcher)
        assert code_of(room.pause, watcher, True) == "out_of_turn"
        await ticks(room, 1)
        room.pause(red, True)
        await asyncio.sleep(0.1)  # for a tick that was due
        tick = room.session.game.tick
        await asyncio.sleep(0.3)
        assert room.session.game.tick == tick and watcher.messages[-1].paused
        room.pause(red, False)
        await ticks(room, tick + 1)
        room.pause(red, True)
        room.disconnect(red)  # ends the pause: nobody else could
        await ticks(room, tick + 10)


@pytest.mark.parametrize("how", ["leaves", "is cut off"])
async def test_who_does_not_play_after_all_calls_the_countdown_off(how, tmp_path, monkeypatch):
    monkeypatch.setattr(module, "PAUSE_S", 0.0)
    with opened(tmp_path, countdown_s=600.0) as room:
        red, blue = starting(room)
        give(room, red, protocol.CommandMessage(1, density=EYE))
        start, seat = decode_frame(red.bytes[0]).positions, room.seats[1]
        token = seat.token
        if how == "leaves":
            room.leave(blue)
            room.sit(blue, "blue", "")
        else:
            room.disconnect(blue)
            assert seat.token == token
            room.resume(blue, seat)
        state = red.messages[-1]
        assert (state.phase, state.outcome, state.starts_ms) == ("waiting", None, None)
        assert state.red.ready and not state.blue.ready and list(tmp_path.iterdir()) == [], "nothing was played"
        red.bytes.clear()
        room.ready(blue, True)
        assert room.phase == "starting"
        np.testing.assert_array_equal(decode_frame(red.bytes[0]).positions, start), "nobody chooses a start"
        assert not room.session.game._waiting[0], "what was commanded before is forgotten"


async def test_countdowns_that_are_called_off_begin_once_a_second(tmp_path, monkeypatch):
    """Countdowns cost time: five clients that began and cancelled them quickly once stopped all games."""
    now = [1000.0]
    monkeypatch.setattr(module, "time", SimpleNamespace(monotonic=lambda: now[0]))
    with opened(tmp_path, blue=0, countdown_s=600.0) as room:
        (red,), begun = seated(room, "red"), 0
        for _ in range(100):
            with contextlib.suppress(RefusedError):
                room.ready(red, True)
            begun += room.phase == "starting"
            room.ready(red, False)
            now[0] += 0.0625
        assert begun == 7, "in 6.25 s"
        assert code_of(room.ready, red, True) == "too_many" and not room.seats[0].ready


async def test_a_watcher_begins_two_policies_calls_them_off_and_sees_them_again_and_again(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "PAUSE_S", 0.0)
    with opened(tmp_path, countdown_s=600.0) as room:
        client, other = watched(room), Client()
        room.watch(other)
        room.ready(client, False)
        await until(lambda: all(seat.can_play for seat in room.seats))
        assert room.phase == "waiting"
        room.ready(client, True)
        assert room.phase == "starting"
        room.ready(other, False)
        assert room.phase == "waiting"
        object.__setattr__(room._context, "countdown_s", 0.0)
        for _ in range(2):
            room.ready(client, True)
            await playing(room)
            room.stop()


async def test_a_game_that_nobody_can_write_down_does_not_begin(tmp_path):
    (tmp_path / "games").write_text("no folder")
    with opened(tmp_path / "games") as room:
        red, _ = starting(room)
        await until(lambda: red.notices)
        assert "cannot be recorded: File exists" in red.notices[0]
        assert (red.messages[-1].phase, [seat.ready for seat in room.seats]) == ("waiting", [False, False])


# --- what is played and written -------------------------------------------------------------------


async def test_a_game_is_held_while_nobody_sees_it_and_goes_on_where_it_was(tmp_path, monkeypatch):
    """Rooms that their owners had left once took the processor from all others for a minute."""
    monkeypatch.setattr(live_session, "HELD_S", 0.01)
    with opened(tmp_path, time_limit=1.0, speed=2.0) as room:
        red = against(room, "ring")
        await playing(room)
        room.leave(red)
        left_at = room.session.game.tick
        await asyncio.sleep(0.3)
        assert room.session.game.tick <= left_at + 2, "those that were due"
        room.watch(red)
        await until(lambda: room.phase == "over")
        assert room.seats[0].kind == "free", "a seat that was given up is free for the next game"
        recording = read(room)
    assert recording.end.outcome == "draw" and recording.last_tick == 30


async def test_what_players_do_is_written_as_it_was_done(tmp_path):
    strokes = [Stroke(brush="attract", width=0.1, points=((0.85, 0.15),))]
    drawing = [protocol.StrokeMessage("attract", 0.1, [(0.85, 0.15)])]
    screen = protocol.ClientInfo(viewport=(360, 640), pixel_ratio=2.0)
    table, timing = TableConfig(min_command_interval=0.25), protocol.Timing(input_ms=10.0, sent_ms=12.0)
    settings = {"red": 3, "blue": 2, "speed": 2.0, "time_limit": None}
    with opened(tmp_path, table=table, **settings) as room:
        red, blue = Client(), Client()
        red.client, blue.kind = screen, "program"
        for client, side, label in ((red, "red", "P1"), (blue, "blue", "bot")):
            room.sit(client, side, label)
            room.ready(client, True)
        await playing(room)
        give(room, red, protocol.CommandMessage(7, strokes=drawing, timing=timing))
        give(room, blue, protocol.CommandMessage(3, density=EYE))
        for client, side, number in ((red, "red", 7), (blue, "blue", 3)):
            assert [m.number for m in client.heard(protocol.Received)] == [number]
            await until(lambda client=client: client.heard(protocol.InForceMessage))
            assert [(m.seat, m.number) for m in client.heard(protocol.InForceMessage)] == [(side, number)]
        room.visibility(blue, True)
        room.visibility(blue, False)
        targets, recording = [seat.target for seat in room.seats], read(room)
    header, (drawn, plain) = recording.header, recording.of(SeatCommand)
    assert [(seat.kind, seat.label) for seat in (header.red, header.blue)] == [("person", "P1"), ("program", "bot")]
    assert recording.config == table_config(protocol.Settings(**settings), table)
    assert (drawn.team, drawn.number, drawn.strokes, drawn.timing) == (0, 7, drawing, timing)
    assert (plain.team, plain.number, plain.strokes, plain.timing) == (1, 3, None, None)
    np.testing.assert_array_equal(drawn.density, as_followed(density_of(strokes, 10)))
    np.testing.assert_array_equal(plain.density, np.eye(10))
    assert header.began_ms <= drawn.server_ms <= plain.server_ms
    assert all(line.server_ms >= drawn.server_ms for line in recording.of(InForceMessage)), "since the game began"
    seats = [(line.team, line.event, line.client) for line in recording.of(SeatMessage)]
    assert seats == [(0, "connected", screen), (1, "connected", None), (1, "hidden", None), (1, "shown", None)]
    assert next(iter(recording.frames())).tick == 0
    assert [(data[1], int.from_bytes(data[4:8], "little")) for data in targets] == [(0, 7), (1, 3)]
    assert red.bytes[2:] == targets[:1] and blue.bytes[2:] == targets[1:], "the first is uniform"


# --- many who are told ----------------------------------------------------------------------------


async def test_a_rooms_state_is_told_to_so_many_at_once_and_then_to_all_together_once_in_a_while(tmp_path, monkeypatch):
    """Clients that reconnected again and again once made the server send everybody thousands of messages."""
    monkeypatch.setattr(audience, "SEND_S", 0.05)
    with opened(tmp_path) as room:
        room.audience._limit = RateLimit(4, 1e9)
        clients = [Client() for _ in range(4)]

        def counts():
            return [len(client.messages) for client in clients]

        for client in clients:
            room.watch(client)
        assert counts() == [4, 3, 2, 1], "four states"
        for more in (1, 2):
            for _ in range(20):
                room.audience.send_state()
            assert counts()[0] == 3 + more, "later, and once for all that was to be told"
            await until(lambda more=more: counts() == [4 + more, 3 + more, 2 + more, 1 + more])
        clients.append(Client())
        room.watch(clients[-1])
        assert counts() == [6, 5, 4, 3, 1], "a newcomer has it at once"
        (red,) = seated(room, "red")
        assert not clients[0].messages[-1].red.connected
        await until(lambda: clients[0].messages[-1].red.connected)
        assert red.messages[-1].red.connected
