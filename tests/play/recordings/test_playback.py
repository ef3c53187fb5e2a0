"""A recorded game played again: what tells that it comes out as recorded, and what a film of it shows."""

import contextlib
import itertools
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from swarm_pz.config import CaptureConfig
from swarm_pz.errors import RecordingError
from swarm_pz.play.frames import FASTEST, encode_frame
from swarm_pz.play.recordings import playback as module
from swarm_pz.play.recordings.format import CapturedLine, FrameLine, Recording, frame_line
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.simulator import Simulator
from tests.play.recordings.test_format import CONFIG, record

CALM = CONFIG.replace(game=CONFIG.game.replace(capture=CaptureConfig(enabled=False)))
"""Nobody is captured, so that every change is the one that was made."""


def nudged(values, by):
    values = values.copy()
    values[2, 1] += by
    return values


@pytest.mark.parametrize(
    "change",
    [
        lambda frame: {"positions": nudged(frame.positions, 2 / 65535)},
        lambda frame: {"velocities": nudged(frame.velocities, 2 * FASTEST / 32767)},
        lambda frame: {"teams": 1 - frame.teams},
    ],
)
def test_a_frame_that_shows_anything_else_is_the_first_difference(change, tmp_path):
    record(tmp_path / "a.jsonl", ticks=90, config=CALM)
    recording = Recording.read(tmp_path / "a.jsonl")
    assert Playback(recording).verify().verified
    for place, frame in enumerate(recording.frames()):
        if frame.tick == 60:
            other = replace(frame, **change(frame))
            at = [i for i, line in enumerate(recording.events) if isinstance(line, FrameLine)][place]
    recording.events[at] = frame_line(encode_frame(other), 60)
    verification = Playback(recording).verify()
    assert not verification.verified and verification.first_difference == other.tick
    assert verification.frames == 21
    recording.events[at] = frame_line(encode_frame(replace(other, tick=59)), 60)
    with pytest.raises(RecordingError, match="frame at tick 60 shows tick 59"):
        Playback(recording).verify()


@pytest.mark.parametrize("team", [0, 1])
def test_a_capture_that_did_not_happen_is_a_difference(team, tmp_path):
    record(tmp_path / "a.jsonl", ticks=90, config=CALM)
    recording = Recording.read(tmp_path / "a.jsonl")
    place = next(i for i, line in enumerate(recording.events) if isinstance(line, FrameLine) and line.tick == 33)
    recording.events.insert(place, CapturedLine(tick=31, drone=1, team=team))
    assert Playback(recording).verify().first_difference == 31


def test_captures_are_those_of_their_team(tmp_path):
    record(tmp_path / "a.jsonl", ticks=600)
    recording = Recording.read(tmp_path / "a.jsonl")
    captured = recording.of(CapturedLine)
    assert captured and Playback(recording).verify().verified
    first, kept = captured[0], list(recording.events)
    others = [drone for drone in range(8) if drone not in {line.drone for line in captured if line.tick == first.tick}]
    for change in (
        [msgspec.structs.replace(first, team=1 - first.team)],
        [msgspec.structs.replace(first, drone=others[0])],
        [first, first],
        [],
    ):
        recording.events[:] = [line for one in kept for line in (change if one is first else [one])]
        assert Playback(recording).verify().first_difference == first.tick


def test_a_game_without_frames_says_nothing_of_itself(tmp_path):
    record(tmp_path / "a.jsonl", ticks=30, config=CALM)
    recording = Recording.read(tmp_path / "a.jsonl")
    recording.events[:] = [line for line in recording.events if not isinstance(line, FrameLine)]
    verification = Playback(recording).verify()
    assert (verification.frames, verification.first_difference, verification.verified) == (0, 0, False)


def test_a_game_is_verified_from_its_start_wherever_it_is(tmp_path):
    record(tmp_path / "a.jsonl", ticks=90, config=CALM)
    playback = Playback(Recording.read(tmp_path / "a.jsonl"))
    playback.seek(70)
    assert playback.verify().verified
    playback.seek(-5)
    assert playback.game.tick == 0


def test_drones_too_fast_for_a_frame_are_shown_at_its_fastest_and_verify(tmp_path):
    controller = CALM.game.controller.replace(max_acceleration=40.0)
    record(tmp_path / "a.jsonl", ticks=60, config=CALM.replace(game=CALM.game.replace(controller=controller)))
    recording = Recording.read(tmp_path / "a.jsonl")
    assert max(np.abs(frame.velocities).max() for frame in recording.frames()) == FASTEST
    assert Playback(recording).verify().verified


def test_a_seek_begins_at_the_nearest_moment_that_is_kept_and_their_memory_is_bounded(tmp_path, monkeypatch):
    record(tmp_path / "a.jsonl", ticks=600, config=CALM)
    recording = Recording.read(tmp_path / "a.jsonl")
    straight = Playback(recording)
    straight.seek(500)
    advanced, advance = [], Simulator.advance
    monkeypatch.setattr(Simulator, "advance", lambda s, ticks, *a: (advanced.append(ticks), advance(s, ticks, *a)))
    one = sum(array.nbytes for array in straight.game.simulator.snapshot())
    for most, kept in ((1000, range(0, 600, 90)), (4, range(0, 600, 180)), (3, range(0, 600, 360))):
        monkeypatch.setattr(module, "_MARKS_BYTES", most * one)
        playback = Playback(recording)
        playback.seek(599)
        assert sorted(playback._marks) == list(kept)
        advanced.clear()
        fork = playback.fork(500)
        assert sum(advanced) == 500 - max(tick for tick in kept if tick <= 500)
        assert playback.game.tick == 599, "and this one stays where it is"
        np.testing.assert_array_equal(fork.game.simulator.positions, straight.game.simulator.positions)
        fork.game.submit(0, 99, np.eye(10))
        straight_on = straight.fork(500).game
        straight_on.submit(0, 99, np.eye(10))
        assert fork.game.advance(30) == straight_on.advance(30), "a command waits for the one before it"


def test_all_that_came_into_force_on_the_way_is_told(tmp_path):
    record(tmp_path / "a.jsonl", ticks=200, config=CALM)
    playback = Playback(Recording.read(tmp_path / "a.jsonl"))
    assert [command.number for command in playback.advance(61)] == [0, 1]
    assert [command.number for command in playback.advance(59)] == []
    assert [command.number for command in playback.advance(1000)] == [2, 3]


@pytest.mark.parametrize("speed", [1.0, 5.0])
def test_a_film_shows_every_moment_to_the_last_with_targets_and_names(speed, tmp_path, monkeypatch):
    record(tmp_path / "a.jsonl", ticks=61, config=CALM)
    shown, told, seen = [], [], {}

    class Spy:
        size = (4, 2)

        def __init__(self, names, **how):
            seen.update(names=names, **how)

        def draw(self, simulator):
            return int(simulator.games.ticks[0])

    @contextlib.contextmanager
    def film(path, rate, size):
        seen.update(path=path, rate=rate, size=size)
        yield shown.append

    monkeypatch.setattr(module, "Painter", Spy)
    monkeypatch.setattr(module, "open_film", film)
    Playback(Recording.read(tmp_path / "a.jsonl")).film(tmp_path / "a.gif", speed, lambda *so_far: told.append(so_far))
    every = {1.0: 3, 5.0: 6}[speed]
    assert shown == [*range(0, 61, every), 61]
    assert all(after > before for before, after in itertools.pairwise(shown))
    assert told == [(tick / 30, 61 / 30) for tick in shown]
    assert seen["rate"] == speed * 30 / every, "so many pictures a second that time goes as was asked"
    assert (seen["path"], seen["size"]) == (tmp_path / "a.gif", (4, 2))
    assert seen["names"] == ("P1", "ring") and seen["targets"]
