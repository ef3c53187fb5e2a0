"""The lobby: rooms by code, seats by token, and rooms that are closed when nobody is there."""

import os
import time

import pytest

from swarm_pz.errors import RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.server import lobby as module
from swarm_pz.play.server.live_session import ServerContext
from swarm_pz.play.server.lobby import Lobby
from swarm_pz.play.server.policy_workers import PolicyWorkers
from swarm_pz.play.server.room import RefusedError
from tests.play.faulty import loader
from tests.play.server.test_room import Client


@pytest.fixture
def lobby(tmp_path):
    made = Lobby(ServerContext(folder=tmp_path, workers=PolicyWorkers(loader)), {"uniform": "covers evenly"})
    yield made
    made.close()
    assert not made.rooms


def test_rooms_in_which_nobody_has_been_for_long_are_closed_and_no_others(lobby):
    watched, empty, new = (lobby.open_room(protocol.Settings()) for _ in range(3))
    watched.watch(Client())
    long_ago = time.monotonic() - 2 * module._IDLE_S
    for room in (watched, empty):
        room.last_used = long_ago
    for room in (empty, new):
        room.seats[0].token = "0" * 32  # somebody may come back
    lobby.close_idle_rooms()
    assert list(lobby.rooms.values()) == [watched, new]
    assert watched.last_used > long_ago


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
    lobby.open_room(protocol.Settings())
    last = lobby.open_room(protocol.Settings())
    with pytest.raises(RefusedError, match="2 rooms and no more"):
        lobby.open_room(protocol.Settings())
    lobby.close_room(last)
    assert lobby.open_room(protocol.Settings()).code in lobby.rooms


def test_policies_and_recordings_that_are_not_here_are_refused(lobby):
    assert lobby.check_policy("uniform") == "uniform"
    assert [policy.name for policy in lobby.welcome().policies] == ["uniform"]
    with pytest.raises(RefusedError, match="no policy 'ring' here"):
        lobby.check_policy("ring")
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
