"""The server over real sockets: whether its parts work together; each part has its own tests."""

import contextlib
import math
import re
import time
import urllib.parse
from pathlib import Path

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from swarm_pz.play import protocol
from swarm_pz.play.protocol import InForceMessage
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from tests.play.conftest import SLOW_MS

RING = protocol.StrokeMessage(
    "attract", 0.1, [(0.5 + 0.2 * math.cos(a / 6), 0.5 + 0.2 * math.sin(a / 6)) for a in range(38)]
)


def welcome_of(client):
    return next(message for message in client.messages if isinstance(message, protocol.Welcome))


def test_two_people_play_to_the_end_and_the_recording_verifies(table):
    red, blue, watcher = clients = [table.visit() for _ in range(3)]
    cards = {policy.name: policy.card for policy in welcome_of(red).policies}
    assert cards["uniform"].rating == 1000 < cards["champion"].rating and len(cards["uniform"].target) == 10
    assert welcome_of(red).records_labels and welcome_of(red).addresses == [], "this machine alone can reach it"
    red.say(protocol.Create(settings=protocol.Settings(red=3, blue=3, time_limit=3.0), label="P7"))
    seat = red.hear(protocol.Seated)
    blue.say(protocol.Join(seat.room, "blue"))
    watcher.say(protocol.Join(seat.room))
    watcher.hear(protocol.RoomState)
    red.say(protocol.Ready())
    blue.say(protocol.Ready())
    red.hear(protocol.RoomState, lambda state: state.phase == "playing")
    red.say(protocol.CommandMessage(1, strokes=[RING]))
    blue.say(protocol.CommandMessage(1, density=np.eye(10).tolist()))
    assert red.hear(protocol.InForceMessage).number == 1
    red.say(" " * 70_000)
    again = table.visit(seat.token)
    red.hear_close()  # a message that is too long closes the connection
    assert again.hear(protocol.Seated).token == seat.token
    for one in (again, blue, watcher):
        over = one.hear(protocol.RoomState, lambda state: state.phase == "over")
    assert 0 < len(watcher.frames) <= 13 < len(again.frames), "who does not answer is sent a handful"
    assert [frame.tick for frame in again.frames] == sorted(frame.tick for frame in again.frames)
    for clients_of, team in (((red, again), {0}), ((blue,), {1}), ((watcher,), set())):
        shown = {target[1] for client in clients_of for target in client.targets}
        assert shown == team, "a target is for its own side alone"
    recording = Recording.read(table.folder / over.recording)
    assert Playback(recording).verify().verified and recording.end.outcome == over.outcome
    assert recording.header.red.label == "P7" and recording.header.blue.kind == "person"
    assert {line.team for line in recording.of(InForceMessage)} == {0, 1}
    for client in (*clients, again):
        client.close()


def test_the_program_of_the_documentation_plays_a_game(table, capsys):
    page = (Path(__file__).parents[3] / "docs" / "protocol.md").read_text()
    program, *_ = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert 'opponent="champion"' in program
    host = table.visit()
    host.say(protocol.Create(settings=protocol.Settings(blue=0, time_limit=1.0)))
    room = host.hear(protocol.Seated).room
    watcher = table.visit()
    watcher.say(protocol.Join(room))
    watcher.hear(protocol.RoomState)
    host.say(protocol.Leave())  # the program joins this short game instead of its own long one
    snippet = program.replace("127.0.0.1:8000", table.address).replace('opponent="champion"', f'room="{room}"')
    exec(snippet, {})  # noqa: S102
    assert capsys.readouterr().out.strip() == "draw"
    for client in (host, watcher):
        client.close()


# --- who comes in ---------------------------------------------------------------------------------


def test_names_that_are_not_served_and_other_protocols_are_kept_out_and_paths_lead_nowhere(table):
    _, headers, text = table.get("/")
    assert "default-src 'none'" in headers["content-security-policy"]
    assert "<script>" not in text and " style=" not in text and "http:" not in text
    for path in ("/", "/static/main.js"):
        assert table.get(path, **{"Accept-Encoding": "gzip"})[1]["content-encoding"] == "gzip"
    with pytest.raises(InvalidStatus):
        table.visit(additional_headers={"Origin": "http://evil.example"})
    with pytest.raises((ConnectionClosed, InvalidStatus)), connect(f"ws://{table.address}/socket") as socket:
        socket.recv(timeout=60)
    for name in ("..%2f..%2fpyproject.toml", "%2e%2e/x.jsonl", "x.jsonl%00"):
        assert table.get(f"/recordings/{name}")[0] == table.get(f"/static/{name}")[0] == 404


def test_an_invitation_is_drawn_for_rooms_and_addresses_of_this_table_and_no_others(table):
    client = table.visit()
    client.say(protocol.Create())
    room = client.hear(protocol.Seated).room

    def drawn(room, at):
        return table.get(f"/invitations/{room}.svg?at={urllib.parse.quote(at)}")

    status, headers, text = drawn(room, f"http://{table.address}/")
    assert status == 200 and headers["content-type"].startswith("image/svg+xml") and "<path" in text
    assert drawn(room, f"https://{table.address}/")[0] == 200, "behind a proxy"
    for place in (("ZZZZ", f"http://{table.address}/"), (room, "http://elsewhere.example/"), (room, "")):
        assert drawn(*place)[0] == 404
    client.close()


# --- the end --------------------------------------------------------------------------------------


def test_clients_that_drop_flood_and_return_lose_and_leave_nothing_and_the_end_finishes_its_files(own_table):
    table, before = own_table, own_table.status()
    clients = red, blue = [table.visit(), table.visit()]
    assert not welcome_of(red).records_labels, "unless the host asks for it"
    red.say(protocol.Create(settings=protocol.Settings(time_limit=None), label="<b>&"))
    seats = [red.hear(protocol.Seated)]
    blue.say(protocol.Join(seats[0].room, "blue"))
    seats.append(blue.hear(protocol.Seated))
    for client in (red, blue):
        client.say(protocol.Ready())
    red.hear(protocol.RoomState, lambda state: state.phase == "playing")
    for turn in range(6):
        client, seat = clients[turn % 2], seats[turn % 2]
        with contextlib.suppress(ConnectionClosed):
            if turn < 4:  # until the server closes the connection
                while True:
                    client.say(protocol.Ping(0.0) if turn < 2 else "{garbage")
                    client.take()
        client.socket.socket.close() if turn >= 4 else client.close()
        clients[turn % 2] = back = table.visit(seat.token)
        assert back.hear(protocol.RoomState).red.label == "<b>&"
        while not back.frames:
            back.take()
        clients[1 - turn % 2].say(protocol.CommandMessage(turn, density=[[0.5] * 10] * 10))
    status = table.status()
    assert (status["rooms"], status["playing"], status["connections"]) == (1, 1, 2)
    for client in clients:
        client.say(protocol.Leave())
        client.close()
    end, kept = time.monotonic() + SLOW_MS / 1000, ("tasks", "open_files")
    while (left := table.status())["connections"] or left["rooms"] or any(left[one] > before[one] for one in kept):
        assert time.monotonic() < end, left
        time.sleep(0.2)
    player = table.visit()
    player.play(opponent=None, blue=0, time_limit=None)
    player.say(protocol.CommandMessage(1, strokes=[RING]))
    player.hear(protocol.InForceMessage)
    assert "Traceback" not in table.end()
    for room in (seats[0].room, player.seated.room):
        read = Recording.read(table.recording(room))
        assert read.end.outcome == "stopped" and Playback(read).verify().verified and read.header.red.label == ""
    player.hear_close()
