"""Rooms and their games, without a network: what policies that fail do to them, and what is written."""

import asyncio
import time

import numpy as np
import pytest

from swarm_pz.config import TICKS_PER_SECOND, GameConfig
from swarm_pz.play import protocol
from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings.format import InForceLine, Recording, SeatLine
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.server.live_session import ServerContext
from swarm_pz.play.server.policy_workers import PolicyWorkers
from swarm_pz.play.server.replay_session import LoadedRecording, ReplaySession
from swarm_pz.play.server.room import RefusedError, Room
from swarm_pz.play.server.room_settings import settings_of, table_config
from tests.play.faulty import FAULTS, loader
from tests.play.recordings.test_format import record


class Client:
    """Keeps what it is sent."""

    kind, client = "person", None

    def __init__(self):
        self.messages, self.bytes, self.frames = [], [], []

    def send(self, message):
        self.messages.append(message)

    def send_bytes(self, data):
        self.bytes.append(data)

    def show(self, frame, sequence):
        self.frames.append((frame, sequence))


def context(tmp_path):
    return ServerContext(folder=tmp_path, workers=PolicyWorkers(loader))


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


def test_a_table_without_people_plays_on(tmp_path):
    async def play():
        shared, client = context(tmp_path), Client()
        room = Room("ABCD", protocol.Settings(time_limit=1.0), shared)
        room.sit(client, "red", "")
        room.place_policy("blue", "ring")
        room.ready(client, True)
        room.leave(client)
        assert room.seats[0].gone and not room.connections
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

        async def noting(place, games):
            seeds[place.team] = place.seed
            answers[place.team] = await ask(place, games)
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


def test_ticks_are_caught_up_two_at_a_time_and_then_time_slips(tmp_path):
    async def play():
        shared, client = context(tmp_path), Client()
        room = Room("ABCD", protocol.Settings(blue=0), shared)
        room.sit(client, "red", "")
        room.ready(client, True)
        await until(lambda: len(client.frames) > 5)
        before = room.session.game.tick
        time.sleep(0.5)  # the whole server stalls, for 15 ticks
        woken = time.monotonic()
        await asyncio.sleep(0.05)
        assert room.session.game.tick - before <= 4 + TICKS_PER_SECOND * (time.monotonic() - woken)
        assert shared.punctuality.most_caught_up == 2 and shared.punctuality.slipped >= 1
        room.stop()
        shared.workers.close()

    asyncio.run(play())


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


def test_settings_leave_the_rules_of_the_house_alone():
    released = GameConfig.preset("released")
    table = table_config(protocol.Settings(red=3, time_limit=60.0), TableConfig(game=released))
    assert table.game == released.replace(drones_per_team=(3, 10), time_limit=60.0)


def test_settings_come_back_from_the_table():
    settings = protocol.Settings(red=1, blue=19, time_limit=None, mapping="paper", speed=0.5)
    assert settings_of(table_config(settings, TableConfig())) == settings
    assert not table_config(protocol.Settings(blue=0), TableConfig()).game.capture.enabled


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
        replay = ReplaySession(LoadedRecording.read(old), client)
        replay.seek(60)
        moment = replay.moment()
        replay.close()
        room = Room("ABCD", settings_of(moment.game.config), shared, moment)
        room.sit(client, "red", "")
        room.place_policy("blue", "uniform")
        paths = []
        for _ in range(3):
            room.ready(client, True)
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
