"""Recorded games that are watched, and played on from the moment that is shown."""

import asyncio

import pytest

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.play.recordings.format import Recording
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.server.replay_session import LoadedRecording, ReplaySession
from tests.play.recordings.test_format import record
from tests.play.server.test_room import Client


@pytest.mark.parametrize("tick", [0, 59, 60, 75])
def test_what_is_taken_over_has_the_sizes_of_the_whole_seconds_that_were_played(tick, tmp_path):
    path = tmp_path / "game.jsonl"
    record(path, ticks=120)

    async def watch():
        replay = ReplaySession(LoadedRecording.read(path), Client())
        replay.seek(tick)
        moment = replay.moment()
        replay.close()
        return moment

    moment = asyncio.run(watch())
    playback, sizes = Playback(Recording.read(path)), []
    for second in range(0, tick + 1, TICKS_PER_SECOND):
        playback.seek(second)
        sizes.append(playback.game.sizes)
    assert moment.sizes == sizes
    assert moment.game.tick == moment.origin.tick == tick
