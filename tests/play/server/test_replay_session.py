"""Recorded games that are watched, and played on from the moment that is shown."""

import asyncio
from concurrent.futures import Executor, Future
from dataclasses import replace

import numpy as np
import pytest

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.errors import RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.frames import decode_frame
from swarm_pz.play.recordings.format import Recording
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.server import replay_session as module
from swarm_pz.play.server.replay_session import LoadedRecording, ReplaySession, sizes_of
from swarm_pz.play.server.room_settings import settings_of
from tests.play.recordings.test_format import plain_lines, record, write_chained
from tests.play.recordings.test_playback import CALM
from tests.play.server.test_room import Client, Here, until


@pytest.mark.parametrize("tick", [0, 59, 60, 75])
def test_what_is_taken_over_has_the_sizes_of_the_whole_seconds_that_were_played(tick, tmp_path):
    path = tmp_path / "game.jsonl"
    record(path, ticks=120)

    async def watch():
        replay = ReplaySession(Here(LoadedRecording.read(path)), Client())
        replay.seek(tick)
        moment = await replay.moment()
        replay.close()
        return moment

    moment = asyncio.run(watch())
    playback, sizes = Playback(Recording.read(path)), []
    for second in range(0, tick + 1, TICKS_PER_SECOND):
        playback.seek(second)
        sizes.append(playback.game.sizes)
    assert moment.sizes == sizes
    assert moment.game.tick == moment.origin.tick == tick


def test_what_broke_off_is_taken_over_from_its_last_frame(tmp_path):
    record(tmp_path / "a.jsonl", ticks=90, config=CALM)
    lines = plain_lines(tmp_path / "a.jsonl")
    last = next(i for i, line in enumerate(lines) if line["type"] == "in_force" and line["tick"] == 60)
    kept = [line for line in lines[: last + 1] if (line["type"], line.get("tick")) != ("frame", 60)]
    write_chained(tmp_path / "a.jsonl", kept)

    async def watch():
        loaded = LoadedRecording.read(tmp_path / "a.jsonl")
        assert loaded.is_verified and loaded.recording.last_tick == 60 and loaded.frames[-1].tick == 57
        replay = ReplaySession(Here(loaded), Client())
        replay.seek(60)
        moment = await replay.moment()
        replay.close()
        return moment

    moment = asyncio.run(watch())
    assert moment.game.tick == moment.origin.tick == 57


def watch(path, script, is_verified=True):
    """Run a script beside a recorded game that is held, and return who watches it."""

    async def play():
        client = Client()
        loaded = LoadedRecording.read(path)
        assert loaded.is_verified
        replay = ReplaySession(Here(replace(loaded, is_verified=is_verified)), client)
        replay.pace(0.0)
        await until(lambda: client.frames)  # the start is shown first
        await script(replay, client)
        replay.close()
        return client

    return asyncio.run(play())


def shown(client):
    frame, sequence = client.frames[-1]
    read = decode_frame(frame)
    assert read.sequence == sequence == len(client.frames)
    return read


def told(client):
    """Return the teams and numbers of the targets that were sent, and forget them."""
    targets = [(data[1], int.from_bytes(data[4:8], "little")) for data in client.bytes]
    client.bytes.clear()
    return targets


def test_a_recorded_game_is_told_of_as_it_was(tmp_path):
    config = CALM.replace(min_command_interval=0.25, mapping="paper", game=CALM.game.replace(drones_per_team=(3, 5)))
    record(tmp_path / "a.jsonl", ticks=100, config=config)

    async def script(replay, client):
        pass

    (state,) = watch(tmp_path / "a.jsonl", script).messages
    assert state == protocol.RoomState(
        code="",
        phase="replay",
        settings=settings_of(config),
        red=protocol.SeatState("person", "", "P1", connected=True, system="ergodic", takes="density"),
        blue=protocol.SeatState("policy", "ring", "", connected=True, system="ergodic", takes="density"),
        watchers=1,
        sizes=[(3, 5)] * 4,
        min_command_interval=0.25,
        outcome="stopped",
        recording="a.jsonl",
        last_tick=100,
        verified=True,
        ended_by="server",
    )


def test_sizes_of_a_second_are_those_at_its_beginning(tmp_path):
    record(tmp_path / "a.jsonl", ticks=60, config=CALM)
    loaded = LoadedRecording.read(tmp_path / "a.jsonl")
    assert loaded.sizes == [(4, 4)] * 3
    for frame in loaded.frames:
        frame.teams[:] = np.arange(8) < frame.tick // 10
    assert sizes_of(loaded.frames) == [(8, 0), (5, 3), (2, 6)]


async def see(replay, client, tick):
    """Seek a moment, and return the frame that shows it."""
    before = len(client.frames)
    replay.seek(tick)
    await until(lambda: len(client.frames) > before)
    return shown(client)


def test_a_moment_is_shown_with_fields_and_targets_and_none_lies_beyond_the_end(tmp_path):
    record(tmp_path / "a.jsonl", ticks=100, config=CALM)

    async def script(replay, client):
        told(client)
        for asked, tick in ((70, 70), (1_000_000, 100), (4, 4)):
            frame = await see(replay, client, asked)
            assert frame.tick == tick and frame.fields is not None
            np.testing.assert_allclose(
                frame.altitudes, replay._replayed.loaded.playback.game.simulator.altitudes[0], atol=1 / 255
            )
            assert told(client) == [(0, 0), (1, 0)]
            moment = await replay.moment()
            assert moment.game.tick == tick
            np.testing.assert_allclose(frame.positions, moment.game.simulator.positions[0], atol=1e-5)
            moment.game.advance(9)
            assert (await see(replay, client, tick)).tick == tick, "what is taken over is no longer this game"
            told(client)

    watch(tmp_path / "a.jsonl", script)


class AtOnce(Executor):
    """Does what it is given before it says so, and counts it."""

    count = 0

    def submit(self, work, *what):
        self.count += 1
        done = Future()
        done.set_result(work(*what))
        return done


@pytest.mark.parametrize("speed", [0.5, 2.0])
def test_a_recorded_game_goes_on_at_its_pace_to_its_end(speed, tmp_path, monkeypatch):
    record(tmp_path / "a.jsonl", ticks=100, config=CALM)

    async def script(replay, client):
        naps, awake, nap = [], asyncio.Event(), asyncio.sleep

        async def sleep(seconds):
            naps.append(seconds)
            if len(naps) > 31:
                await awake.wait()
            await nap(0)

        replay.close()
        monkeypatch.setattr(module.asyncio, "sleep", sleep)
        client.frames.clear()
        client.bytes.clear()
        replay = ReplaySession(Here(LoadedRecording.read(tmp_path / "a.jsonl"), AtOnce()), client)
        replay.pace(speed)
        for _ in range(500):
            await nap(0)
        assert shown(client).tick == int(31 * speed)
        assert told(client) == [(0, 0), (1, 0), (0, 0), *[(0, 1)] * (speed > 1)], "all that came into force"
        replay.seek(99)
        awake.set()
        for _ in range(500):
            await nap(0)
        assert shown(client).tick == 100
        replay.close()

    watch(tmp_path / "a.jsonl", script)


def test_of_moments_that_are_sought_meanwhile_the_latest_is_shown(tmp_path):
    record(tmp_path / "a.jsonl", ticks=100, config=CALM)

    async def script(replay, client):
        replay.close()
        thread = AtOnce()
        replay = ReplaySession(Here(LoadedRecording.read(tmp_path / "a.jsonl"), thread), client)
        replay.pace(0.0)
        for tick in range(90):
            replay.seek(tick)
        assert thread.count == 0, "nothing is simulated where everybody waits"
        client.frames.clear()
        await until(lambda: client.frames)
        replay.close()
        assert decode_frame(client.frames[0][0]).tick == 89 and thread.count == 1

    watch(tmp_path / "a.jsonl", script)


def test_where_a_game_plays_differently_the_recorded_frames_are_shown(tmp_path):
    record(tmp_path / "a.jsonl", ticks=100, config=CALM)

    async def script(replay, client):
        assert client.messages[0].verified is False
        for asked, tick in ((50, 48), (51, 51), (52, 51), (0, 0), (10_000, 99)):
            frame = await see(replay, client, asked)
            assert frame.tick == tick and len(set(frame.altitudes.tolist())) == 8
        assert not client.bytes, "nobody knows the targets"

    watch(tmp_path / "a.jsonl", script, is_verified=False)


def test_who_goes_away_is_shown_no_more(tmp_path):
    record(tmp_path / "a.jsonl", ticks=100, config=CALM)

    async def script(replay, client):
        replay.close()
        replay.pace(1.0)
        before = len(client.frames)
        await asyncio.sleep(0.2)
        assert len(client.frames) == before

    watch(tmp_path / "a.jsonl", script)


@pytest.mark.parametrize("shown_before", [0, 2])
def test_a_game_that_cannot_be_shown_any_further_says_so(shown_before, tmp_path):
    record(tmp_path / "a.jsonl", ticks=100, config=CALM)

    async def play():
        client = Client()
        replay = ReplaySession(Here(LoadedRecording.read(tmp_path / "a.jsonl")), client)
        await until(lambda: len(client.frames) >= shown_before)
        client.show = None
        await until(lambda: client.heard(protocol.Notice))
        replay.close()
        return client.heard(protocol.Notice)

    (notice,) = asyncio.run(play())
    assert "cannot be shown any further" in notice.text


def test_what_is_too_long_or_shows_nothing_is_not_watched(tmp_path, monkeypatch):
    record(tmp_path / "a.jsonl", ticks=30, config=CALM)
    (tmp_path / "b.jsonl").write_bytes((tmp_path / "a.jsonl").read_bytes().split(b"\n")[0] + b"\n")
    with pytest.raises(RecordingError, match="broke off before"):
        LoadedRecording.read(tmp_path / "b.jsonl")
    monkeypatch.setattr(module, "_MOST_BYTES", 1000)
    with pytest.raises(RecordingError, match="too long"):
        LoadedRecording.read(tmp_path / "a.jsonl")
