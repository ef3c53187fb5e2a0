"""Rooms with clients that drop, return, flood and send garbage: nothing is lost, and nothing is left."""

import contextlib
import time

from websockets.exceptions import ConnectionClosed

from swarm_pz.play import protocol
from tests.play.conftest import SLOW_MS

ENDLESS = protocol.Create(settings=protocol.Settings(time_limit=None))


def test_nothing_is_lost_and_nothing_is_left(own_table):
    table, before = own_table, own_table.status()
    rooms = []
    for _ in range(2):
        red, blue = table.visit(), table.visit()
        red.say(ENDLESS)
        seats = [red.hear(protocol.Seated)]
        blue.say(protocol.Join(seats[0].room, "blue"))
        seats.append(blue.hear(protocol.Seated))
        for client in (red, blue):
            client.say(protocol.Ready())
        red.hear(protocol.RoomState, lambda state: state.phase == "playing")
        rooms.append(([red, blue], seats))
    for turn in range(6):
        for clients, seats in rooms:
            client, seat = clients[turn % 2], seats[turn % 2]
            with contextlib.suppress(ConnectionClosed):
                if turn < 4:  # until the server closes the connection
                    while True:
                        client.say(protocol.Ping(0.0) if turn < 2 else "{garbage")
                        client.take()
            client.socket.socket.close() if turn >= 4 else client.close()
            clients[turn % 2] = back = table.visit(seat.token)
            back.hear(protocol.Seated)
            while not back.frames:
                back.take()
            clients[1 - turn % 2].say(protocol.CommandMessage(turn, density=[[0.5] * 10] * 10))
    assert table.status()["playing"] == 2
    for clients, _ in rooms:
        for client in clients:
            client.say(protocol.Leave())
            client.close()
    end = time.monotonic() + SLOW_MS / 1000
    kept = ("tasks", "open_files")
    while (left := table.status())["connections"] or left["rooms"] or any(left[one] > before[one] for one in kept):
        assert time.monotonic() < end, left
        time.sleep(0.2)
    assert len(list(table.folder.glob("*.jsonl"))) == 2
