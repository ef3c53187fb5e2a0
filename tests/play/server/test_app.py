"""The server, over real sockets: seats, games, and everything that hostile or unlucky clients do."""

import contextlib
import math
import re
from pathlib import Path

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from swarm_pz.play import protocol
from swarm_pz.play.client import play
from swarm_pz.play.recordings.format import InForceLine, PaintedLine, Recording, SeatLine
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.policies import zoo
from tests.play.conftest import Table

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

    with waiting_room(table, "ring", red=2, blue=18, time_limit=3.0) as code:
        assert play(table.address, centre, room=code) in ("red", "blue", "draw")


def test_the_program_of_the_documentation_plays_a_game(table, capsys):
    page = (Path(__file__).parents[3] / "docs" / "protocol.md").read_text()
    program, *_ = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert 'opponent="champion"' in program
    with waiting_room(table, "champion", time_limit=5.0) as code:  # a game without end in sight takes its time
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


def test_the_newest_connection_has_the_seat(table):
    old = table.visit()
    old.practise()
    new = table.visit(old.seated.token)
    new.hear(protocol.Seated)
    old.hear(protocol.Displaced)
    assert old.refused(protocol.CommandMessage(1, strokes=[RING])).code == "out_of_turn"
    frames = len(old.frames)
    new.say(protocol.CommandMessage(1, strokes=[RING]))
    new.hear(protocol.InForceMessage)
    with pytest.raises((TimeoutError, ConnectionClosed)):
        old.take(0.2)
    assert len(old.frames) == frames, "nothing more is shown to who was displaced"
    old.close()
    new.close()


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


def test_a_tactic_of_a_folder_is_an_opponent(tmp_path):
    folder = str(Path(zoo.__file__).parent / "hunter")
    table = Table(tmp_path, "--opponent", folder)
    try:
        client = table.visit()
        client.play(opponent=folder, time_limit=None)
        for name in ("policies", f"{folder}/../champion"):
            assert client.refused(protocol.Create(opponent=name)).code == "unknown"
        client.close()
    finally:
        table.end()


def test_another_game_in_the_same_room(table):
    client = table.visit()
    client.play(time_limit=1.0)
    first = client.hear(protocol.RoomState, lambda state: state.phase == "over")
    client.say(protocol.Ready())
    again = client.hear(protocol.RoomState, lambda state: state.phase == "playing")
    assert again.recording != first.recording and again.outcome is None
    client.hear(protocol.RoomState, lambda state: state.phase == "over")
    client.close()


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


def test_what_is_out_of_turn_is_refused(table):
    client, other = table.visit(), table.visit()
    command = protocol.CommandMessage(1, strokes=[RING])
    assert client.refused(command).code == "out_of_turn"
    assert client.refused(protocol.Hello()).code == "out_of_turn"
    assert client.refused(protocol.Seek(3)).code == "out_of_turn"
    assert client.refused(protocol.Join("ZZZZ")).code == "unknown"
    assert client.refused(protocol.Create(opponent="nobody")).code == "unknown"
    client.say(protocol.Create(settings=protocol.Settings(blue=0)))
    code = client.hear(protocol.Seated).room
    assert client.refused(command).code == "out_of_turn", "the game has not begun"
    assert other.refused(protocol.Join(code, "red")).code == "taken"
    assert other.refused(protocol.Join(code, "blue")).code == "not_valid", "that side has no drones"
    other.say(protocol.Join(code))
    other.hear(protocol.RoomState)
    assert other.refused(protocol.Ready()).code == "out_of_turn"
    assert other.refused(protocol.Invite("blue", "ring")).code == "out_of_turn"
    client.close()
    other.close()


def test_who_is_refused_keeps_what_they_have(table):
    client, other = table.visit(), table.visit()
    client.practise()
    other.practise()
    assert client.refused(protocol.Join(other.seated.room, "red")).code == "taken"
    assert client.refused(protocol.Create(settings=protocol.Settings(red=0, blue=5))).code == "not_valid"
    assert client.refused(protocol.Create(opponent="nobody")).code == "unknown"
    assert client.refused(protocol.OpenReplay("none.jsonl")).code == "unknown"
    client.say(protocol.CommandMessage(1, strokes=[RING]))
    assert client.hear(protocol.InForceMessage).number == 1
    client.close()
    other.close()


def test_rooms_that_nobody_can_come_back_to_are_closed(table):
    client, other = table.visit(), table.visit()
    rooms = [client.practise().code for _ in range(5)]
    assert client.refused(protocol.Create(settings=protocol.Settings(red=0))).code == "not_valid"

    def taken(room):
        return other.refused(protocol.Join(room, "red")).code

    assert [taken(room) for room in rooms] == ["unknown"] * 4 + ["taken"]
    client.say(protocol.Leave())
    client.say(protocol.Ping(0.0))
    client.hear(protocol.Pong)
    assert taken(rooms[-1]) == "unknown"
    client.close()
    other.close()


def test_no_game_begins_without_its_players(table):
    red, blue = table.visit(), table.visit()
    red.say(protocol.Create())
    seat = red.hear(protocol.Seated)
    blue.say(protocol.Join(seat.room, "blue"))
    red.say(protocol.Ready())
    blue.hear(protocol.RoomState, lambda state: state.red.ready)
    red.close()
    away = blue.hear(protocol.RoomState, lambda state: not state.red.connected)
    assert not away.red.ready
    blue.say(protocol.Ready())
    assert blue.hear(protocol.RoomState, lambda state: state.blue.ready).phase == "waiting"
    back = table.visit(seat.token)
    back.say(protocol.Ready())
    blue.hear(protocol.RoomState, lambda state: state.phase == "playing")
    back.close()
    blue.close()


def test_two_policies_are_watched(table):
    client = table.visit()
    settings = protocol.Settings(time_limit=1.0)
    assert client.refused(protocol.Create(player="ring")).code == "not_valid"
    assert client.refused(protocol.Create(seat="watch", player="nobody")).code == "unknown"
    client.say(protocol.Create(settings=settings, seat="watch", player="ring", opponent="uniform"))
    state = client.hear(protocol.RoomState)
    assert (state.red.name, state.blue.name, state.phase) == ("ring", "uniform", "waiting")
    for _ in range(2):
        client.say(protocol.Ready())
        client.hear(protocol.RoomState, lambda state: state.phase == "playing")
        assert client.hear(protocol.RoomState, lambda state: state.phase == "over").outcome == "draw"
    assert client.refused(protocol.CommandMessage(1, strokes=[RING])).code == "out_of_turn"
    header = Recording.read(table.recording(state.code)).header
    assert (header.red.policy, header.blue.policy) == ("ring", "uniform")
    client.close()


def test_a_token_that_opens_nothing_is_refused(table):
    client = table.visit("0" * 32)
    client.hear(protocol.Refused)
    client.play()
    client.close()


def test_bad_commands_are_refused_and_the_game_goes_on(table):
    client = table.visit()
    client.practise()
    for density in ([[1.0]], [[2.0] * 10] * 10, [[0.5] * 10] * 9 + [[0.5]]):
        assert client.refused(protocol.CommandMessage(1, density=density)).code == "not_valid"
    wide = protocol.StrokeMessage("attract", 0.9, [(0.5, 0.5)])
    assert "0.05 to 0.3" in client.refused(protocol.CommandMessage(1, strokes=[wide])).reason
    assert client.refused(protocol.CommandMessage(1)).code == "not_valid"
    largest = protocol.CommandMessage(2**32, density=[[0.5] * 10] * 10)
    assert client.refused(largest).code == "malformed"
    for text in ('{"type":"command","number":1,"density":[[NaN]]}', "{", b"\x00\x01", '{"type":"obey"}'):
        assert client.refused(text).code == "malformed"
    client.say(protocol.CommandMessage(2, strokes=[RING]))
    client.hear(protocol.InForceMessage)
    client.close()


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


def test_who_never_stops_is_shown_out(table):
    client = table.visit()
    with contextlib.suppress(ConnectionClosed):
        for _ in range(200):
            client.say("{")
    client.hear_close()
    assert sum(isinstance(message, protocol.Refused) for message in client.messages) <= 100
    assert table.status()["rooms"] >= 0


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
        ({}, True),
        ({"Host": "localhost:{port}"}, True),
        ({"Host": "evil.example:{port}"}, False),
        ({"Host": "127.0.0.1"}, False),
        ({"Origin": "http://127.0.0.1:{port}"}, True),
        ({"Origin": "http://evil.example"}, False),
        ({"Origin": "https://127.0.0.1:{port}"}, False),
        ({"Origin": "null"}, False),
    ],
)
def test_only_names_that_are_served_come_in(table, headers, allowed):
    port = table.address.split(":")[1]
    headers = {name: value.format(port=port) for name, value in headers.items()}
    assert table.get("/", **headers)[0] == (200 if allowed else 403)
    if "Host" in headers:
        return
    if allowed:
        table.visit(additional_headers=headers).close()
    else:
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


def test_labels_are_shown_as_they_are(table):
    client = table.visit()
    client.say(protocol.Create(label="<b>&"))
    state = client.hear(protocol.RoomState)
    assert state.red.label == "<b>&", "the page sets it as text"
    client.close()


# --- the end --------------------------------------------------------------------------------------


def test_when_told_to_end_it_finishes_its_files_and_ends(own_table):
    client = own_table.visit()
    client.play(time_limit=None)
    client.say(protocol.CommandMessage(1, strokes=[RING]))
    client.hear(protocol.InForceMessage)
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


def test_figures_of_the_server(own_table):
    assert own_table.status()["lateness_ms"] is None
    client = own_table.visit()
    client.play()
    while not client.frames or client.frames[-1].tick < 15:
        client.take()
    status = own_table.status()
    assert status["lateness_ms"]["max"] >= status["lateness_ms"]["p99"] >= 0
    assert (status["rooms"], status["playing"], status["connections"]) == (1, 1, 1)
