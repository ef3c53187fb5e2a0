"""Frames and targets as bytes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarm_pz.errors import ProtocolError
from swarm_pz.play.frames import FASTEST, Frame, decode_frame, decode_target, encode_frame, encode_target

# Written out by hand from docs/protocol.md; the page's frames.test.js decodes the same bytes.
GOLDEN = bytes.fromhex(
    "01 01 0300 07000000 2a010000 0000000000408f40"  # frame, keyframe, 3 drones, sequence 7, tick 298, 1000 ms
    "0000 ffff  0080 0080  ffff 0000"  # positions (0, 1), (0.5, 0.5), (1, 0)
    "0000 0000  ff7f 0180  0020 00e0"  # velocities 0, (4, -4), (1, -1)
    "05"  # drones 0 and 2 are blue
    "00 80 ff"  # altitudes
)
GOLDEN_HIDDEN = bytes.fromhex(
    "01 05 0300 07000000 2a010000 0000000000408f40"  # red is hidden: drone 1
    "0000 ffff  0000 0000  ffff 0000"
    "0000 0000  0000 0000  0020 00e0"
    "05"
    "00 00 ff"
)
GOLDEN_EXACT = bytes.fromhex(
    "01 10 0200 07000000 2a010000 0000000000408f40"  # exact, 2 drones
    "00000000 0000803f  0000003f 0000003f"  # positions (0, 1), (0.5, 0.5)
    "00000000 00000000  00008040 000080c0"  # velocities 0, (4, -4)
    "01"
)
GOLDEN_TARGET = bytes.fromhex("02 01 0200 09000000 00 ff 80 40")


def scene(**more):
    return Frame(
        sequence=7,
        tick=298,
        server_ms=1000.0,
        positions=np.array([[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]]),
        velocities=np.array([[0.0, 0.0], [4.0, -4.0], [1.00003, -1.00003]]),
        teams=np.array([1, 0, 1], np.int8),
        altitudes=np.array([0.0, 0.5, 1.0]),
        **more,
    )


def test_golden_bytes():
    assert encode_frame(scene()) == GOLDEN
    picture = np.array([[0, 255], [128, 64]], np.uint8)
    assert encode_target(1, 9, picture) == GOLDEN_TARGET
    target = decode_target(GOLDEN_TARGET)
    assert (target.team, target.number, target.picture.tolist()) == (1, 9, picture.tolist())
    frame = decode_frame(GOLDEN)
    assert (frame.sequence, frame.tick, frame.server_ms) == (7, 298, 1000.0)
    np.testing.assert_allclose(frame.positions, scene().positions, atol=1e-5)
    np.testing.assert_allclose(frame.velocities, scene().velocities, atol=1e-4)
    assert frame.teams.tolist() == [1, 0, 1] and frame.fields is None and frame.hidden is None


def test_an_exact_frame_is_read_and_holds_only_what_can_be():
    frame = decode_frame(GOLDEN_EXACT)
    assert (frame.is_exact, frame.teams.tolist()) == (True, [1, 0])
    assert frame.positions.tolist() == [[0.0, 1.0], [0.5, 0.5]] and frame.velocities.tolist() == [
        [0.0, 0.0],
        [4.0, -4.0],
    ]
    faults = ("0000803f", "0100803f"), ("0000003f", "0000c07f"), ("00008040", "0000c040"), ("01100200", "01140200")
    for before, after in faults:
        with pytest.raises(ProtocolError, match="on the map"):
            decode_frame(bytes.fromhex(GOLDEN_EXACT.hex().replace(before, after)))


def test_of_a_hidden_team_nothing_is_written_and_nothing_is_read():
    assert encode_frame(scene(hidden=0)) == GOLDEN_HIDDEN
    read = decode_frame(GOLDEN_HIDDEN)
    assert read.hidden == 0 and read.teams.tolist() == [1, 0, 1]
    for array in (read.positions, read.velocities, read.altitudes[:, None]):
        assert np.isnan(array[1]).all() and np.isfinite(array[[0, 2]]).all()
    assert encode_frame(read) == GOLDEN_HIDDEN


def random_frame(count, seed, *, keyframe, with_fields):
    """Return a frame of random drones, some of them beyond the encoded ranges."""
    generator = np.random.default_rng(seed)
    return Frame(
        sequence=seed,
        tick=seed // 3,
        server_ms=seed / 7,
        positions=generator.uniform(-0.01, 1.01, (count, 2)),
        velocities=generator.normal(0, FASTEST, (count, 2)),
        teams=generator.integers(2, size=count).astype(np.int8),
        altitudes=generator.uniform(-0.1, 1.1, count) if keyframe else None,
        fields=generator.integers(256, size=(2, 50, 50)).astype(np.uint8) if with_fields else None,
    )


@given(st.integers(0, 200), st.booleans(), st.booleans(), st.integers(0, 2**32 - 1))
def test_what_is_written_is_read_and_what_is_beyond_the_scale_at_its_end(count, keyframe, with_fields, seed):
    frame = random_frame(count, seed, keyframe=keyframe, with_fields=with_fields)
    read = decode_frame(encode_frame(frame))
    assert (read.sequence, read.tick, read.server_ms) == (frame.sequence, frame.tick, frame.server_ms)
    np.testing.assert_allclose(read.positions, frame.positions.clip(0, 1), atol=0.51 / 65535)
    np.testing.assert_allclose(read.velocities, frame.velocities.clip(-FASTEST, FASTEST), atol=0.51 * FASTEST / 32767)
    np.testing.assert_array_equal(read.teams, frame.teams)
    assert (read.altitudes is None, read.fields is None) == (not keyframe, not with_fields)
    if keyframe:
        np.testing.assert_allclose(read.altitudes, frame.altitudes.clip(0, 1), atol=0.51 / 255)
    if with_fields:
        np.testing.assert_array_equal(read.fields, frame.fields)


@pytest.mark.parametrize("data", [b"", b"\x01", GOLDEN[:-1], GOLDEN + b"\x00", b"\x02" + GOLDEN[1:]])
def test_what_is_no_frame_is_refused(data):
    with pytest.raises(ProtocolError, match="frame"):
        decode_frame(data)


KINDS = [b"\x01" + GOLDEN_TARGET[1:], b"\x02\x02" + GOLDEN_TARGET[2:]]


@pytest.mark.parametrize("data", [b"", GOLDEN_TARGET[:4], GOLDEN_TARGET[:-1], *KINDS])
def test_what_is_no_target_is_refused(data):
    with pytest.raises(ProtocolError, match="target"):
        decode_target(data)
