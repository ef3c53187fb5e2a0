"""What is written down of a game while it runs."""

import asyncio

import numpy as np

from swarm_pz.play import protocol
from swarm_pz.play.recordings import recorder
from swarm_pz.play.recordings.format import CommandLine, Recording
from swarm_pz.play.recordings.playback import Playback
from tests.play.server.test_room import give, opened, playing, read, running, seated, until


def test_a_recording_that_breaks_off_is_told_of_once_and_the_game_goes_on(tmp_path):
    async def play():
        with opened(tmp_path, speed=2.0, time_limit=None) as room:
            (red,) = seated(room, "red")
            room.place_policy("blue", "one")
            room.ready(red, True)
            await playing(room)
            room.session.recorder.fault = "the recording breaks off: No space left on device"
            await until(lambda: room.session.game.tick > 45)
            return [message.text for message in red.heard(protocol.Notice)]

    assert asyncio.run(play()) == ["the recording breaks off: No space left on device"]


def test_what_was_played_is_in_the_file_after_half_a_second(tmp_path):
    async def play():
        with opened(tmp_path, speed=2.0, time_limit=None) as room:
            await running(room)
            await until(lambda: room.session.game.tick > 16)
            return Recording.read(room.session.recorder.path)

    assert asyncio.run(play()).last_tick >= 15


def test_what_players_say_more_than_a_flush_writes_does_not_heap_up(tmp_path, monkeypatch):
    monkeypatch.setattr(recorder, "_ONE_FLUSH", 5000)

    async def play():
        with opened(tmp_path, speed=2.0, time_limit=None) as room:
            await running(room)
            for number in range(100):
                room.session.commands.submit(room.reader.read(0, number, np.ones((10, 10))))
            begun = room.session.game.tick
            await until(lambda: room.session.recorder.is_behind)
            await until(lambda: not room.session.recorder.is_behind)
            return room.session.game.tick - begun

    assert asyncio.run(play()) < 60, "at two flushes a second it takes 10 s"


def test_a_command_tells_the_tick_at_which_it_arrived(tmp_path):
    async def play():
        with opened(tmp_path, speed=2.0, time_limit=None) as room:
            red, _ = await running(room)
            ticks = []
            for number in (1, 2, 3):
                await until(lambda number=number: room.session.game.tick > 7 * number)
                ticks.append(room.session.game.tick)
                give(room, red, protocol.CommandMessage(number, density=np.eye(10).tolist()))
            room.stop()
            return ticks, read(room)

    ticks, recording = asyncio.run(play())
    assert [line.tick for line in recording.of(CommandLine)] == ticks
    assert Playback(recording).verify().verified
