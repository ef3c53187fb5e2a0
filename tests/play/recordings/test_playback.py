"""A recorded game played again: to any moment, as it was recorded, and as a film."""

import struct
from dataclasses import replace

import imageio_ffmpeg
import msgspec
import numpy as np
import pytest

from swarm_pz.config import CaptureConfig
from swarm_pz.play.frames import EXACT, FASTEST, decode_frame, encode_frame
from swarm_pz.play.protocol import CapturedMessage, FrameMessage
from swarm_pz.play.recordings.playback import Playback
from swarm_pz.play.recordings.recording import Recording
from tests.play.recordings.games import CONFIG, record

CALM = CONFIG.replace(game=CONFIG.game.replace(capture=CaptureConfig(enabled=False)))
"""Without captures, so that the test's change is the only difference."""


@pytest.fixture
def recorded(tmp_path):
    """Give a function that records a game and reads it."""

    def read(ticks, config=CALM):
        (tmp_path / "a.jsonl").unlink(missing_ok=True)
        record(tmp_path / "a.jsonl", ticks=ticks, config=config)
        return Recording.read(tmp_path / "a.jsonl")

    return read


# --- moments --------------------------------------------------------------------------------------


def test_a_seek_leads_to_the_recorded_moment_forwards_and_backwards(tmp_path):
    game = record(tmp_path / "a.jsonl", ticks=200, config=CALM)
    playback, places = Playback(Recording.read(tmp_path / "a.jsonl")), {}
    for tick in (0, 50, 101, 150):
        playback.seek(tick)
        places[tick] = playback.game.simulator.snapshot()
    playback.seek(10_000)
    np.testing.assert_array_equal(playback.game.simulator.positions, game.simulator.positions)
    assert playback.verify().verified, "from its start, wherever it is"
    for tick in reversed(places):
        playback.seek(tick)
        for array, then in zip(playback.game.simulator.games, places[tick], strict=True):
            np.testing.assert_array_equal(array, then)
    playback.seek(-5)
    assert playback.game.tick == 0


# --- verification ---------------------------------------------------------------------------------


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
        lambda frame: {"fields": np.zeros((2, 50, 50), np.uint8)},
    ],
)
def test_a_frame_that_shows_anything_else_is_the_first_difference(change, recorded):
    recording = recorded(75)
    frame = next(frame for frame in recording.frames() if frame.tick == 60)
    other = FrameMessage(60, encode_frame(replace(frame, **change(frame))))
    is_it = [isinstance(line, FrameMessage) and line.tick == 60 for line in recording.log]
    recording.log[is_it.index(True)] = other
    verification = Playback(recording).verify()
    assert not verification.verified and (verification.first_difference, verification.frames) == (60, 21)


def exact(frame):
    """Return a frame's message as a page records it, in float32."""
    header = struct.pack("<BBHIId", 1, EXACT, len(frame.teams), 0, frame.tick, 0.0)
    numbers = np.concatenate([frame.positions, frame.velocities]).astype("<f4").tobytes()
    return FrameMessage(frame.tick, header + numbers + np.packbits(frame.teams, bitorder="little").tobytes())


@pytest.mark.parametrize(("by", "difference"), [(1e-7, None), (3e-4, 60)])
def test_a_game_of_a_page_is_simulated_from_each_of_its_frames_to_the_next(by, difference, recorded):
    recording = recorded(120, CONFIG)
    playback = Playback(recording)
    for place, line in enumerate(recording.log):
        if isinstance(line, FrameMessage):
            playback.seek(line.tick)
            simulator = playback.game.simulator
            state = {"positions": simulator.positions[0], "velocities": simulator.speeds[0]}
            if line.tick == 60:
                state["velocities"] = nudged(state["velocities"], by)
            recording.log[place] = exact(replace(decode_frame(line.data), **state))
    verification = Playback(recording).verify()
    assert (verification.first_difference, verification.in_page) == (difference, True)


def test_captures_are_those_of_their_team_and_none_that_did_not_happen(recorded):
    recording = recorded(600, CONFIG)
    captured = recording.of(CapturedMessage)
    assert captured and Playback(recording).verify().verified
    first, kept = captured[0], list(recording.log)
    others = [drone for drone in range(8) if drone not in {line.drone for line in captured if line.tick == first.tick}]
    for change in (
        [msgspec.structs.replace(first, seat="blue" if first.seat == "red" else "red")],
        [msgspec.structs.replace(first, drone=others[0])],
        [first, first],
        [],
    ):
        recording.log[:] = [line for one in kept for line in (change if one is first else [one])]
        assert Playback(recording).verify().first_difference == first.tick
    calm = recorded(60)
    place = next(i for i, line in enumerate(calm.log) if isinstance(line, FrameMessage) and line.tick == 33)
    calm.log.insert(place, CapturedMessage("red", 31, 1))  # drone 1 is red already
    assert Playback(calm).verify().first_difference == 31


def test_a_game_without_frames_says_nothing_of_itself(recorded):
    recording = recorded(30)
    recording.log[:] = [line for line in recording.log if not isinstance(line, FrameMessage)]
    verification = Playback(recording).verify()
    assert (verification.frames, verification.first_difference, verification.verified) == (0, 0, False)


# --- films ----------------------------------------------------------------------------------------


def test_a_film_has_a_picture_for_every_period_to_the_last(recorded, tmp_path):
    progress = []
    Playback(recorded(61)).film(tmp_path / "a.gif", 5.0, lambda *now: progress.append(now))
    assert imageio_ffmpeg.count_frames_and_secs(tmp_path / "a.gif")[0] == len(progress) == 12
    assert progress[-1] == (61 / 30, 61 / 30)
