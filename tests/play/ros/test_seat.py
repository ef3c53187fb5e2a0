"""A ROS program's seat: which of its commands count, how long it is kept, and whose it is."""

from __future__ import annotations

import asyncio

import numpy as np

from swarm_pz.play.recordings.format import CommandLine, InForceLine
from tests.play.ros.test_bridge import meet, recorded, spot

ALONE_S = 2.0


def test_of_images_that_come_at_once_the_last_is_the_target(table):
    async def conversation(meeting):
        tablet = await meeting.join()
        await tablet.connect_player("red")
        room = await meeting.room()
        for number in range(6):
            await tablet.deploy("red", spot(number))
        wanted = spot(5).reshape(10, 5, 10, 5).mean(axis=(1, 3), dtype=np.float64)
        count, line = 1, None
        while line is None or not np.allclose(np.array(line.density), wanted / wanted.max(), atol=1e-7):
            (*_, line) = lines = await recorded(table, room, InForceLine, count)
            count = len(lines) + 1
            line = (await recorded(table, room, CommandLine, line.number))[line.number - 1]
        assert not [line for line in meeting.lines if "refused" in line], "no command came too soon"

    meet(table, conversation, opponent="uniform")


def test_a_seat_is_kept_while_anybody_is_there_or_comes_back_in_time(table):
    async def conversation(meeting):
        tablet, other = await meeting.join(), await meeting.join()
        await tablet.connect_player("red")
        room = await meeting.room()
        assert await other.refused("red_connection_service")
        await other.leave()
        await asyncio.sleep(1.5 * ALONE_S)
        await tablet.deploy("red", spot(1))
        await recorded(table, room, InForceLine)
        again = await meeting.join()
        await tablet.leave()
        await again.deploy("red", spot(2))
        await recorded(table, room, InForceLine, 2)
        await asyncio.sleep(1.5 * ALONE_S)
        assert not [line for line in meeting.lines if "ended the connection" in line]

    meet(table, conversation, opponent="uniform", alone_s=ALONE_S)


def test_who_clears_clears_their_own_side(table):
    async def conversation(meeting):
        red, blue = await meeting.join(), await meeting.join()
        await red.connect_player("red")
        await blue.connect_player("blue")
        room = await meeting.room()
        await blue.publish("clear_locs")
        (line,) = await recorded(table, room, CommandLine, teams=(0, 1))
        assert line.team == 1 and np.ptp(line.density) == 0.0
        assert "data must be" in await blue.refused("/tablet_comm"), "and nothing was refused before"

    meet(table, conversation)
