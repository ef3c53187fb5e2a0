"""Forged and damaged recordings: none verifies, and the fault is named."""

import base64
import copy
import itertools

import numpy as np
import pytest

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.errors import RecordingError
from swarm_pz.play import protocol
from swarm_pz.play.game import TableConfig
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from tests.play.recordings.games import plain_lines, record, write_lines

CALM = TableConfig(game=GameConfig(drones_per_team=3, time_limit=2.0, capture=CaptureConfig(enabled=False)))
STROKE = protocol.StrokeMessage("attract", 0.1, [(0.5, 0.25), (0.7, 0.75)])


@pytest.fixture(scope="module")
def played(tmp_path_factory):
    """Give the file of a whole game: a person who draws three times, against a policy."""
    path = tmp_path_factory.mktemp("games") / "honest.jsonl"
    record(path, config=CALM, both=True, every=20, strokes=[STROKE])
    assert fault_of(path) == "", "an honest game verifies"
    return path


def fault_of(path):
    """Return the faults of a recording; empty if it verifies."""
    try:
        result = Playback(Recording.read(path)).verify()
    except RecordingError as error:
        return str(error)
    if result.verified and result.finished:
        return ""
    unfinished = "" if result.finished else "unfinished"
    return f"{result.faults} differs at {result.first_difference} {unfinished}"


def place_of(lines, kind, nth=0, **fields):
    """Return the index of the nth line of a kind."""
    fits = [i for i, line in enumerate(lines) if line["type"] == kind and fields.items() <= line.items()]
    return fits[nth]


# --- damaged files --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("damage", "named"),
    [
        (lambda lines: lines[:-1], "unfinished"),
        (lambda lines: [*lines[:9], lines[9][: len(lines[9]) // 2], *lines[10:]], "line 10 of"),
        (lambda lines: [line for line in lines if b'"tick":30' not in line], "differs at 30"),
        (lambda lines: [*lines, lines[-1]], "comes after the game's end"),
    ],
)
def test_lines_that_are_cut_doubled_or_torn_are_named(damage, named, played, tmp_path):
    (tmp_path / "a.jsonl").write_bytes(b"\n".join([*damage(played.read_bytes().splitlines()), b""]))
    assert named in fault_of(tmp_path / "a.jsonl")


# --- forged lines ---------------------------------------------------------------------------------


def changed(kind, nth=0, *, of=None, **values):
    """Return a forgery that changes fields of a line."""

    def forge(lines):
        lines[place_of(lines, kind, nth, **(of or {}))].update(values)
        return lines

    return forge


def most_frames_dropped(lines):
    counted = itertools.count()
    return [line for line in lines if line["type"] != "frame" or next(counted) % 10 == 0]


def with_line(line, kind, nth=0, **of):
    """Return a forgery that inserts a line before another."""

    def forge(lines):
        lines.insert(place_of(lines, kind, nth, **of), line)
        return lines

    return forge


def in_force_dropped(lines):
    del lines[place_of(lines, "in_force", -1, seat="red")]
    return lines


AWAY = {"type": "seat", "seat": "red", "event": "disconnected", "server_ms": 1.0}
CAPTURE = {"type": "captured", "seat": "blue", "tick": 30, "drone": 0}


@pytest.mark.parametrize(
    ("forge", "named"),
    [
        (changed("end", outcome="red"), "draw"),
        (changed("end", outcome="stopped", ended_by="server"), "draw"),
        (changed("end", ended_by="capture"), "ended by 'time', not by 'capture'"),
        (changed("end", sizes=[6, 0]), "3 to 3"),
        (changed("end", tick=61), "to 60, the game's time limit"),
        (changed("game", seed=2), "differs at 0"),
        (most_frames_dropped, "differs at 3"),
        (in_force_dropped, "command 3 of red had to come into force"),
        (changed("in_force", -1, of={"seat": "red"}, number=2), "command 3 of red had to come into force"),
        (changed("command", 0, of={"seat": "red"}, density=np.eye(10).tolist()), "differs at"),
        (changed("command", 2, of={"seat": "red"}, tick=2), "tick must be"),
        (with_line(CAPTURE, "frame", 10), "differs at 30"),
        (with_line(AWAY | {"server_ms": 9e9}, "end"), "ended by 'left'"),
    ],
)
def test_what_does_not_follow_from_commands_and_start_is_named(forge, named, played, tmp_path):
    lines = plain_lines(played)
    forged = forge(copy.deepcopy(lines))
    assert forged != lines
    write_lines(tmp_path / "a.jsonl", forged)
    assert named in fault_of(tmp_path / "a.jsonl")


def leaves(value, path=()):
    """Yield the paths of numbers in nested plain values."""
    for key, entry in value.items() if isinstance(value, dict) else enumerate(value):
        if isinstance(entry, dict | list):
            yield from leaves(entry, (*path, key))
        elif isinstance(entry, int | float) and not isinstance(entry, bool):
            yield (*path, key)


@pytest.mark.parametrize("number", [-1, 0, 1e-9, 200, 1e9, 10**400, "x", [[]]])
def test_rules_that_were_forged_crash_nothing(number, played, tmp_path):
    """Legal rules are simulated; all others raise a RecordingError, which names the file."""
    lines = plain_lines(played)
    for *path, last in leaves(lines[0]["table"]):
        forged = copy.deepcopy(lines)
        place = forged[0]["table"]
        for key in path:
            place = place[key]
        place[last] = number
        write_lines(tmp_path / "a.jsonl", forged)
        fault = fault_of(tmp_path / "a.jsonl")
        assert not fault or "a.jsonl" in fault or "differs at" in fault or "line " in fault, (path, last, fault)


@pytest.mark.parametrize(
    ("kind", "change"),
    [
        ("game", {"seed": -1}),
        ("game", {"table": []}),
        ("command", {"density": [[1.0] * 4000] * 20}),
        ("command", {"density": [[float("nan")] * 10] * 10}),
        ("command", {"command": [[1.0] * 10] * 10}),
        ("command", {"number": 2**32}),
        ("in_force", {"tick": 2**32 - 1}),
        ("frame", {"data": "\ud800"}),
        ("frame", {"data": base64.b64encode(b"\1" + b"\xff" * 100).decode()}),
        ("end", {"tick": 2**32 - 1}),
    ],
)
def test_values_that_no_game_has_are_named_with_their_file(kind, change, played, tmp_path):
    lines = plain_lines(played)
    lines[place_of(lines, kind)].update(change)
    write_lines(tmp_path / "a.jsonl", lines)
    assert "a.jsonl" in fault_of(tmp_path / "a.jsonl")


def test_a_robots_game_verifies_by_its_poses_and_not_by_others(tmp_path):
    path = tmp_path / "robots.jsonl"
    record(path, ticks=240, robots=True)
    recording = Recording.read(path)
    assert recording.of(protocol.CapturedMessage), "or it proves little"
    assert fault_of(path) == ""
    playback = Playback(recording)
    for tick in (100, 31):
        playback.seek(tick)
        poses = recording.poses[tick - 1]
        shown = playback.game.simulator.positions[0]
        np.testing.assert_array_equal(shown[~np.isnan(poses[:, 0])], poses[~np.isnan(poses[:, 0]), :2])
    lines = plain_lines(path)
    moved = lines[place_of(lines, "poses", tick=50)]
    poses = np.abs(recording.poses[50] - np.float32(0.001))
    for data, named in ((poses.tobytes(), "differs at 51"), (poses[:2].tobytes(), "poses at tick 50 must be of 8")):
        moved["data"] = base64.b64encode(data).decode()
        write_lines(path, lines)
        assert named in fault_of(path)
