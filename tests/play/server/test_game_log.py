"""What is written down of a game while it runs."""

import numpy as np
import pytest

from swarm_pz.play import protocol
from swarm_pz.play.recordings import recorder
from swarm_pz.play.recordings.format import CommandLine, Recording
from swarm_pz.play.recordings.playback import Playback
from tests.play.server.test_room import EYE, give, opened, read, running, ticks, until

pytestmark = pytest.mark.anyio


async def test_a_command_tells_its_tick_and_what_was_played_is_in_the_file_after_half_a_second(tmp_path):
    with opened(tmp_path, speed=2.0, time_limit=None) as room:
        red, _ = await running(room)
        played = []
        for number in (1, 2, 3):
            await ticks(room, 7 * number)
            played.append(room.session.game.tick)
            give(room, red, protocol.CommandMessage(number, density=EYE))
        assert Recording.read(room.session.recorder.path).last_tick >= 15
        room.stop()
        recording = read(room)
    assert [line.tick for line in recording.of(CommandLine)] == played
    assert Playback(recording).verify().verified


async def test_a_recording_that_breaks_off_is_told_of_once_and_the_game_goes_on(tmp_path):
    with opened(tmp_path, speed=2.0, time_limit=None) as room:
        red, _ = await running(room)
        room.session.recorder.fault = "the recording breaks off: No space left on device"
        await ticks(room, room.session.game.tick + 31)
        assert red.notices == ["the recording breaks off: No space left on device"]


async def test_what_players_say_more_than_a_flush_writes_does_not_heap_up(tmp_path, monkeypatch):
    monkeypatch.setattr(recorder, "_ONE_FLUSH", 5000)
    with opened(tmp_path, speed=2.0, time_limit=None) as room:
        await running(room)
        for number in range(100):
            room.session.commands.submit(room.reader.read(0, number, np.ones((10, 10))))
        begun = room.session.game.tick
        await until(lambda: room.session.recorder.is_behind)
        await until(lambda: not room.session.recorder.is_behind)
        assert room.session.game.tick - begun < 60, "at two flushes a second it takes 10 s"
