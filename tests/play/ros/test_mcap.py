"""A recorded game as MCAP, read with the official reader and only the message definitions in the file."""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from swarm_pz.config import TEAM_NAMES
from swarm_pz.errors import OutputError
from swarm_pz.play.protocol import CapturedMessage
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from swarm_pz.play.ros import mcap, messages
from tests.play.recordings.games import plain_lines, record, write_lines


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    """Give a recording, and its messages by topic: pairs of nanoseconds and message."""
    folder = tmp_path_factory.mktemp("mcap")
    record(folder / "a.jsonl", ticks=330, seed=4)
    recording, by_topic, stores = Recording.read(folder / "a.jsonl"), defaultdict(list), {}
    count, originals = mcap.write(recording, folder / "a.mcap"), mcap.messages_of(recording)
    with (folder / "a.mcap").open("rb") as file:
        for place, (schema, channel, message) in enumerate(make_reader(file).iter_messages()):
            kind, store = schema.name, stores.setdefault(schema.name, get_typestore(Stores.EMPTY))
            if kind not in store.types:
                store.register(get_types_from_msg(schema.data.decode(), kind))
            decoded = store.deserialize_cdr(message.data, kind)
            by_topic[channel.topic].append((message.log_time, decoded))
            if place < 100:
                _, topic, original = next(originals)
                assert (channel.topic, kind) == (topic, messages.TOPICS[topic].replace("/", "/msg/"))
                check_same(decoded, original)
    assert sum(map(len, by_topic.values())) == count and set(by_topic) == set(messages.TOPICS) - {"/rosout"}
    return recording, by_topic


def check_same(decoded, original):
    """Check that a decoded message equals the original, with numbers to float32 precision."""
    if isinstance(original, dict):
        for name, value in original.items():
            check_same(getattr(decoded, name), value)
    elif isinstance(original, list) and original and isinstance(original[0], dict):
        for pair in zip(decoded, original, strict=True):
            check_same(*pair)
    elif isinstance(original, list | float):
        np.testing.assert_allclose(decoded, original, rtol=1e-7)
    else:
        assert decoded == original


def test_every_moment_is_told_as_the_recording_has_it(read):
    recording, by_topic = read
    frames, playback = list(recording.frames()), Playback(recording)
    assert len(frames) > 100
    for place, frame in enumerate(frames):
        playback.seek(frame.tick)
        of = {topic: pairs[place] for topic, pairs in by_topic.items() if topic != "/agent_team_status"}
        assert {time for time, _ in of.values()} == {frame.tick * 10**9 // 30}
        of = {topic: message for topic, (_, message) in of.items()}
        assert list(of["/swarm/sizes"].data) == [int((frame.teams == team).sum()) for team in (0, 1)]
        for drone, one in enumerate(of["/tf"].transforms):
            assert one.child_frame_id == f"agent{drone}"
            assert one.transform.translation.z == playback.game.simulator.altitudes[0, drone]
            angle = 2 * math.atan2(one.transform.rotation.z, one.transform.rotation.w)
            x, y = frame.velocities[drone]
            assert math.isclose(math.cos(angle - math.atan2(y, x)), 1.0, abs_tol=1e-9)
        for team, name in enumerate(TEAM_NAMES):
            poses = of[f"/swarm/{name}/poses"]
            assert poses.header.frame_id == "map"
            assert poses.header.stamp.sec * 10**9 + poses.header.stamp.nanosec == frame.tick * 10**9 // 30
            places = [(pose.position.x, pose.position.y) for pose in poses.poses]
            assert places == [tuple(place) for place in frame.positions[frame.teams == team].tolist()]
            field = np.array(of[f"/swarm/{name}/capture_field"].data).reshape(50, 50)
            np.testing.assert_array_equal(field > 75, playback.game.simulator.captures_here[0, team])
            density = playback.game.simulator.targets[0, team]
            target = np.array(of[f"/{name}_team_target_dist"].data).reshape(10, 10)
            np.testing.assert_allclose(target, 100 * density / density.max(), atol=0.51)


def test_captures_are_told_when_they_happen(read):
    recording, by_topic = read
    statuses = [(time, message.data) for time, message in by_topic["/agent_team_status"]]
    first = next(recording.frames())
    captured = recording.of(CapturedMessage)
    assert captured, "or this game shows nothing"
    assert statuses == [
        *((0, f"agent{drone} {TEAM_NAMES[team]}") for drone, team in enumerate(first.teams)),
        *((line.tick * 10**9 // 30, f"agent{line.drone} {TEAM_NAMES[line.team]}") for line in captured),
    ]


def test_the_capture_that_ends_a_game_is_told(tmp_path):
    record(tmp_path / "a.jsonl", ticks=30)
    *lines, end = plain_lines(tmp_path / "a.jsonl")
    write_lines(
        tmp_path / "a.jsonl", [*lines, {"type": "captured", "seat": "blue", "tick": end["tick"], "drone": 3}, end]
    )
    recording = Recording.read(tmp_path / "a.jsonl")
    statuses = [
        (tick, message["data"]) for tick, topic, message in mcap.messages_of(recording) if topic == "/agent_team_status"
    ]
    assert statuses[-1] == (end["tick"], "agent3 blue")


def test_a_file_is_whole_or_not_there(tmp_path, monkeypatch):
    record(tmp_path / "a.jsonl", ticks=30)
    with pytest.raises(OutputError, match=r"\.mcap"):
        mcap.write(Recording.read(tmp_path / "a.jsonl"), tmp_path / "a.bag")
    monkeypatch.setattr(mcap, "messages_of", lambda _: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        mcap.write(Recording.read(tmp_path / "a.jsonl"), tmp_path / "a.mcap")
    assert [path.name for path in tmp_path.iterdir()] == ["a.jsonl"]
