"""The server, over real sockets: seats, games, and everything that hostile or unlucky clients do."""

import contextlib
import json
import math
import re
import urllib.parse
from pathlib import Path

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from swarm_pz.play import protocol
from swarm_pz.play.client import play
from swarm_pz.play.recordings.format import InForceLine, PaintedLine, Recording, SeatLine
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.server import app
from swarm_pz.policies import zoo
from tests.play.conftest import Table

FOLDER = str(Path(zoo.__file__).parent / "hunter")
RING = protocol.StrokeMessage(
    "attract", 0.1, [(0.5 + 0.2 * math.cos(a / 6), 0.5 + 0.2 * math.sin(a / 6)) for a in range(38)]
)


def in_room(room, phase):
    return lambda state: state.code == room and state.phase == phase


# --- games ----------------------------------------------------------------------------------------


def test_two_people_play_to_the_end_and_the_recording_verifies(table):
    red, blue, watcher = table.visit(), table.visit(), table.visit()
    red.say(protocol.Create(settings=protocol.Settings(red=3, blue=3, time_limit=2.0), label="P7"))
    seat = red.hear(protocol.Seated)
    blue.say(protocol.Join(seat.room, "blue"))
    blue.hear(protocol.Seated)
    watcher.say(protocol.Join(seat.room))
    red.say(protocol.Ready())
    waiting = blue.hear(protocol.RoomState, lambda state: state.red.ready)
    assert waiting.phase == "waiting" and not blue.frames, "the clock starts when both are ready"
    blue.say(protocol.Ready())
    red.hear(protocol.RoomState, in_room(seat.room, "playing"))
    timing = protocol.Timing(input_ms=10.0, sent_ms=12.0, offset_ms=5.0, round_trip_ms=1.0, drawing_ms=400.0)
    red.say(protocol.CommandMessage(1, strokes=[RING], timing=timing))
    blue.say(protocol.CommandMessage(1, density=np.eye(10).tolist()))
    received = red.hear(protocol.Received)
    assert received.number == 1
    in_force = red.hear(protocol.InForceMessage)
    assert in_force.number == 1 and in_force.tick % 3 == 0
    red.say(protocol.Painted(1, in_force.server_ms + 20.0))
    over = red.hear(protocol.RoomState, in_room(seat.room, "over"))
    assert over.outcome in ("red", "blue", "draw") and over.recording is not None
    watcher.hear(protocol.RoomState, in_room(seat.room, "over"))
    blue.hear(protocol.RoomState, in_room(seat.room, "over"))
    assert len(watcher.frames) <= 13 < len(red.frames), "who does not answer is sent a handful"
    assert [frame.tick for frame in red.frames] == sorted(frame.tick for frame in red.frames)
    assert not watcher.targets, "a target is for its own side alone"
    assert len(red.targets) == 2 and red.targets[-1][1] == 0

    recording = Recording.read(table.folder / over.recording)
    assert Playback(recording).verify().verified
    assert recording.header.red.label == "P7" and recording.header.blue.kind == "person"
    command = next(line for line in recording.events if getattr(line, "strokes", None))
    assert command.strokes == [RING] and command.timing == timing
    assert any(line.ms > 0 for line in recording.of(PaintedLine))
    assert {line.team for line in recording.of(InForceLine)} == {0, 1}
    assert recording.end.outcome == over.outcome
    for client in (red, blue, watcher):
        client.close()


@contextlib.contextmanager
def waiting_room(table, opponent, **settings):
    """Give the code of a room with a policy in blue's seat and nobody in red's; somebody watches."""
    host, watcher = table.visit(), table.visit()
    host.say(protocol.Create(settings=protocol.Settings(**settings), opponent=opponent))
    code = host.hear(protocol.Seated).room
    watcher.say(protocol.Join(code))
    watcher.hear(protocol.RoomState)
    host.say(protocol.Leave())
    yield code
    host.close()
    watcher.close()


def test_a_program_of_few_lines_plays_a_game(table):
    def centre(frame, team):
        x = (np.arange(10) + 0.5) / 10
        return np.exp(-((x - 0.5) ** 2 + (x[:, None] - 0.5) ** 2) / 0.02)

    with waiting_room(table, "ring", red=2, blue=18, time_limit=2.0) as code:
        assert play(table.address, centre, room=code) in ("red", "blue", "draw")


def test_the_program_of_the_documentation_plays_a_game(table, capsys):
    page = (Path(__file__).parents[3] / "docs" / "protocol.md").read_text()
    program, *_ = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert 'opponent="champion"' in program
    with waiting_room(table, "champion", time_limit=3.0) as code:  # a game without end in sight takes its time
        here = program.replace("127.0.0.1:8000", table.address).replace('opponent="champion"', f'room="{code}"')
        exec(here, {})  # noqa: S102
    assert capsys.readouterr().out.strip() in ("red", "blue", "draw")


def test_a_lost_connection_comes_back_to_its_seat_and_its_game(table):
    client = table.visit()
    client.practise()
    client.say(protocol.CommandMessage(1, strokes=[RING]))
    client.hear(protocol.InForceMessage)
    client.close()
    again = table.visit(client.seated.token)
    seat = again.hear(protocol.Seated)
    assert (seat.room, seat.seat) == (client.seated.room, "red")
    state = again.hear(protocol.RoomState)
    assert state.phase == "playing" and state.red.connected and state.sizes
    while not (again.frames and again.targets):
        again.take()
    assert again.frames[0].altitudes is not None, "a keyframe comes first"
    assert again.targets[0] == client.targets[-1], "the swarm has gone on with its last command"
    while len(again.frames) < 30:
        again.take()  # what is written is in the file after half a second
    assert state.recording is None, "what a player draws is not for others while they play"
    assert again.refused(protocol.OpenReplay(table.recording(seat.room).name)).code == "unknown"
    recording = Recording.read(table.recording(seat.room))
    assert [line.event for line in recording.of(SeatLine)] == ["connected", "disconnected", "connected"]
    again.close()


def test_handicaps_practice_and_games_without_limit(table):
    handicap, practice = table.visit(), table.visit()
    assert handicap.play(red=1, blue=19, time_limit=None).settings.time_limit is None
    while not handicap.frames:
        handicap.take()
    assert handicap.frames[0].teams.tolist() == [0] + [1] * 19
    practice.say(protocol.Create(settings=protocol.Settings(red=10, blue=0)))
    practice.say(protocol.Ready())
    practice.hear(protocol.RoomState, lambda state: state.phase == "playing")
    while sum(frame.fields is not None for frame in practice.frames) < 5:
        practice.take()
    shown = [frame for frame in practice.frames if frame.fields is not None][-1]
    assert shown.fields[0].any() and not shown.fields[1].any() and not shown.teams.any()
    handicap.close()
    practice.close()


@pytest.fixture(scope="module")
def plain_table(tmp_path_factory):
    """Give a server that records no labels, with a tactic of a folder."""
    table = Table(tmp_path_factory.mktemp("plain"), "--opponent", FOLDER)
    yield table
    table.end()


def test_a_tactic_of_a_folder_is_an_opponent(plain_table):
    client = plain_table.visit()
    client.play(opponent=FOLDER, time_limit=None)
    for name in ("policies", f"{FOLDER}/../champion"):
        assert client.refused(protocol.Create(opponent=name)).code == "unknown"
    client.close()


def test_labels_are_seen_at_the_table_and_recorded_only_if_the_host_says_so(table, plain_table):
    for server, is_recorded in ((plain_table, False), (table, True)):
        client = server.visit()
        welcome = next(message for message in client.messages if isinstance(message, protocol.Welcome))
        assert welcome.records_labels == is_recorded and welcome.addresses == [], "this machine alone can reach it"
        client.say(protocol.Create(settings=protocol.Settings(blue=0, time_limit=None), label="<b>&"))
        room = client.hear(protocol.Seated).room
        assert client.hear(protocol.RoomState).red.label == "<b>&", "the page sets it as text"
        client.say(protocol.Ready())
        client.hear(protocol.RoomState, lambda state: state.phase == "playing")
        client.close()
        assert Recording.read(server.recording(room)).header.red.label == ("<b>&" if is_recorded else "")


def test_a_recorded_game_is_watched_and_taken_over(table):
    client = table.visit()
    client.play(time_limit=4.0)
    client.say(protocol.CommandMessage(1, strokes=[RING]))
    recording = client.hear(protocol.RoomState, lambda state: state.phase == "over").recording
    frames = {frame.tick: frame for frame in client.frames}
    tick = min(frames, key=lambda tick: abs(tick - 60))  # a client that is behind is not sent all of them
    client.say(protocol.OpenReplay(recording))
    state = client.hear(protocol.RoomState, lambda state: state.phase == "replay")
    assert state.verified and state.recording == recording and len(state.sizes) > 1
    client.say(protocol.Pace(0))
    client.say(protocol.Seek(tick))
    while client.frames[-1].tick != tick:
        client.take()
    np.testing.assert_array_equal(client.frames[-1].positions, frames[tick].positions)
    client.say(protocol.TakeOver("blue"))
    seat = client.hear(protocol.Seated)
    assert seat.seat == "blue"
    client.say(protocol.Invite("red", "uniform"))
    client.say(protocol.Ready())
    playing = client.hear(protocol.RoomState, lambda state: state.phase == "playing")
    assert playing.sizes == state.sizes[: tick // 30 + 1], "one at the start and after each second"
    over = client.hear(protocol.RoomState, lambda state: state.phase == "over")
    taken = Recording.read(table.folder / over.recording)
    assert (taken.header.origin.recording, taken.header.origin.tick) == (recording, tick)
    assert Playback(taken).verify().verified and taken.last_tick > tick
    assert len(over.sizes) == taken.last_tick // 30 + 1
    client.close()


# --- refusals -------------------------------------------------------------------------------------


def test_floods_and_floods_of_bytes_are_for_their_sender_alone(table):
    peaceful, flooding, oversized = table.visit(), table.visit(), table.visit()
    peaceful.practise()
    for number in range(60):
        flooding.say(protocol.Ping(number))
    codes = [flooding.hear(protocol.Refused).code for _ in range(20)]
    assert set(codes) == {"too_many"}
    oversized.say('{"type":"hello","x":"' + "x" * 70_000 + '"}')
    oversized.hear_close()
    peaceful.frames.clear()
    while len(peaceful.frames) < 30:
        peaceful.take()
    assert not any(isinstance(message, protocol.Refused) for message in peaceful.messages)
    assert (np.diff([frame.tick for frame in peaceful.frames]) > 0).all(), "its game goes on"
    for client in (peaceful, flooding):
        client.close()


def test_a_slow_client_is_sent_fresh_frames_only(table):
    client, watcher = table.visit(), table.visit()
    watcher.say(protocol.Join(client.practise().code))

    def watch(tick):
        while not watcher.frames or watcher.frames[-1].tick < tick:
            watcher.take()
        return watcher.frames[-1].tick

    silent = []
    watch(60)
    with contextlib.suppress(TimeoutError):
        while True:  # frames are received, and not acknowledged
            data = client.socket.recv(timeout=1.0)
            if not isinstance(data, str) and data[0] == 1:
                silent.append(data)
    assert 10 <= len(silent) <= 30
    last = protocol.Acknowledge(int.from_bytes(silent[-1][4:8], "little"))
    before = int.from_bytes(silent[-1][8:12], "little")
    shown = watch(before + 31)
    client.frames.clear()
    client.say(last)
    while not client.frames:
        client.take()
    assert client.frames[-1].tick >= shown, "what was missed is not made up for"
    client.close()
    watcher.close()


# --- who comes in ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("headers", "allowed"),
    [
        ({"Host": "localhost:{port}"}, True),
        ({"Host": "evil.example:{port}"}, False),
        ({"Origin": "http://127.0.0.1:{port}"}, True),
        ({"Origin": "http://evil.example"}, False),
    ],
)
def test_only_names_that_are_served_come_in(table, headers, allowed):
    headers = {name: value.format(port=table.address.split(":")[1]) for name, value in headers.items()}
    assert table.get("/", **headers)[0] == (200 if allowed else 403)
    if "Origin" in headers and not allowed:
        with pytest.raises(InvalidStatus):
            table.visit(additional_headers=headers)


def test_another_protocol_is_not_spoken(table):
    with pytest.raises((ConnectionClosed, InvalidStatus)), connect(f"ws://{table.address}/socket") as socket:
        socket.recv(timeout=5)


def test_pages_carry_a_strict_policy(table):
    status, headers, text = table.get("/")
    policy = headers["content-security-policy"]
    assert status == 200 and "default-src 'none'" in policy and "unsafe" not in policy
    assert "<script>" not in text and " style=" not in text and "http:" not in text


@pytest.mark.parametrize(
    "name", ["..%2f..%2fpyproject.toml", "%2e%2e/x.jsonl", "x.jsonl%00", ".jsonl", "a/../b.jsonl", "missing.jsonl"]
)
def test_paths_lead_nowhere(table, name):
    assert table.get(f"/recordings/{name}")[0] == 404
    assert table.get(f"/static/{name}")[0] == 404
    client = table.visit()
    assert client.refused(protocol.OpenReplay(name)).code == "unknown"
    client.close()


# --- invitations and recordings -------------------------------------------------------------------


def test_an_invitation_is_drawn_once_for_rooms_and_addresses_of_this_table_and_no_others(table):
    client = table.visit()
    client.say(protocol.Create())
    room = client.hear(protocol.Seated).room

    def drawn(room, at):
        return table.get(f"/invitations/{room}.svg?at={urllib.parse.quote(at)}")

    status, headers, text = drawn(room, f"http://{table.address}/")
    assert status == 200 and headers["content-type"].startswith("image/svg+xml") and "<path" in text
    assert drawn(room, f"https://{table.address}/")[0] == 200, "behind a proxy"
    assert drawn("ZZZZ", f"http://{table.address}/")[0] == 404
    assert drawn(room, "http://elsewhere.example/")[0] == drawn(room, "")[0] == 404
    client.close()
    picture = app._picture_of("http://here/#room=QRQR")
    assert app._picture_of("http://here/#room=QRQR") is picture, "all games wait for it"


def test_who_comes_is_told_how_good_policies_are(table):
    client = table.visit()
    (welcome,) = [message for message in client.messages if isinstance(message, protocol.Welcome)]
    cards = {policy.name: policy.card for policy in welcome.policies}
    assert cards["uniform"].rating == 1000 < cards["champion"].rating
    assert len(cards["uniform"].target) == 10 and cards["uniform"].drones
    client.close()


# --- the end --------------------------------------------------------------------------------------


def test_it_tells_its_figures_and_recordings_and_finishes_its_files_when_told_to_end(own_table):
    assert own_table.status()["lateness_ms"] is None
    names = [f"2026010{day}T000000Z-ABCD-1.jsonl" for day in (1, 2)]
    for name in [*names, "notes.txt"]:
        (own_table.folder / name).write_text("{}\n")
    client = own_table.visit()
    client.play(time_limit=None)
    client.say(protocol.CommandMessage(1, strokes=[RING]))
    client.hear(protocol.InForceMessage)
    status = own_table.status()
    assert status["lateness_ms"]["max"] >= status["lateness_ms"]["p99"] >= 0
    assert (status["rooms"], status["playing"], status["connections"]) == (1, 1, 1)
    listed = json.loads(own_table.get("/recordings")[2])
    assert [game["name"] for game in listed] == names[::-1], "the latest first, and none that is being played"
    assert "Traceback" not in own_table.end()
    read = Recording.read(own_table.recording(client.seated.room))
    assert read.end.outcome == "stopped" and Playback(read).verify().verified
    client.hear_close()


def test_a_killed_server_loses_a_second_at_most(own_table):
    client = own_table.visit()
    client.play(time_limit=None)
    while not client.frames or client.frames[-1].tick < 75:
        client.take()
    own_table.kill()
    path = own_table.recording(client.seated.room)
    read = Recording.read(path)
    assert read.end is None and read.last_tick >= 75 - 30
    assert Playback(read).verify().verified
    path.write_bytes(path.read_bytes()[:-20])
    assert Recording.read(path).last_tick >= 75 - 33
