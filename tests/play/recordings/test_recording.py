"""Recorded games are read, and malformed ones refused."""

import numpy as np
import pytest

from swarm_pz.errors import RecordingError
from swarm_pz.play.frames import Frame, encode_frame
from swarm_pz.play.protocol import (
    MAX_LINE_BYTES,
    SIDES,
    CapturedMessage,
    EndMessage,
    FrameMessage,
    InForceMessage,
    SeatCommand,
)
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from tests.play.recordings.games import CONFIG, header, record

END = EndMessage("draw", 9, (4, 4), 0.0, "time")
BLANK = [[1.0] * 10] * 10


def command(seat, number, tick, density=BLANK):
    return SeatCommand(number, density=density, seat=seat, tick=tick, server_ms=0.0)


def in_force(seat, number, tick):
    return InForceMessage(seat, number, tick, 0.0)


def picture(tick, drones=8):
    """Return a message whose frame shows drones in a row."""
    places = np.stack([np.arange(drones) / 10] * 2, 1)
    teams = (np.arange(drones) >= drones // 2).astype(np.int8)
    frame = Frame(sequence=0, tick=tick, server_ms=0.0, positions=places, velocities=0 * places, teams=teams)
    return FrameMessage(tick, encode_frame(frame))


def of(*log):
    """Return a recording of messages."""
    return Recording("a.jsonl", header(CONFIG, 1, "ring"), list(log))


def test_a_recording_that_breaks_off_is_read_up_to_there(tmp_path):
    record(tmp_path / "a.jsonl", ticks=90)
    whole = (tmp_path / "a.jsonl").read_bytes()
    followed = whole.rindex(b'"in_force"')  # cut here, the last line is a command at the last known tick
    for length in (len(whole) // 3, followed, whole.index(b"\n", followed) + 1, len(whole) - 1):
        (tmp_path / "a.jsonl").write_bytes(whole[:length])
        broken = Recording.read(tmp_path / "a.jsonl")
        assert broken.end is None and Playback(broken).verify().verified


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: b"", "empty"),
        (lambda text: text[text.index(b"\n") + 1 :], "first line"),
        (lambda text: text.replace(b"play.v", b"play.v9", 1), "of protocol 'swarm-pz.play.v9"),
        (lambda text: text.replace(b'"tick":3,', b'"tick":-3,'), "line"),
        (lambda text: b'{"x":' + b"[" * 60_000 + b"\n" + text, "line 1"),
        (lambda text: b'{"x":"' + b"x" * MAX_LINE_BYTES + b'"}\n' + text, "line 1 of .* may have 131072 bytes"),
        (lambda text: b"\n" * 2**20, "line 1"),
        (lambda text: text.replace(b'"seed":1', b'"seed":1,"weather":"fine"', 1), "line 1 of .*weather"),
        (lambda text: text.replace(b'"table":{', b'"table":{"weather":"fine",', 1), "rules that are not known here"),
        (lambda text: text.replace(b'"mapping":"firm"', b'"mapping":' + b"[" * 90 + b"]" * 90, 1), "not known here"),
    ],
)
def test_what_is_no_recording_is_refused(change, message, tmp_path):
    record(tmp_path / "a.jsonl", ticks=30)
    (tmp_path / "a.jsonl").write_bytes(change((tmp_path / "a.jsonl").read_bytes()))
    with pytest.raises(RecordingError, match=message):
        Recording.read(tmp_path / "a.jsonl")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        (CapturedMessage("red", 1, 8), "line 2 of a.jsonl: drone must be below 8"),
        (in_force("blue", 4, 0), "lacks command 4 of blue"),
        (command("blue", 4, 0, [[2.0] * 10] * 10), "command 4 of blue"),
        (FrameMessage(3, b"\1\2\3"), "frame at tick 3 is corrupt"),
        (picture(6, drones=7), "frame at tick 6 has another number of drones"),
        (FrameMessage(9, picture(6).data), "frame at tick 9 shows tick 6"),
    ],
)
def test_messages_that_its_game_cannot_have_are_refused(line, message):
    def read_all(*log):
        recording = of(*log)
        return Playback(recording), list(recording.frames())

    read_all(CapturedMessage("red", 1, 7), picture(3))
    with pytest.raises(RecordingError, match=message):
        read_all(line)


@pytest.mark.parametrize("line", [FrameMessage(9, b""), in_force("red", 1, 9), END])
def test_the_last_message_says_how_long_a_game_was(line):
    assert of(FrameMessage(6, b""), line).last_tick == 9


def test_a_client_that_counts_from_the_start_again_is_followed_in_order():
    corners = [np.eye(1, 100, place).reshape(10, 10).tolist() for place in range(4)]
    log = []
    for place, (seat, number) in enumerate([("red", 1), ("blue", 1), ("red", 1), ("blue", 2)]):
        log += [command(seat, number, 30 * place, corners[place]), in_force(seat, number, 30 * place)]
    assert [(tick, SIDES[command.team], command.values.tolist()) for tick, command in of(*log).in_force()] == [
        (30 * place, SIDES[place % 2], corners[place]) for place in range(4)
    ]
