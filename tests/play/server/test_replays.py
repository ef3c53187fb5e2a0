"""Recorded games that are watched, and played on from the moment that is shown."""

import asyncio
from dataclasses import replace

import numpy as np
import pytest

from swarm_pz.errors import RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.frames import FRAME, TARGET, decode_frame
from swarm_pz.play.server import replays as module
from swarm_pz.play.server.replays import LoadedRecording, ReplaySession, bounded, sizes_of
from swarm_pz.play.server.room_settings import settings_of
from tests.play.recordings.games import record
from tests.play.server.test_room import CALM, Client, until

pytestmark = pytest.mark.anyio
SMALL = CALM.replace(game=CALM.game.replace(drones_per_team=4))


@pytest.fixture(scope="module")
def game(tmp_path_factory):
    """Give the file of a recorded game."""
    path = tmp_path_factory.mktemp("recorded") / "a.jsonl"
    record(path, ticks=100, config=SMALL)
    return path


class Watcher(Client):
    """A client that watches a recorded game, which is held at first."""

    def __init__(self, loaded, speed=0.0):
        super().__init__()
        self.replay = ReplaySession(loaded, self, self)
        self.replay.pace(speed)

    async def do(self, work, *given):
        """Work here, in place of a thread."""
        await asyncio.sleep(0)
        return work(*given)

    async def see(self, tick):
        """Seek a moment, and return the frame that shows it."""
        before = len(self.frames)
        self.replay.seek(tick)
        await until(lambda: len(self.frames) > before)
        return self.shown()

    def shown(self):
        data, sequence = self.frames[-1]
        frame = decode_frame(data)
        assert frame.sequence == sequence == len(self.frames)
        return frame

    def told(self):
        """Return the teams and numbers of the targets that were sent, and forget them."""
        targets = [(data[1], int.from_bytes(data[4:8], "little")) for data in self.bytes if data[0] == TARGET]
        self.bytes.clear()
        return targets


# --- what is loaded -------------------------------------------------------------------------------


def test_sizes_of_a_second_are_those_at_its_beginning(game):
    frames = LoadedRecording.read(game).frames
    for frame in frames:
        frame.teams[:] = np.arange(8) < frame.tick // 10
    assert sizes_of(frames) == [(8, 0), (5, 3), (2, 6), (0, 8)]


def test_a_recorded_game_is_told_of_as_it_was(tmp_path):
    config = SMALL.replace(min_command_interval=0.25, mapping="paper", game=CALM.game.replace(drones_per_team=(3, 5)))
    record(tmp_path / "a.jsonl", ticks=40, config=config)
    about = {"connected": True, "system": "ergodic", "takes": "density"}
    assert LoadedRecording.read(tmp_path / "a.jsonl").state == protocol.RoomState(
        code="", phase="replay", settings=settings_of(config), red=protocol.SeatState("person", "", "P1", **about),
        blue=protocol.SeatState("policy", "ring", "", **about), watchers=1, sizes=[(3, 5)] * 2,
        min_command_interval=0.25, outcome="stopped", recording="a.jsonl", last_tick=40,
        ended_by="server",
    )  # fmt: skip


def test_a_game_that_shows_nothing_is_not_watched(game, tmp_path):
    (tmp_path / "b.jsonl").write_bytes(game.read_bytes().split(b"\n")[0] + b"\n")
    with pytest.raises(RecordingError, match="broke off before"):
        LoadedRecording.read(tmp_path / "b.jsonl")


# --- what is shown --------------------------------------------------------------------------------


async def test_a_moment_is_shown_with_fields_and_targets_and_none_lies_beyond_the_end(game):
    loaded = LoadedRecording.read(game)
    watcher = Watcher(loaded)
    await until(lambda: watcher.frames)
    watcher.told()
    for asked, tick in ((70, 70), (1_000_000, 100), (4, 4)):
        frame = await watcher.see(asked)
        trails = [decode_frame(data).tick for data in watcher.bytes if data[0] == FRAME]
        assert trails == [*range(0, tick + 1, 9)], "where its drones came from"
        assert frame.tick == tick and frame.fields is not None and watcher.told() == [(0, 0), (1, 0)]
        np.testing.assert_allclose(frame.altitudes, loaded.playback.game.simulator.altitudes[0], atol=1 / 255)
        np.testing.assert_allclose(frame.positions, loaded.playback.game.simulator.positions[0], atol=1e-5)
    watcher.replay.close()
    shown = len(watcher.frames)
    watcher.replay.pace(8.0)
    await asyncio.sleep(0.1)
    assert len(watcher.frames) == shown, "who goes away is shown no more"


@pytest.mark.parametrize("speed", [0.5, 2.0])
async def test_a_recorded_game_goes_on_at_its_pace_to_its_end(speed, game, monkeypatch):
    naps, awake, nap = [], asyncio.Event(), asyncio.sleep

    async def sleep(seconds):
        if seconds:
            naps.append(seconds)
            if len(naps) > 31:
                await awake.wait()
        await nap(0)

    monkeypatch.setattr(module.asyncio, "sleep", sleep)
    watcher = Watcher(LoadedRecording.read(game), speed)
    while len(naps) < 32:
        await nap(0)
    assert watcher.shown().tick == int(31 * speed)
    assert watcher.told() == [(0, 0), (1, 0), (0, 0), *[(0, 1)] * (speed > 1)], "all that came into force"
    watcher.replay.seek(99)
    awake.set()
    while watcher.shown().tick < 100:
        await nap(0)
    count = len(watcher.frames)
    for _ in range(20):
        await nap(0)
    assert len(watcher.frames) == count
    watcher.replay.close()


async def test_of_moments_that_are_sought_meanwhile_the_latest_is_shown(game):
    watcher = Watcher(LoadedRecording.read(game))
    for tick in range(90):
        watcher.replay.seek(tick)
    await until(lambda: watcher.frames)
    watcher.replay.close()
    assert watcher.shown().tick == 89 and len(watcher.frames) == 1


async def test_where_a_game_plays_differently_the_recorded_frames_are_shown(game):
    watcher = Watcher(replace(LoadedRecording.read(game), is_verified=False))
    await until(lambda: watcher.frames)
    for asked, tick in ((50, 48), (51, 51), (52, 51), (0, 0), (10_000, 99)):
        frame = await watcher.see(asked)
        assert frame.tick == tick and len(set(frame.altitudes.tolist())) == 8
    assert not watcher.told(), "nobody knows the targets"
    watcher.replay.close()


def test_a_game_that_takes_too_much_time_or_memory_or_makes_a_fault_is_refused(game, monkeypatch):
    for name in ("MOST_BYTES", "MOST_LISTS"):
        with monkeypatch.context() as small:
            small.setattr(module, name, 10)
            with pytest.raises(RecordingError, match="too long to be watched"):
                bounded(game, LoadedRecording.read)
    monkeypatch.setattr(module, "MOST_SECONDS", 0.0)
    with pytest.raises(RecordingError, match="takes too long"):
        bounded(game, LoadedRecording.read)
    with pytest.raises(RecordingError, match="cannot be played again: ZeroDivisionError"):
        bounded(game, lambda path: 1 / 0)
