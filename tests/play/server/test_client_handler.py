"""What one client does, message by message, without a network."""

import asyncio
import threading
from unittest.mock import Mock

import numpy as np
import pytest

from swarm_pz.play import protocol
from swarm_pz.play.recordings.format import PaintedLine, SeatLine
from swarm_pz.play.server import lobby, orders
from swarm_pz.play.server.client_handler import HELLO_S, SILENT_S, ClientHandler
from swarm_pz.play.server.lobby import Lobby
from swarm_pz.play.server.replay_session import LoadedRecording, ReplaySession
from swarm_pz.play.server.server_context import ServerContext
from tests.play.recordings.test_format import record
from tests.play.recordings.test_playback import CALM
from tests.play.server.test_room import Client, Here, Workers, playing, read, until


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
        """Say something; return the code by which it is refused, or None."""
        before = len(self.heard(protocol.Refused))
        self.handler.hear(protocol.encode(message))
        refused = self.heard(protocol.Refused)[before:]
        return refused[-1].code if refused else None

    async def watch(self, recording):
        """Open a recorded game and wait until it is shown."""
        before = len(self.heard(protocol.RoomState))
        self.say(protocol.OpenReplay(recording))
        await until(lambda: len(self.heard(protocol.RoomState)) > before or self.heard(protocol.Refused))
        assert not self.heard(protocol.Refused)
        self.say(protocol.Pace(0.0))


class Hall(Lobby):
    """A lobby in which nobody thinks."""

    def __init__(self, folder):
        workers = Workers()
        workers.close = lambda: None
        super().__init__(ServerContext(folder=folder, workers=workers, countdown_s=0.0), {"ring": "", "uniform": ""})

    def room(self):
        """Return the only room."""
        (room,) = self.rooms.values()
        return room


def visiting(folder, script):
    """Run a script in a lobby, and close it."""

    async def play():
        hall = Hall(folder)
        try:
            await script(hall)
        finally:
            hall.close()

    asyncio.run(play())


def test_an_opponent_faces_whoever_opens_a_room(tmp_path):
    async def script(hall):
        for seat, facing in (("red", 1), ("blue", 0), ("watch", 1)):
            guest = Guest(hall)
            assert guest.say(protocol.Create(seat=seat, opponent="ring", label="P1")) is None
            room = hall.room()
            assert room.seats[facing].policy == "ring" and room.seats[1 - facing].policy == ""
            assert room.seats[1 - facing].label == ("" if seat == "watch" else "P1")
            assert guest.say(protocol.Leave()) is None and not hall.rooms

    visiting(tmp_path, script)


def test_what_a_client_says_reaches_its_room_and_its_connection(tmp_path):
    screen = protocol.ClientInfo(viewport=(360, 640))

    async def script(hall):
        red, blue = Guest(hall, client=screen), Guest(hall)
        assert red.kind == "person" and red.client == screen
        assert red.say(protocol.Ping(12.5)) is None and red.heard(protocol.Pong)[0].sent_ms == 12.5
        assert red.say(protocol.Acknowledge(7)) is None and red.acknowledged == [7]
        assert red.say(protocol.Visibility(hidden=True)) is None, "wherever one is"
        red.say(protocol.Create(lesson=True))
        room = hall.room()
        assert room.games.lesson
        assert blue.say(protocol.Join(room.code, "blue", "P2")) is None and room.seats[1].label == "P2"
        assert red.say(protocol.Invite("blue", "nobody")) == "unknown"
        red.say(protocol.Ready())
        red.say(protocol.Ready(ready=False))
        assert blue.say(protocol.Ready()) is None and room.phase == "waiting"
        red.say(protocol.Ready())
        await playing(room)
        assert red.say(protocol.Painted(3, 1.0)) is None and red.say(protocol.Visibility(hidden=True)) is None
        red.patience = False
        assert red.say(protocol.Visibility(hidden=False)) == "too_many"
        recording = read(room)
        assert [line.number for line in recording.of(PaintedLine)] == [3]
        assert [line.event for line in recording.of(SeatLine)] == ["connected", "connected", "hidden"]

    visiting(tmp_path, script)


def test_who_is_cut_off_comes_back_by_their_token_and_who_leaves_does_not(tmp_path):
    async def script(hall):
        guest = Guest(hall)
        guest.say(protocol.Create())
        (seated,) = guest.heard(protocol.Seated)
        guest.handler.end()
        again = Guest(hall, seated.token)
        assert again.heard(protocol.Seated) == [seated] and hall.room().seats[0].connection is again
        other = Guest(hall)
        other.say(protocol.Create())
        assert len(hall.rooms) == 2
        again.say(protocol.Create(seat="blue"))
        assert seated.room not in hall.rooms, "who opens another room leaves the one they were in"
        assert Guest(hall, seated.token).heard(protocol.Refused)[0].code == "unknown"

    visiting(tmp_path, script)


def test_a_room_that_nobody_entered_is_closed(tmp_path):
    async def script(hall):
        guest = Guest(hall)
        assert guest.say(protocol.Create(settings=protocol.Settings(red=0))) == "not_valid"
        assert guest.say(protocol.Create(settings=protocol.Settings(blue=0), opponent="ring")) == "not_valid"
        assert not hall.rooms

    visiting(tmp_path, script)


def test_a_take_over_is_against_whoever_sat_there(tmp_path):
    record(tmp_path / "a.jsonl", ticks=90, config=CALM)  # P1 against ring

    async def script(hall):
        for message, policies in (
            (protocol.TakeOver("red"), ["", "ring"]),
            (protocol.TakeOver("blue"), ["", ""]),
            (protocol.TakeOver("blue", "uniform"), ["uniform", ""]),
        ):
            guest = Guest(hall)
            await guest.watch("a.jsonl")
            guest.say(protocol.Seek(45))
            assert guest.say(message) is None
            await until(lambda: hall.rooms)
            room = hall.room()
            assert room.games.moment.origin.tick == 45
            assert [seat.policy for seat in room.seats] == policies and room.config == CALM
            assert room.seats[("red", "blue").index(message.seat)].connection is guest
            assert guest.say(protocol.Seek(3)) == "out_of_turn", "what was watched is over"
            guest.say(protocol.Leave())

    visiting(tmp_path, script)


def test_what_cannot_be_gone_on_with_is_refused(tmp_path):
    record(tmp_path / "gone.jsonl", ticks=30, config=CALM, player="somebody gone")
    short = CALM.replace(game=CALM.game.replace(time_limit=1.0))
    record(tmp_path / "over.jsonl", ticks=30, config=short)

    async def script(hall):
        guest = Guest(hall)
        assert guest.say(protocol.TakeOver("red")) == "out_of_turn"
        await guest_watches(guest, "gone.jsonl")
        assert guest.say(protocol.TakeOver("red")) == "unknown"
        await guest_watches(guest, "over.jsonl")
        guest.say(protocol.Seek(30))
        assert guest.say(protocol.TakeOver("red")) is None
        await until(lambda: guest.heard(protocol.Refused))
        assert "over at this moment" in guest.heard(protocol.Refused)[-1].reason
        guest.handler._replay.state.verified = False
        assert guest.say(protocol.TakeOver("red")) == "not_valid"
        assert "differently on this machine" in guest.heard(protocol.Refused)[-1].reason
        assert not hall.rooms

    async def guest_watches(guest, name):
        guest.messages.clear()
        await guest.watch(name)

    visiting(tmp_path, script)


def test_of_games_that_are_opened_only_the_last_is_shown(tmp_path, monkeypatch):
    for name in ("a", "b"):
        record(tmp_path / f"{name}.jsonl", ticks=30, config=CALM)

    async def script(hall):
        loaded, begun = {}, []
        gate = asyncio.Event()

        async def slowly(name):
            begun.append(name)
            await gate.wait()
            loaded[name] = Here(LoadedRecording.read(tmp_path / name))
            return loaded[name]

        monkeypatch.setattr(hall, "read", slowly)
        guest, gone = Guest(hall), Guest(hall)
        for name in ("a.jsonl", "b.jsonl"):
            guest.say(protocol.OpenReplay(name))
            await until(lambda name=name: begun[-1:] == [name])
        gone.say(protocol.OpenReplay("a.jsonl"))
        await until(lambda: len(begun) == 3)
        gone.handler.end()
        gate.set()
        await until(lambda: guest.heard(protocol.RoomState))
        assert [state.recording for state in guest.heard(protocol.RoomState)] == ["b.jsonl"]
        await asyncio.sleep(0.1)
        assert list(loaded) == ["b.jsonl"] and not gone.heard(protocol.RoomState)

    visiting(tmp_path, script)


@pytest.mark.parametrize("goes", [protocol.Create(opponent="ring"), protocol.Leave(), None])
@pytest.mark.parametrize("what", ["open", "take over"])
def test_who_has_gone_elsewhere_meanwhile_stays_there(goes, what, tmp_path, monkeypatch):
    record(tmp_path / "a.jsonl", ticks=30, config=CALM)

    async def script(hall):
        gate, asked = asyncio.Event(), []
        read, moment = hall.read, ReplaySession.moment

        async def slowly(there, *how):
            asked.append(how)
            await gate.wait()
            return await there(*how)

        guest, other = Guest(hall), Guest(hall)
        other.say(protocol.Create())
        if what == "open":
            monkeypatch.setattr(hall, "read", lambda name: slowly(read, name))
            guest.say(protocol.OpenReplay("a.jsonl"))
        else:
            await guest.watch("a.jsonl")
            monkeypatch.setattr(ReplaySession, "moment", lambda replay: slowly(moment, replay))
            guest.say(protocol.TakeOver("red"))
        await until(lambda: asked)
        joins = protocol.Join(hall.room().code, "blue")
        assert guest.say(goes or joins) is None
        rooms = list(hall.rooms.values())
        guest.messages.clear()
        gate.set()
        await asyncio.sleep(0.2)
        assert list(hall.rooms.values()) == rooms and not hall.watched
        assert {state.phase for state in guest.heard(protocol.RoomState)} <= {"waiting"}, "a policy has loaded"
        assert not guest.heard(protocol.Seated) and not guest.heard(protocol.Refused)

    visiting(tmp_path, script)


def test_who_could_not_go_elsewhere_is_still_taken_where_they_wanted(tmp_path):
    record(tmp_path / "a.jsonl", ticks=30, config=CALM)

    async def script(hall):
        guest = Guest(hall)
        guest.say(protocol.OpenReplay("a.jsonl"))
        assert guest.say(protocol.Join("ZZZZ")) == "unknown"
        await until(lambda: guest.heard(protocol.RoomState))
        assert guest.heard(protocol.RoomState)[0].phase == "replay" and len(hall.watched) == 1
        guest.handler.end()
        assert not hall.watched

    visiting(tmp_path, script)


def dot(number):
    return protocol.CommandMessage(number, strokes=[protocol.StrokeMessage("attract", 0.1, [(0.5, 0.5)])])


def even(number):
    return protocol.CommandMessage(number, density=[[1.0] * 10] * 10)


def test_a_drawing_is_painted_elsewhere_one_at_a_time_and_the_latest_command_waits(tmp_path, monkeypatch):
    async def script(hall):
        painted, gate, threads = [], threading.Event(), set()

        def slowly(strokes, cells, mapping):
            threads.add(threading.current_thread())
            painted.append(len(strokes))
            assert gate.wait(60)
            return np.ones((10, 10))

        monkeypatch.setattr(orders, "density_of", slowly)
        guest = Guest(hall)
        guest.say(protocol.Create(settings=protocol.Settings(blue=0)))
        guest.say(protocol.Ready())
        guest.say(dot(1))
        await until(lambda: painted)
        for message in (dot(2), even(3), dot(4), even(5)):
            assert guest.say(message) is None
        assert not guest.heard(protocol.Received)
        gate.set()
        await until(lambda: len(guest.heard(protocol.Received)) == 2)
        assert [message.number for message in guest.heard(protocol.Received)] == [1, 5], "none comes before an earlier"
        guest.say(even(6))
        assert guest.heard(protocol.Received)[-1].number == 6, "nothing is in its way"
        guest.say(dot(7))
        await until(lambda: len(guest.heard(protocol.Received)) == 4)
        assert painted == [1, 1] and threading.current_thread() not in threads and len(threads) == 1
        assert not guest.heard(protocol.Refused)

    visiting(tmp_path, script)


def test_what_cannot_be_drawn_is_refused_and_a_room_that_was_left_hears_of_no_drawing(tmp_path):
    async def script(hall):
        guest = Guest(hall)
        guest.say(protocol.Create(settings=protocol.Settings(blue=0)))
        guest.say(protocol.Ready())
        guest.say(protocol.CommandMessage(1, strokes=[protocol.StrokeMessage("attract", 0.9, [(0.5, 0.5)])]))
        await until(lambda: guest.heard(protocol.Refused))
        refused = guest.heard(protocol.Refused)[0]
        assert (refused.code, refused.about) == ("not_valid", "command") and "0.05 to 0.3" in refused.reason
        assert guest.say(protocol.CommandMessage(2)) == "not_valid"
        guest.say(dot(3))
        guest.say(protocol.Leave())
        guest.say(protocol.Create(settings=protocol.Settings(blue=0)))
        guest.messages.clear()
        await asyncio.sleep(0.2)
        assert not guest.messages

    visiting(tmp_path, script)


def test_acknowledgements_count_only_if_they_are_none(tmp_path):
    async def script(hall):
        guest, news = Guest(hall), True
        guest.acknowledge = lambda sequence: news
        guest.patience = False
        assert guest.say(protocol.Ping(0.0)) == "too_many"
        assert guest.say(protocol.Acknowledge(1)) is None, "or frames would stop for good"
        news = False
        assert guest.say(protocol.Acknowledge(1)) == "too_many"
        guest.patience, guest.may_send = True, lambda size: False
        assert guest.say(protocol.Ping(0.0)) == "too_many"

    visiting(tmp_path, script)


def test_who_says_nothing_is_closed_unless_they_are_somewhere(tmp_path):
    record(tmp_path / "a.jsonl", ticks=30, config=CALM)

    async def script(hall):
        closed = []

        def guest(name):
            made = Guest(hall)
            made.close = lambda reason: closed.append((name, reason))
            return made

        player, watcher, idler = guest("player"), guest("watcher"), guest("idler")
        player.say(protocol.Create())
        await watcher.watch("a.jsonl")
        dumb = guest("dumb")
        dumb.handler = ClientHandler(hall, dumb)
        everybody = (player, watcher, idler, dumb)
        for now in (HELLO_S - 1, HELLO_S + 1, SILENT_S - 1, SILENT_S + 1):
            for one in everybody:
                one.handler.close_if_silent(now)
        assert closed[0] == ("dumb", "no hello came within 10 seconds")
        assert {name for name, _ in closed} == {"dumb", "idler"}
        assert ("idler", "nothing was said for 300 seconds, outside of any room") in closed

    visiting(tmp_path, script)


@pytest.mark.parametrize("leaves", [protocol.Leave(), protocol.Create(), protocol.OpenReplay("b.jsonl"), None])
def test_who_goes_on_is_shown_no_more_of_what_they_watched(leaves, tmp_path):
    for name in ("a", "b"):
        record(tmp_path / f"{name}.jsonl", ticks=300, config=CALM)

    async def script(hall):
        guest, tasks = Guest(hall), len(asyncio.all_tasks())
        await guest.watch("a.jsonl")
        assert len(asyncio.all_tasks()) == tasks + 1
        if leaves is None:
            guest.handler.end()
        elif isinstance(leaves, protocol.OpenReplay):
            await guest.watch("b.jsonl")
            guest.handler.end()
        else:
            assert guest.say(leaves) is None
        await until(lambda: len(asyncio.all_tasks()) == tasks, 5.0)

    visiting(tmp_path, script)


def test_who_watches_a_recorded_game_has_left_their_room_and_who_could_not_has_not(tmp_path):
    record(tmp_path / "a.jsonl", ticks=30, config=CALM)
    (tmp_path / "bad.jsonl").write_text("{}\n")

    async def script(hall):
        guest = Guest(hall)
        guest.say(protocol.Create())
        guest.say(protocol.OpenReplay("bad.jsonl"))
        await until(lambda: guest.heard(protocol.Refused))
        (refused,) = guest.heard(protocol.Refused)
        assert (refused.code, refused.about) == ("unknown", "open_replay")
        assert "bad.jsonl" in refused.reason and str(tmp_path) not in refused.reason
        assert hall.room().seats[0].connection is guest
        guest.messages.clear()
        await guest.watch("a.jsonl")
        assert not hall.rooms

    visiting(tmp_path, script)


def test_who_watches_a_small_game_may_not_open_a_large_one_where_too_many_are_watched(tmp_path):
    record(tmp_path / "a.jsonl", ticks=30, config=CALM)

    async def script(hall):
        guest = Guest(hall)
        await guest.watch("a.jsonl")
        own = guest.handler._replay
        hall.watched.add(Mock(size=lobby.MOST_REPLAY_BYTES - 1))
        assert guest.say(protocol.OpenReplay("a.jsonl")) is None, "its own gives way"
        await until(lambda: guest.handler._replay is not own)
        hall.watched.add(Mock(size=1))
        assert guest.say(protocol.OpenReplay("a.jsonl")) == "full"

    visiting(tmp_path, script)


def test_a_folder_that_takes_no_recordings_is_found_when_a_room_is_opened(tmp_path):
    folder = tmp_path / "games"
    folder.write_text("no folder")

    async def play():
        hall = Hall(folder)
        guest = Guest(hall)
        assert guest.say(protocol.Create()) == "not_valid" and not hall.rooms
        assert str(folder) not in guest.heard(protocol.Refused)[0].reason
        folder.unlink()
        assert guest.say(protocol.Create()) is None
        assert folder.is_dir() and not list(folder.iterdir())
        hall.close()

    asyncio.run(play())


def test_a_code_is_understood_in_small_letters(tmp_path):
    async def play():
        hall = Hall(tmp_path)
        host, guest = Guest(hall), Guest(hall)
        host.say(protocol.Create())
        assert guest.say(protocol.Join(hall.room().code.lower(), "blue")) is None
        assert guest.heard(protocol.Seated)[0].room == hall.room().code
        hall.close()

    asyncio.run(play())


def test_a_room_for_one_game_begins_it_as_its_seed_says_and_plays_no_other(tmp_path):
    async def script(hall):
        guest, other = Guest(hall), Guest(hall)
        guest.say(protocol.Create(opponent="ring", once=True, seed=41))
        assert guest.say(protocol.Invite("blue", "uniform")) == "out_of_turn"
        room = await playing_in(hall, guest)
        assert guest.heard(protocol.RoomState)[-1].once
        room.session.stop("red")
        assert guest.say(protocol.Ready()) == "out_of_turn"
        await until(lambda: room.session.recorder.written)
        assert read(room).header.seed == 41
        other.say(protocol.Create(opponent="ring"))
        assert not other.heard(protocol.RoomState)[-1].once

    visiting(tmp_path, script)


async def playing_in(hall, guest):
    """Say that one is ready in the only room, and return it when the game runs."""
    guest.say(protocol.Ready())
    room = hall.room()
    await until(lambda: room.phase == "playing")
    return room
