"""The lobby: rooms by code, seats by token, and rooms that are closed when nobody is there."""

import contextlib
import os
import threading
import time
from collections import Counter

import pytest

from swarm_pz.errors import RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.game import TableConfig
from swarm_pz.play.server import lobby as module
from swarm_pz.play.server.connection import RefusedError
from swarm_pz.play.server.lobby import EMPTY_S, MOST_ROOMS, MOST_ROOMS_OF_ADDRESS, OPENING_S
from swarm_pz.play.server.rate_limit import AddressLimits
from swarm_pz.play.server.room import AWAY_S
from swarm_pz.play.server.room_settings import RoomPlan, cost_of, table_config
from tests.play.server.test_client_handler import Hall
from tests.play.server.test_room import Client

HERE, THERE, FEW = "192.0.2.1", "192.0.2.2", 8


@pytest.fixture
def lobby(tmp_path):
    made = Hall(tmp_path)
    yield made
    made.close()
    assert not made.rooms


@pytest.fixture
def few(lobby, monkeypatch):
    """Limit each address to few rooms."""
    monkeypatch.setattr(module, "MOST_ROOMS_OF_ADDRESS", FEW)
    lobby._openings = AddressLimits(FEW, OPENING_S)


def planned(**settings):
    return RoomPlan(config=table_config(protocol.Settings(**settings), TableConfig()))


def fill(lobby, address, count, *, watched=False, **settings):
    rooms = []
    for _ in range(count):
        rooms.append(lobby.open_room(planned(**settings), address))
        if watched:
            rooms[-1].watch(Client())
    return rooms


# --- how many -------------------------------------------------------------------------------------


def test_rooms_in_which_nobody_has_been_for_long_are_closed_and_no_others(lobby):
    watched, empty, away, reloading, new = fill(lobby, "", 5)
    watched.watch(Client())
    for room in (away, reloading):
        room.seats[0].token = "0" * 32  # somebody may come back
    for room, seconds in ((watched, 1000), (empty, EMPTY_S + 1), (away, AWAY_S + 1), (reloading, AWAY_S - 10)):
        room.last_used = time.monotonic() - seconds
    lobby.close_idle_rooms()
    assert list(lobby.rooms.values()) == [watched, reloading, new]
    assert watched.last_used > time.monotonic() - 10


def test_there_are_no_more_rooms_than_allowed_in_all_and_of_an_address(lobby, clock, few, monkeypatch):
    rooms = fill(lobby, HERE, FEW, watched=True)
    clock.now += 60.0
    with pytest.raises(RefusedError, match=r"as much as 1\.00 rooms .* 0\.00 left for your network") as refused:
        fill(lobby, HERE, 1)
    assert refused.value.code == "full"
    assert fill(lobby, THERE, 1, watched=True), "others have room"
    lobby.close_room(rooms[-1])
    assert fill(lobby, HERE, 1)
    monkeypatch.setattr(module, "MOST_ROOMS", len(lobby.rooms))
    with pytest.raises(RefusedError, match=r"0\.00 left on this server"):
        fill(lobby, "192.0.2.3", 1)


def test_rooms_count_by_what_they_take_and_a_first_one_may_be_the_dearest(lobby, clock):
    """Forty rooms of 200 against 200 at double speed, from one address, slowed all others to a third."""
    large, opened = {"red": 200, "blue": 200, "speed": 2.0}, Counter()
    for address in (HERE, THERE, "192.0.2.3"):
        for _ in range(6):
            with contextlib.suppress(RefusedError):
                fill(lobby, address, 1, watched=True, **large)
                opened[address] += 1
    assert list(opened.values()) == [5, 5, 3]
    assert sum(room.cost for room in lobby.rooms.values()) <= MOST_ROOMS
    for room in list(lobby.rooms.values()):
        lobby.close_room(room)
    (slow,) = fill(lobby, HERE, 1, red_system="coverage", blue_system="coverage", **large)
    assert slow.cost > MOST_ROOMS_OF_ADDRESS
    others = ({}, {"red": 100}, {"red": 100, "red_system": "formation"}, {"speed": 2.0})
    costs = [cost_of(table_config(protocol.Settings(**settings), TableConfig())) for settings in others]
    assert costs[0] == 1.0 and costs[0] < costs[1] < costs[2] and costs[3] == 2.0


def test_of_the_rooms_of_an_address_that_nobody_is_in_the_one_that_was_longest_so_gives_way(lobby, clock, few):
    (others,) = fill(lobby, THERE, 1)
    rooms = fill(lobby, HERE, FEW)
    rooms[3].watch(Client())
    for place, room in enumerate(rooms):
        room.last_used = float(place)
    rooms[5].last_used = others.last_used = rooms[3].last_used = -1.0
    clock.now += 60.0
    more = fill(lobby, HERE, 3)
    assert [room for room in rooms if room.code not in lobby.rooms] == [*rooms[:2], rooms[5]]
    assert {room.code for room in (others, *more)} <= set(lobby.rooms)


# --- recorded games -------------------------------------------------------------------------------


async def test_recorded_games_are_listed_off_the_event_loop(lobby, tmp_path, monkeypatch):
    names = [f"2026010{day}T000000Z-ABCD-1.jsonl" for day in (1, 2)]
    for name in (*names, "no name.jsonl", "notes.txt"):
        (tmp_path / name).write_text("{}\n")
    (tmp_path / "20260103T000000Z-ABCD-1.jsonl").symlink_to(tmp_path / "no name.jsonl")
    threads, summary_of = [], module.summary_of
    monkeypatch.setattr(
        module, "summary_of", lambda path: threads.append(threading.current_thread()) or summary_of(path)
    )
    listed = await lobby.recordings()
    assert [game.name for game in listed] == names[::-1], "the latest first"
    assert threads and threading.main_thread() not in threads


def test_only_regular_files_of_the_folder_itself_are_served(lobby, tmp_path):
    (tmp_path.parent / "secret.jsonl").write_text("secret")
    (tmp_path / "link.jsonl").symlink_to(tmp_path.parent / "secret.jsonl")
    (tmp_path / "folder.jsonl").mkdir()
    os.mkfifo(tmp_path / "pipe.jsonl")
    (tmp_path / "game.jsonl").write_text("{}\n")
    for name in ("none.jsonl", "../secret.jsonl", "link.jsonl", "folder.jsonl", "pipe.jsonl"):
        with pytest.raises(RecordingError):
            lobby.find_recording(name)
    assert lobby.find_recording("game.jsonl") == tmp_path / "game.jsonl"
