"""The lobby: rooms by code, seats by token, and rooms that are closed when nobody is there."""

import asyncio
import contextlib
import os
import threading
import time
from collections import Counter

import pytest

from swarm_pz.errors import RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings import summary
from swarm_pz.play.server import lobby as module
from swarm_pz.play.server.connection import RefusedError
from swarm_pz.play.server.lobby import (
    EMPTY_S,
    MOST_REPLAY_BYTES,
    MOST_ROOMS,
    MOST_ROOMS_OF_ADDRESS,
    Lobby,
)
from swarm_pz.play.server.policy_workers import PolicyWorkers
from swarm_pz.play.server.room import AWAY_S
from swarm_pz.play.server.room_settings import cost_of, table_config
from swarm_pz.play.server.server_context import ServerContext
from tests.play.faulty import loader
from tests.play.recordings.test_format import record
from tests.play.server.test_room import Client


@pytest.fixture
def lobby(tmp_path):
    made = Lobby(ServerContext(folder=tmp_path, workers=PolicyWorkers(loader)), {"uniform": "covers evenly"})
    yield made
    made.close()
    assert not made.rooms


def test_rooms_in_which_nobody_has_been_for_long_are_closed_and_no_others(lobby):
    watched, empty, away, reloading, new = (lobby.open_room(protocol.Settings()) for _ in range(5))
    watched.watch(Client())
    for room in (away, reloading):
        room.seats[0].token = "0" * 32  # somebody may come back
    for room, seconds in ((watched, 1000), (empty, EMPTY_S + 1), (away, AWAY_S + 1), (reloading, AWAY_S - 10)):
        room.last_used = time.monotonic() - seconds
    lobby.close_idle_rooms()
    assert list(lobby.rooms.values()) == [watched, reloading, new]
    assert watched.last_used > time.monotonic() - 10


def test_rooms_are_found_by_code_and_seats_by_token(lobby):
    rooms = [lobby.open_room(protocol.Settings()) for _ in range(3)]
    assert [lobby.rooms[room.code] for room in rooms] == rooms
    rooms[1].sit(Client(), "blue", "")
    token = rooms[1].seats[1].token
    assert lobby.seat_of(token) == (rooms[1], rooms[1].seats[1])
    assert lobby.seat_of(token[:-1]) is None and lobby.seat_of("") is None
    lobby.close_room(rooms[1])
    assert lobby.seat_of(token) is None


def test_there_are_no_more_rooms_than_allowed(lobby, monkeypatch):
    monkeypatch.setattr(module, "MOST_ROOMS", 2)
    (first,), (_,) = (fill(lobby, f"192.0.2.{place}", 1, watched=True) for place in range(2))
    with pytest.raises(RefusedError, match=r"0\.0 left for your network"):
        lobby.open_room(protocol.Settings())
    lobby.close_room(first)
    assert lobby.open_room(protocol.Settings()).code in lobby.rooms


@pytest.fixture
def clock(monkeypatch):
    """Give a clock that goes on when it is told."""

    class Clock:
        now = 1000.0

    monkeypatch.setattr(module.time, "monotonic", lambda: Clock.now)
    return Clock


def fill(lobby, address, count, *, watched=False):
    rooms = []
    for _ in range(count):
        rooms.append(lobby.open_room(protocol.Settings(), address=address))
        if watched:
            rooms[-1].watch(Client())
    return rooms


def test_an_address_has_a_share_of_the_rooms(lobby, clock):
    rooms = fill(lobby, "192.0.2.1", MOST_ROOMS_OF_ADDRESS, watched=True)
    clock.now += 60.0
    with pytest.raises(RefusedError, match=r"as much as 1\.0 rooms .* 0\.0 left for your network") as refused:
        fill(lobby, "192.0.2.1", 1)
    assert refused.value.code == "full"
    assert fill(lobby, "192.0.2.2", 1), "others have room"
    lobby.close_room(rooms[-1])
    assert fill(lobby, "192.0.2.1", 1)


def test_rooms_count_by_what_they_take(lobby, clock):
    """Forty rooms of 200 against 200 at double speed, from one address, slowed all others to a third."""
    large = protocol.Settings(red=200, blue=200, speed=2.0)
    opened = Counter()
    for address in ("192.0.2.1", "192.0.2.2", "192.0.2.3"):
        for _ in range(20):
            with contextlib.suppress(RefusedError):
                lobby.open_room(large, address=address).watch(Client())
                opened[address] += 1
    assert list(opened.values()) == [4, 4, 2]
    assert sum(room.cost for room in lobby.rooms.values()) <= MOST_ROOMS


def test_who_has_no_other_room_may_open_the_dearest_one(lobby):
    slow = protocol.Settings(red=200, blue=200, speed=2.0, red_system="coverage", blue_system="coverage")
    assert lobby.open_room(slow, address="192.0.2.1").cost > MOST_ROOMS_OF_ADDRESS


def test_slow_fliers_many_drones_and_speed_make_a_room_cost_more():
    costs = [
        cost_of(table_config(protocol.Settings(**settings), TableConfig()))
        for settings in ({}, {"red": 100}, {"red": 100, "red_system": "formation"}, {"speed": 2.0})
    ]
    assert costs[0] == 1.0 and costs[0] < costs[1] < costs[2] and costs[3] == 2.0


def test_of_the_rooms_of_an_address_that_nobody_is_in_the_one_that_was_longest_so_gives_way(lobby, clock):
    (others,) = fill(lobby, "192.0.2.2", 1)
    rooms = fill(lobby, "192.0.2.1", MOST_ROOMS_OF_ADDRESS)
    rooms[3].watch(Client())
    rooms[5].last_used -= 10.0
    others.last_used = rooms[3].last_used = 0.0
    clock.now += 60.0
    more = fill(lobby, "192.0.2.1", 3)
    assert [room for room in rooms if room.code not in lobby.rooms] == [*rooms[:2], rooms[5]]
    assert {room.code for room in (others, *more)} <= set(lobby.rooms)


def test_an_address_opens_so_many_rooms_at_once_and_then_one_a_second(lobby, clock):
    fill(lobby, "192.0.2.1", MOST_ROOMS_OF_ADDRESS)
    with pytest.raises(RefusedError, match="opens rooms too fast; wait for a second") as refused:
        fill(lobby, "192.0.2.1", 1)
    assert refused.value.code == "full" and len(lobby.rooms) == MOST_ROOMS_OF_ADDRESS, "and none gave way"
    fill(lobby, "192.0.2.2", 1)
    clock.now += 2.0
    lobby.close_idle_rooms()
    fill(lobby, "192.0.2.1", 2)
    with pytest.raises(RefusedError, match="too fast"):
        fill(lobby, "192.0.2.1", 1)


def test_recorded_games_that_are_watched_are_so_large_together_and_no_larger(lobby):
    class Watched:
        def __init__(self, size):
            self.size = size

    lobby.watched = {Watched(MOST_REPLAY_BYTES - 1)}
    lobby.check_replays()
    lobby.watched.add(Watched(1))
    with pytest.raises(RefusedError, match="too many recorded games are watched") as refused:
        lobby.check_replays()
    assert refused.value.code == "full"


def test_recorded_games_are_listed_while_one_is_read_and_off_the_event_loop(lobby, tmp_path, monkeypatch):
    (tmp_path / "20260101T000000Z-ABCD-1.jsonl").write_text("{}\n")
    (tmp_path / "no name.jsonl").write_text("{}\n")
    (tmp_path / "20260102T000000Z-ABCD-1.jsonl").symlink_to(tmp_path / "no name.jsonl")
    threads, may_end, summary_of = [], threading.Event(), summary.summary_of
    monkeypatch.setattr(
        summary, "summary_of", lambda path: threads.append(threading.current_thread()) or summary_of(path)
    )

    async def visit():
        lobby._replays.reader._worker.do(may_end.wait)
        try:
            return await asyncio.wait_for(lobby.recordings(), 30)
        finally:
            may_end.set()

    assert [game.name for game in asyncio.run(visit())] == ["20260101T000000Z-ABCD-1.jsonl"]
    assert threads and threading.main_thread() not in threads


def test_policies_and_recordings_that_are_not_here_are_refused(lobby):
    assert lobby.check_policy("uniform") == "uniform"
    assert [policy.name for policy in lobby.welcome().policies] == ["uniform"]
    with pytest.raises(RefusedError, match="no policy 'ring' here"):
        lobby.check_policy("ring")
    with pytest.raises(RefusedError, match=r"no policy 'mine\.py:ring' here"):  # files run code
        lobby.check_policy("mine.py:ring")
    for name in ("none.jsonl", "../none.jsonl"):
        with pytest.raises(RecordingError):
            lobby.find_recording(name)


def test_only_regular_files_of_the_folder_itself_are_served(lobby, tmp_path):
    (tmp_path.parent / "secret").write_text("secret")
    (tmp_path / "link.jsonl").symlink_to(tmp_path.parent / "secret")
    (tmp_path / "folder.jsonl").mkdir()
    os.mkfifo(tmp_path / "pipe.jsonl")
    (tmp_path / "game.jsonl").write_text("{}\n")
    for name in ("link.jsonl", "folder.jsonl", "pipe.jsonl"):
        with pytest.raises(RecordingError, match=f"no recording {name} here"):
            lobby.find_recording(name)
    assert lobby.find_recording("game.jsonl") == tmp_path / "game.jsonl"


def test_a_recorded_game_is_told_as_rows_of_an_experiment_once_it_is_over(lobby, tmp_path):
    record(tmp_path / "a.jsonl", outcome="draw")
    rows = asyncio.run(lobby.trial("a.jsonl"))
    assert [row["side"] for row in rows] == ["red", "blue"]
    assert {"outcome", "seconds", "captured", "lost", "commands", "recording", "opponent", "seed"} <= set(rows[0])
    with pytest.raises(RecordingError, match="no recording"):
        asyncio.run(lobby.trial("b.jsonl"))
