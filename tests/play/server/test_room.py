"""Rooms and their games, without a network: what policies that fail do to them, and what is written."""

import asyncio
import contextlib
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.play import protocol
from swarm_pz.play.commands import as_followed
from swarm_pz.play.frames import decode_frame
from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings.format import CommandLine, InForceLine, PaintedLine, Recording, SeatLine
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.server import live_session
from swarm_pz.play.server import room as module
from swarm_pz.play.server.orders import make
from swarm_pz.play.server.policy_workers import PolicyWorkers
from swarm_pz.play.server.refusal import RefusedError
from swarm_pz.play.server.replay_session import LoadedRecording, ReplaySession
from swarm_pz.play.server.room import AWAY_S, Room
from swarm_pz.play.server.room_settings import settings_of, table_config
from swarm_pz.play.server.seat import Seat
from swarm_pz.play.server.server_context import ServerContext
from swarm_pz.play.strokes import Stroke, density_of
from tests.play.faulty import FAULTS, loader
from tests.play.recordings.test_format import record


class Client:
    """Keeps what it is sent."""

    kind, client, address, last_heard = "person", None, "", 0.0

    def __init__(self):
        self.messages, self.bytes, self.frames = [], [], []

    def send(self, message):
        self.messages.append(message)

    def send_bytes(self, data):
        self.bytes.append(data)

    def show(self, frame, sequence):
        self.frames.append((frame, sequence))

    def heard(self, kind):
        """Return the messages of a kind."""
        return [message for message in self.messages if isinstance(message, kind)]


def context(tmp_path):
    return ServerContext(folder=tmp_path, workers=PolicyWorkers(loader), countdown_s=0.0)


class Here:
    """A recorded game that somebody watches, played again by a thread of this process."""

    thread = ThreadPoolExecutor(1)

    def __init__(self, loaded, thread=thread):
        self.loaded, self.state, self.thread, self.size = loaded, loaded.state, thread, 1

    async def ask(self, what, *given):
        return await asyncio.get_running_loop().run_in_executor(self.thread, getattr(self.loaded, what), *given)

    def drop(self):
        pass


"""In which recorded games are simulated."""
CALM = TableConfig(game=GameConfig(capture=CaptureConfig(enabled=False)))


class Workers:
    """Answers at once, or as it is told, in place of processes; keeps what it was asked."""

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
def opened(tmp_path, workers=None, table=None, moment=None, countdown_s=0.0, markers=None, **settings):
    """Give a room that no process thinks for, and in which nobody is captured; what runs in it ends with it."""
    shared = ServerContext(
        folder=tmp_path,
        workers=workers or Workers(),
        table=table or CALM,
        countdown_s=countdown_s,
        markers=markers,
    )
    room = Room("ABCD", protocol.Settings(**settings), shared, moment)
    try:
        yield room
    finally:
        room.close()


def seated(room, *sides):
    """Return a client in each seat."""
    clients = [Client() for _ in sides]
    for side, client in zip(sides, clients, strict=True):
        room.sit(client, side, f"label of {side}")
    return clients


def starting(room):
    """Let a game of two people count down, and return them."""
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


def give(room, client, message):
    """Let a client give a command."""
    team = room.commanding(client).team
    room.command(client, message, make(message, room.reader, room.config.mapping, team, message.number))


def code_of(act, *what):
    """Return the code by which something is refused."""
    with pytest.raises(RefusedError) as refused:
        act(*what)
    return refused.value.code


def read(room):
    """Return the recording of a room's game as far as it was played."""
    room.session.recorder.flush()
    return Recording.read(room.session.recorder.path)


async def until(holds, seconds=120.0):
    for _ in range(int(seconds / 0.02)):
        if holds():
            return
        await asyncio.sleep(0.02)
    raise AssertionError("it did not come to that")


@pytest.mark.parametrize("how", FAULTS)
def test_a_policy_that_fails_keeps_its_last_command_and_the_room_says_so(how, tmp_path):
    async def play():
        shared, client = context(tmp_path), Client()
        room = Room("ABCD", protocol.Settings(time_limit=None), shared)
        room.sit(client, "red", "")
        room.place_policy("blue", how)
        room.ready(client, True)
        notices = lambda: [m.text for m in client.messages if isinstance(m, protocol.Notice)]  # noqa: E731
        await until(notices)
        before = len(client.frames)
        await until(lambda: len(client.frames) > before + 10)
        assert room.phase == "playing"
        room.stop()
        shared.workers.close()
        return room.session.recorder.path, notices()[0]

    path, notice = asyncio.run(play())
    assert notice.startswith(f"{how} keeps its last command")
    recording = Recording.read(path)
    told = [line for line in recording.events if isinstance(line, InForceLine | SeatLine) and line.team == 1]
    assert [getattr(line, "event", line) for line in told].index("failed") == 1
    assert told[0].number == 1, "nor did what failed come into force, whatever is answered later"
    assert Playback(recording).verify().verified


def test_a_game_is_held_while_nobody_sees_it_and_goes_on_where_it_was(tmp_path, monkeypatch):
    """Rooms that their owners had left took the processor from all others for a minute."""
    monkeypatch.setattr(live_session, "_HELD_S", 0.01)

    async def play():
        shared, client = context(tmp_path), Client()
        room = Room("ABCD", protocol.Settings(time_limit=1.0), shared)
        room.sit(client, "red", "")
        room.place_policy("blue", "ring")
        room.ready(client, True)
        await playing(room)
        room.leave(client)
        assert room.seats[0].gone and not room.connections
        left_at = room.session.game.tick
        await asyncio.sleep(0.5)
        assert room.session.game.tick <= left_at + 2, "those that were due"
        room.watch(client)
        await until(lambda: room.phase == "over")
        assert room.seats[0].kind == "free", "a seat that was given up is free for the next game"
        shared.workers.close()
        return room.session.recorder.path

    recording = Recording.read(asyncio.run(play()))
    assert recording.end.outcome == "draw" and recording.last_tick == 30


def test_two_policies_at_a_table_have_streams_of_their_own(tmp_path, monkeypatch):
    async def play():
        shared, seeds, answers = context(tmp_path), {}, {}
        ask = shared.workers.ask

        async def noting(place, games, seed, **how):
            seeds[place.team] = seed
            answers[place.team] = await ask(place, games, seed, **how)
            return answers[place.team]

        monkeypatch.setattr(shared.workers, "ask", noting)
        room, client = Room("ABCD", protocol.Settings(time_limit=None), shared), Client()
        room.watch(client)
        for side in ("red", "blue"):
            room.place_policy(side, "noise")
        room.ready(client, True)
        await until(lambda: len(answers) == 2)
        room.stop()
        shared.workers.close()
        return room.session.recorder.path, seeds, answers

    path, seeds, answers = asyncio.run(play())
    assert not np.array_equal(answers[0], answers[1])
    recording = Recording.read(path)
    assert Playback(recording).verify().verified
    start = recording.header.seed
    firsts = {np.random.default_rng(seed).random() for seed in (start, seeds[0], seeds[1])}
    assert len(firsts) == 3, "nor is either the start's"


def test_frames_are_numbered_and_show_fields_at_every_solve(tmp_path):
    async def play():
        shared, client = context(tmp_path), Client()
        room = Room("ABCD", protocol.Settings(blue=0), shared)
        room.sit(client, "red", "")
        room.ready(client, True)
        await until(lambda: len(client.frames) > 12)
        room.stop()
        shared.workers.close()
        return client.frames

    frames = asyncio.run(play())
    assert np.diff([sequence for _, sequence in frames]).tolist() == [1] * (len(frames) - 1)
    with_fields = [frame[1] & 2 > 0 for frame, _ in frames]
    assert [sum(with_fields[i : i + 3]) for i in range(0, 12, 3)] == [1, 1, 1, 1]


def test_seats_are_not_given_away(tmp_path):
    async def play():
        shared, red, other = context(tmp_path), Client(), Client()
        room = Room("ABCD", protocol.Settings(), shared)
        room.sit(red, "red", "")
        with pytest.raises(RefusedError, match="taken"):
            room.sit(other, "red", "")
        with pytest.raises(RefusedError, match="somebody sits"):
            room.place_policy("red", "ring")
        room.place_policy("blue", "ring")
        with pytest.raises(RefusedError, match="taken"):
            room.sit(other, "blue", "")
        room.invite(red, "blue", None)
        room.sit(other, "blue", "")
        room.leave(red)
        room.sit(red, "red", "")
        shared.workers.close()

    asyncio.run(play())


def test_a_rematch_after_a_take_over_is_a_game_of_its_own(tmp_path):
    old = tmp_path / "old.jsonl"
    record(old, ticks=90)

    async def play():
        shared, client = context(tmp_path), Client()
        replay = ReplaySession(Here(LoadedRecording.read(old)), client)
        replay.seek(60)
        moment = await replay.moment()
        replay.close()
        room = Room("ABCD", settings_of(moment.game.config), shared, moment)
        room.sit(client, "red", "")
        room.place_policy("blue", "uniform")
        paths = []
        for _ in range(3):
            room.ready(client, True)
            await playing(room)
            paths.append(room.session.recorder.path)
            room.stop()
            assert room.phase == "over"
        shared.workers.close()
        return paths

    taken, *rematches = [Recording.read(path) for path in asyncio.run(play())]
    assert taken.header.seed == Recording.read(old).header.seed and taken.header.origin.tick == 60
    assert [recording.header.origin for recording in rematches] == [None, None]
    assert [next(iter(recording.frames())).tick for recording in rematches] == [0, 0]
    assert len({recording.header.seed for recording in (taken, *rematches)}) == 3
    assert all(Playback(recording).verify().verified for recording in rematches)


# --- seats ----------------------------------------------------------------------------------------


def test_a_seat_that_is_given_up_keeps_nothing_of_who_had_it(tmp_path):
    async def play():
        with opened(tmp_path) as room:
            (red,) = seated(room, "red")
            assert room.seats[0].label == "label of red" and len(room.seats[0].token) == 32
            room.ready(red, True)
            room.leave(red)
            free = Seat(0, room.config, "ABCD", room._context.workers)
            assert room.seats[0] == free and room.abandoned
            room.place_policy("red", "ring")
            about = {"system": "ergodic", "takes": "density"}
            state = protocol.SeatState("policy", "ring", connected=True, ready=True, policy_state="loading", **about)
            assert room.seats[0].state() == state
            room.place_policy("red", None)
            assert room.seats[0] == free

    asyncio.run(play())


def test_who_sits_down_no_longer_watches_and_has_one_seat(tmp_path):
    with opened(tmp_path) as room:
        client, other = Client(), Client()
        room.watch(client)
        room.watch(other)
        room.sit(client, "blue", "")
        assert code_of(room.sit, client, "red", "") == "out_of_turn"
        assert room.connections == [client, other]
        state = other.messages[-1]
        assert (state.watchers, state.blue.kind, state.red.kind) == (1, "person", "free")
        room.disconnect(other)
        assert client.messages[-1].watchers == 0


def test_a_seat_taken_back_is_said_to_have_changed_hands(tmp_path):
    async def play():
        with opened(tmp_path) as room:
            red, blue = await running(room)
            new, seat = Client(), room.seats[0]
            room.resume(red, seat)
            assert not red.heard(protocol.Displaced), "it is its own"
            room.resume(new, seat)
            assert len(red.heard(protocol.Displaced)) == 1 and seat.connection is new
            (told,) = new.heard(protocol.Seated)
            assert (told.room, told.seat, told.token, told.commands.takes) == ("ABCD", "red", seat.token, "density")
            assert decode_frame(new.bytes[0]).altitudes is not None and new.bytes[1] == seat.target
            assert [line.event for line in read(room).of(SeatLine) if line.team == 0] == [
                "connected",
                "connected",
                "displaced",
                "connected",
            ]
            assert not blue.heard(protocol.Displaced)

    asyncio.run(play())


def test_who_enters_a_running_game_is_shown_all_of_it(tmp_path):
    async def play():
        with opened(tmp_path, red=3, blue=5) as room:
            red, _ = await running(room)
            first = decode_frame(red.bytes[0])
            assert first.tick == 0 and first.altitudes is not None and first.fields is not None
            watcher = Client()
            room.watch(watcher)
            (data,) = watcher.bytes
            frame = decode_frame(data)
            assert frame.altitudes is not None and frame.fields is not None
            assert frame.teams.tolist() == [0] * 3 + [1] * 5
            return watcher.messages[-1]

    state = asyncio.run(play())
    assert (state.phase, state.watchers, state.outcome, state.recording) == ("playing", 1, None, None)
    assert (state.red.label, state.blue.label) == ("label of red", "label of blue")


def test_seats_change_between_games_and_not_in_them(tmp_path):
    async def play():
        with opened(tmp_path) as room:
            (red,) = seated(room, "red")
            room.place_policy("blue", "ring")
            assert code_of(room.invite, Client(), "blue", None) == "out_of_turn"
            assert code_of(room.invite, red, "red", "ring") == "taken"
            room.ready(red, True)
            await playing(room)
            assert code_of(room.ready, red, True) == "out_of_turn"
            assert code_of(room.invite, red, "blue", None) == "out_of_turn"
            room.stop()
            room.invite(red, "blue", "uniform")
            assert room.seats[1].policy == "uniform"
        with opened(tmp_path, blue=0) as room:
            assert code_of(room.place_policy, "blue", "ring") == "not_valid"

    asyncio.run(play())


def test_who_takes_back_that_they_are_ready_is_waited_for(tmp_path):
    async def play():
        with opened(tmp_path) as room:
            red, blue = seated(room, "red", "blue")
            room.ready(red, True)
            room.ready(red, False)
            room.ready(blue, True)
            assert room.phase == "waiting" and not room.seats[0].ready
            room.ready(red, True)
            await playing(room)
            assert [seat.ready for seat in room.seats] == [False, False], "for the next game, one says so again"
            room.stop()
            room.ready(red, True)
            assert room.phase == "over"

    asyncio.run(play())


def test_nobody_comes_back_to_a_seat_that_was_given_up_in_a_game(tmp_path):
    async def play():
        with opened(tmp_path) as room:
            red, blue = await running(room)
            room.disconnect(blue)
            assert room.seats[1].token and not room.abandoned, "that is a lost connection"
            room.leave(red)
            assert not room.seats[0].token and not room.abandoned
            room.resume(blue, room.seats[1])
            room.leave(blue)
            assert room.abandoned and room.phase == "playing"
            assert [seat.gone for seat in room.seats] == [True, True]
            events = [(line.team, line.event) for line in read(room).of(SeatLine)]
            assert events[2:] == [(1, "disconnected"), (0, "disconnected"), (1, "connected"), (1, "disconnected")]
            room.stop()
            assert [(seat.kind, seat.gone) for seat in room.seats] == [("free", False)] * 2

    asyncio.run(play())


@pytest.mark.parametrize("kind", ["person", "program"])
def test_seats_of_those_who_stay_away_are_freed_between_games(kind, tmp_path, monkeypatch):
    now = 1000.0
    monkeypatch.setattr(module.time, "monotonic", lambda: now)

    async def play():
        nonlocal now
        with opened(tmp_path) as room:
            (red,) = seated(room, "red")
            room.place_policy("blue", "ring")
            room.seats[0].kind = kind
            now += 10 * AWAY_S
            room.free_absent()
            assert room.seats[0].kind == kind, "who is here stays"
            room.disconnect(red)
            now += AWAY_S - 1
            room.free_absent()
            assert room.seats[0].kind == kind
            now += 2
            room.free_absent()
            assert [seat.kind for seat in room.seats] == ["free", "policy"]

    asyncio.run(play())


def test_a_game_waits_for_its_players(tmp_path):
    async def play():
        with opened(tmp_path) as room:
            red, _ = await running(room)
            room.disconnect(red)
            room.seats[0].away_since -= 10 * AWAY_S
            room.free_absent()
            assert room.seats[0].token
            room.stop()
            room.free_absent()
            assert room.seats[0].kind == "free"

    asyncio.run(play())


# --- what is played and written -------------------------------------------------------------------


def test_what_players_do_is_written_as_it_was_done(tmp_path):
    table = TableConfig(min_command_interval=0.25)
    screen = protocol.ClientInfo(viewport=(360, 640), pixel_ratio=2.0, refresh_hz=60.0)
    stroke = protocol.StrokeMessage("attract", 0.1, [(0.85, 0.15)])
    timing = protocol.Timing(input_ms=10.0, sent_ms=12.0)

    async def play():
        with opened(tmp_path, table=table, red=3, blue=2, mapping="paper", speed=2.0, time_limit=None) as room:
            red, blue = Client(), Client()
            red.client, blue.kind = screen, "program"
            room.sit(red, "red", "P1")
            room.sit(blue, "blue", "bot")
            room.ready(red, True)
            room.ready(blue, True)
            await playing(room)
            assert red.messages[-1].min_command_interval == 0.25
            give(room, red, protocol.CommandMessage(7, strokes=[stroke], timing=timing))
            give(room, blue, protocol.CommandMessage(3, density=np.eye(10).tolist()))
            assert [m.number for m in red.heard(protocol.Received)] == [7]
            assert [m.number for m in blue.heard(protocol.Received)] == [3]
            await until(lambda: red.heard(protocol.InForceMessage) and blue.heard(protocol.InForceMessage))
            assert [(m.seat, m.number) for m in red.heard(protocol.InForceMessage)] == [("red", 7)]
            assert [(m.seat, m.number) for m in blue.heard(protocol.InForceMessage)] == [("blue", 3)]
            room.painted(red, protocol.Painted(7, room.session.log.since_began(0.0) * -1 + 1234.0))
            room.visibility(blue, True)
            room.visibility(blue, False)
            targets = [seat.target for seat in room.seats]
            return read(room), targets, red.bytes, blue.bytes

    recording, targets, red, blue = asyncio.run(play())
    header = recording.header
    assert (header.red.kind, header.red.label, header.blue.kind, header.blue.label) == (
        "person",
        "P1",
        "program",
        "bot",
    )
    assert header.config_hash == recording.config.hash and header.rules_hash == recording.config.game.rules_hash
    assert recording.config == table_config(
        protocol.Settings(red=3, blue=2, mapping="paper", speed=2.0, time_limit=None), table
    )
    drawn, given = recording.of(CommandLine)
    assert (drawn.team, drawn.number, drawn.strokes, drawn.timing) == (0, 7, [stroke], timing)
    assert (given.team, given.number, given.strokes, given.timing) == (1, 3, None, None)
    strokes = [Stroke(brush="attract", width=0.1, points=((0.85, 0.15),))]
    np.testing.assert_array_equal(drawn.density, as_followed(density_of(strokes, 10, "paper")))
    np.testing.assert_array_equal(given.density, np.eye(10))
    assert 0.0 <= drawn.received_ms <= given.received_ms < 60_000.0
    for line in recording.of(InForceLine):
        assert drawn.received_ms <= line.ms < 60_000.0, "since the game began"
    assert recording.of(PaintedLine)[0] == PaintedLine(team=0, number=7, ms=pytest.approx(1234.0))
    seats = recording.of(SeatLine)
    assert [(line.team, line.event, line.client) for line in seats] == [
        (0, "connected", screen),
        (1, "connected", None),
        (1, "hidden", None),
        (1, "shown", None),
    ]
    assert next(iter(recording.frames())).tick == 0
    assert [(data[1], int.from_bytes(data[4:8], "little")) for data in targets] == [(0, 7), (1, 3)]
    assert red[1:] == [red[1], targets[0]] and blue[1:] == [blue[1], targets[1]], "the first is uniform"


def test_a_game_that_nobody_can_write_down_does_not_begin(tmp_path):
    (tmp_path / "games").write_text("no folder")

    async def play():
        with opened(tmp_path / "games") as room:
            red, _ = starting(room)
            await until(lambda: red.heard(protocol.Notice))
            assert "cannot be recorded: File exists" in red.heard(protocol.Notice)[0].text
            assert (red.messages[-1].phase, [seat.ready for seat in room.seats]) == ("waiting", [False, False])

    asyncio.run(play())


def test_a_room_that_goes_on_from_a_moment_has_its_table(tmp_path):
    record(tmp_path / "old.jsonl", ticks=90)
    recording = Recording.read(tmp_path / "old.jsonl")

    async def play():
        replay = ReplaySession(Here(LoadedRecording.read(tmp_path / "old.jsonl")), Client())
        replay.seek(45)
        moment = await replay.moment()
        replay.close()
        with opened(tmp_path, moment=moment) as room:
            assert room.config == recording.config
            client = Client()
            room.watch(client)
            (shown,) = [decode_frame(data) for data in client.bytes]
            assert shown.tick == 45 and shown.fields is not None, "the moment is in view before its game begins"
            await running(room)
            return read(room)

    taken = asyncio.run(play())
    past = recording.until(45)
    assert taken.events[: len(past)] == past and taken.header.origin.lines == len(past)
    assert [line.event for line in taken.events[len(past) :]][:2] == ["connected", "connected"]
    assert taken.config == recording.config and taken.header.seed == recording.header.seed
