"""A recorded game as MCAP, read by the format's own reader."""

from __future__ import annotations

import math
from collections import defaultdict

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from swarm_pz.config import TEAM_NAMES
from swarm_pz.errors import OutputError
from swarm_pz.play.recordings.format import CapturedLine, Recording
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.ros import mcap, messages
from tests.play.recordings.test_format import plain_lines, record, write_chained


@pytest.fixture(scope="module")
def read(tmp_path_factory):
    """Give a recording, and its messages by topic: pairs of nanoseconds and message."""
    folder = tmp_path_factory.mktemp("mcap")
    record(folder / "a.jsonl", ticks=600, seed=3)
    count, found, types = mcap.write(folder / "a.jsonl", folder / "a.mcap"), defaultdict(list), {}
    with (folder / "a.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            found[channel.topic].append((message.log_time, decoded))
            types[channel.topic] = schema.name
    assert sum(map(len, found.values())) == count
    told = {topic: kind.replace("/", "/msg/", 1) for topic, kind in messages.TOPICS.items()}
    assert set(found) == set(told) - {"/red_ck_plot", "/blue_ck_plot", "/rosout"} and types.items() <= told.items()
    return Recording.read(folder / "a.jsonl"), found


def test_drones_are_where_the_recorded_frames_have_them_and_turned_to_where_they_fly(read):
    recording, found = read
    frames = list(recording.frames())
    for team, name in enumerate(TEAM_NAMES):
        told = found[f"/swarm/{name}/poses"]
        assert len(told) == len(frames) > 100
        for (nanoseconds, message), frame in zip(told, frames, strict=True):
            assert nanoseconds == frame.tick * 10**9 // 30
            assert message.header.frame_id == "map"
            assert message.header.stamp.sec * 10**9 + message.header.stamp.nanosec == nanoseconds
            places = [(pose.position.x, pose.position.y) for pose in message.poses]
            assert places == [tuple(place) for place in frame.positions[frame.teams == team].tolist()]
    for (_, message), frame in zip(found["/tf"], frames, strict=True):
        for drone, one in enumerate(message.transforms):
            assert one.child_frame_id == f"agent{drone}"
            angle = 2 * math.atan2(one.transform.rotation.z, one.transform.rotation.w)
            x, y = frame.velocities[drone]
            assert math.isclose(math.cos(angle - math.atan2(y, x)), 1.0, abs_tol=1e-9)


def test_captures_and_sizes_are_told(read):
    recording, found = read
    frames = list(recording.frames())
    first = [f"agent{drone} {TEAM_NAMES[team]}" for drone, team in enumerate(frames[0].teams)]
    captured = [f"agent{line.drone} {TEAM_NAMES[line.team]}" for line in recording.of(CapturedLine)]
    assert captured, "or this game shows nothing"
    assert [message.data for _, message in found["/agent_team_status"]] == first + captured
    times = [nanoseconds for nanoseconds, _ in found["/agent_team_status"][len(first) :]]
    assert times == [line.tick * 10**9 // 30 for line in recording.of(CapturedLine)]
    for (_, message), frame in zip(found["/swarm/sizes"], frames, strict=True):
        assert list(message.data) == [int((frame.teams == team).sum()) for team in (0, 1)]


def test_the_capture_that_ends_a_game_is_told(tmp_path):
    record(tmp_path / "a.jsonl", ticks=30)
    *lines, end = plain_lines(tmp_path / "a.jsonl")
    write_chained(tmp_path / "a.jsonl", [*lines, {"type": "captured", "tick": end["tick"], "drone": 3, "team": 1}, end])
    recording = Recording.read(tmp_path / "a.jsonl")
    told = [(tick, message["data"]) for tick, topic, message in mcap.told(recording) if topic == "/agent_team_status"]
    assert told[-1] == (end["tick"], "agent3 blue")


def test_fields_say_where_they_capture_and_targets_where_to(read):
    recording, found = read
    playback = Playback(recording)
    for place, frame in enumerate(recording.frames()):
        playback.seek(frame.tick)
        for team, name in enumerate(TEAM_NAMES):
            field = found[f"/swarm/{name}/capture_field"][place][1]
            shown = np.array(field.data).reshape(50, 50)
            np.testing.assert_array_equal(shown > 75, playback.game.simulator.captures_here[0, team])
            target = found[f"/{name}_team_target_dist"][place][1]
            density = playback.game.simulator.targets[0, team]
            np.testing.assert_allclose(np.array(target.data).reshape(10, 10), 100 * density / density.max(), atol=0.51)


def test_a_file_is_whole_or_not_there(tmp_path, monkeypatch):
    record(tmp_path / "a.jsonl", ticks=30)
    with pytest.raises(OutputError, match=r"\.mcap"):
        mcap.write(tmp_path / "a.jsonl", tmp_path / "a.bag")
    monkeypatch.setattr(mcap, "told", lambda _: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        mcap.write(tmp_path / "a.jsonl", tmp_path / "a.mcap")
    assert [path.name for path in tmp_path.iterdir()] == ["a.jsonl"]
