"""Who is in a room, and what they are told: soon, where they are many."""

import pytest

from swarm_pz.play import protocol
from swarm_pz.play.server import audience as module
from swarm_pz.play.server.budget import Rate
from tests.play.server.test_room import Client, opened, seated, until

pytestmark = pytest.mark.anyio


async def test_a_rooms_state_is_told_to_so_many_and_then_to_all_together_once_in_a_while(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "TELL_S", 0.05)
    monkeypatch.setattr(module, "TOLD", Rate(10.0, 1e-9))  # nothing comes back
    with opened(tmp_path) as room:
        clients = [Client() for _ in range(4)]
        for client in clients:
            room.watch(client)

        def told():
            return [len(client.messages) for client in clients]

        assert told() == [4, 3, 2, 1], "which are ten"
        for more in (1, 2):
            for _ in range(20):
                room.audience.tell_state()
            assert told()[0] == 3 + more, "later, and once for all that was to be told"
            await until(lambda more=more: told() == [4 + more, 3 + more, 2 + more, 1 + more], 5.0)


async def test_who_comes_again_and_again_is_not_told_to_everybody_each_time(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "TELL_S", 0.05)
    with opened(tmp_path) as room:
        watchers = [Client() for _ in range(30)]
        for watcher in watchers * 10:
            watcher.messages.clear()
            room.watch(watcher)
            assert watcher.heard(protocol.RoomState), "who comes is"
        (red,) = seated(room, "red")
        assert len(watchers[0].messages) < 10 and not watchers[0].messages[-1].red.connected
        await until(lambda: watchers[0].messages[-1].red.connected)
        assert all(client.messages[-1].watchers == 30 for client in (red, *watchers))
