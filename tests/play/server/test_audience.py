"""Who is in a room, and what they are told: soon, where they are many."""

import asyncio

from swarm_pz.play import protocol
from swarm_pz.play.server import audience as module
from swarm_pz.play.server.budget import Budget
from tests.play.server.test_room import Client, opened, seated, until


def test_how_a_room_stands_is_told_to_so_many_and_then_to_all_at_once_again_and_again(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "TELL_S", 0.05)
    monkeypatch.setattr(module, "Budget", lambda most, per_second, now: Budget(10.0, 0.0, now))  # nothing comes back

    async def play():
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
                assert told()[0] == 3 + more, "later"
                await until(lambda more=more: told() == [4 + more, 3 + more, 2 + more, 1 + more], 5.0)
            await asyncio.sleep(0.1)
            assert told()[0] == 6, "once for all that was to be told"

    asyncio.run(play())


def test_who_comes_again_and_again_is_not_told_to_everybody_each_time(tmp_path, monkeypatch):
    monkeypatch.setattr(module, "TELL_S", 0.05)

    async def play():
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

    asyncio.run(play())
