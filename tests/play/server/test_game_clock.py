"""The clock of a game in real time, where the server stalls."""

import asyncio
import time

from swarm_pz.config import TICKS_PER_SECOND
from swarm_pz.play import protocol
from swarm_pz.play.server.room import Room
from tests.play.server.test_room import Client, context, until


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
