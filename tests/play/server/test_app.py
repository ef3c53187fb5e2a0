"""The server over real sockets: whether its parts work together; each part has its own tests."""

import math
import re
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
from swarm_pz.policies import zoo
from tests.play.conftest import Table

FOLDER = str(Path(zoo.__file__).parent / "hunter")
RING = protocol.StrokeMessage(
    "attract", 0.1, [(0.5 + 0.2 * math.cos(a / 6), 0.5 + 0.2 * math.sin(a / 6)) for a in range(38)]
)


def message_to(client, kind=protocol.Welcome):
    return next(message for message in client.messages if isinstance(message, kind))


def test_two_people_play_to_the_end_and_the_recording_verifies(table):
    red, blue, watcher = clients = [table.visit() for _ in range(3)]
    cards = {policy.name: policy.card for policy in message_to(red).policies}
    assert cards["uniform"].rating == 1000 < cards["champion"].rating and len(cards["uniform"].target) == 10
    assert message_to(red).records_labels and message_to(red).addresses == [], "this machine alone can reach it"
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
    host.say(protocol.Create(settings=protocol.Settings(time_limit=1.0), opponent="uniform"))
    room = host.hear(protocol.Seated).room
    watcher = table.visit()
    watcher.say(protocol.Join(room))
    watcher.hear(protocol.RoomState)
    host.say(protocol.Leave())  # the program joins this short game instead of its own long one
    snippet = program.replace("127.0.0.1:8000", table.address).replace('opponent="champion"', f'room="{room}"')
    exec(snippet, {})  # noqa: S102
    assert capsys.readouterr().out.strip() in ("red", "blue", "draw")
    for client in (host, watcher):
        client.close()


# --- who comes in ---------------------------------------------------------------------------------


def test_names_that_are_not_served_and_other_protocols_are_kept_out_and_paths_lead_nowhere(table):
    status, headers, text = table.get("/")
    assert status == 200 and "default-src 'none'" in headers["content-security-policy"]
    assert "<script>" not in text and " style=" not in text and "http:" not in text
    for path in ("/", "/static/main.js"):
        assert table.get(path, **{"Accept-Encoding": "gzip"})[1]["content-encoding"] == "gzip"
    assert table.get("/", Host="evil.example")[0] == table.get("/", Origin="http://evil.example")[0] == 403
    with pytest.raises(InvalidStatus):
        table.visit(additional_headers={"Origin": "http://evil.example"})
    with pytest.raises((ConnectionClosed, InvalidStatus)), connect(f"ws://{table.address}/socket") as socket:
        socket.recv(timeout=60)
    for name in ("..%2f..%2fpyproject.toml", "%2e%2e/x.jsonl", "x.jsonl%00", ".jsonl", "a/../b.jsonl", "none.jsonl"):
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


def test_it_tells_its_figures_and_finishes_its_files_when_told_to_end(own_table):
    client = own_table.visit()
    client.play(opponent=None, blue=0, time_limit=None)
    client.say(protocol.CommandMessage(1, strokes=[RING]))
    client.hear(protocol.InForceMessage)
    status = own_table.status()
    assert (status["rooms"], status["playing"], status["connections"]) == (1, 1, 1)
    assert status["open_files"] > 2
    assert "Traceback" not in own_table.end()
    read = Recording.read(own_table.recording(client.seated.room))
    assert read.end.outcome == "stopped" and Playback(read).verify().verified
    client.hear_close()


def test_a_killed_server_loses_a_second_at_most_and_records_no_label_that_nobody_asked_for(tmp_path):
    table = Table(tmp_path, "--opponent", FOLDER)
    client = table.visit()
    assert not message_to(client).records_labels
    for name in ("policies", f"{FOLDER}/../champion"):
        assert client.refused(protocol.Create(opponent=name)).code == "unknown"
    client.say(protocol.Create(settings=protocol.Settings(time_limit=None), opponent=FOLDER, label="<b>&"))
    room = client.hear(protocol.Seated).room
    client.say(protocol.Ready())
    assert client.hear(protocol.RoomState, lambda state: state.phase == "playing").red.label == "<b>&"
    while not client.frames or client.frames[-1].tick < 75:
        client.take()
    table.kill()
    path = table.recording(room)
    read = Recording.read(path)
    assert read.end is None and read.last_tick >= 75 - 30 and read.header.red.label == ""
    assert Playback(read).verify().verified
    path.write_bytes(path.read_bytes()[:-20])
    assert Recording.read(path).last_tick >= 75 - 33
