"""What a table shows its clients: one moment of a game, or a target, as little-endian bytes.

Every frame is complete in itself, so that any of them may be lost. `docs/protocol.md` explains them.
"""

from __future__ import annotations

import itertools
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GRID_CELLS
from swarm_pz.errors import ProtocolError

FRAME, TARGET = 1, 2
"""First byte of a binary message."""
KEYFRAME, WITH_FIELDS = 1, 2
"""Flags of a frame: it holds altitudes; it holds the capture fields."""
HIDDEN = (4, 8)
"""Flags of a frame: it does not tell where red's drones are; blue's."""
FASTEST = 4.0
"""Map widths a second that the largest velocity stands for."""
_HEADER = struct.Struct("<BBHIId")
_TARGET_HEADER = struct.Struct("<BBHI")


@dataclass(frozen=True, kw_only=True)
class Frame:
    """One moment of a game.

    Attributes
    ----------
    sequence : int
        Number of the frame among those of its room.
    tick : int
    server_ms : float
        When it was made, on the server's clock.
    positions : float array (N, 2)
        Map widths.
    velocities : float array (N, 2)
        Map widths a second.
    teams : int8 array (N,)
        0 red, 1 blue.
    altitudes : float array (N,), optional
        In a keyframe.
    fields : uint8 array (2, G, G), optional
        Capture fields of red and blue: 255 value / maximum, at least 192 exactly where they capture.
    hidden : int, optional
        A team whose drones are not shown: where they are, and how they move, is NaN.
    """

    sequence: int
    tick: int
    server_ms: float
    positions: NDArray[np.floating[Any]]
    velocities: NDArray[np.floating[Any]]
    teams: NDArray[np.int8]
    altitudes: NDArray[np.floating[Any]] | None = None
    fields: NDArray[np.uint8] | None = None
    hidden: int | None = None


def encode_frame(frame: Frame) -> bytes:
    """Write a frame.

    A header of 20 bytes (uint8 kind, uint8 flags, uint16 N, uint32 sequence, uint32 tick, float64
    milliseconds), then uint16 positions (N, 2) with 65535 for 1, int16 velocities (N, 2) with 32767 for
    `FASTEST`, a bit a drone for its team, lowest first, padded to whole bytes; in a keyframe uint8
    altitudes (N,); with fields uint8 (2, 50, 50). All little-endian. Of a hidden team's drones positions, velocities
    and altitudes are 0.
    """
    flags = (KEYFRAME if frame.altitudes is not None else 0) | (WITH_FIELDS if frame.fields is not None else 0)
    flags |= HIDDEN[frame.hidden] if frame.hidden is not None else 0
    is_hidden = frame.teams == frame.hidden if frame.hidden is not None else np.zeros(len(frame.teams), bool)
    header = _HEADER.pack(FRAME, flags, len(frame.teams), frame.sequence, frame.tick, frame.server_ms)
    positions, velocities = (np.where(is_hidden[:, None], 0.0, told) for told in (frame.positions, frame.velocities))
    positions = np.rint(np.clip(positions, 0.0, 1.0) * 65535.0).astype("<u2")
    velocities = np.rint(np.clip(velocities / FASTEST, -1.0, 1.0) * 32767.0).astype("<i2")
    parts = [header, positions.tobytes(), velocities.tobytes()]
    parts.append(np.packbits(frame.teams.astype(np.uint8), bitorder="little").tobytes())
    if frame.altitudes is not None:
        altitudes = np.where(is_hidden, 0.0, frame.altitudes)
        parts.append(np.rint(np.clip(altitudes, 0.0, 1.0) * 255.0).astype(np.uint8).tobytes())
    if frame.fields is not None:
        parts.append(np.ascontiguousarray(frame.fields, np.uint8).tobytes())
    return b"".join(parts)


def decode_frame(data: bytes) -> Frame:
    """Read a frame.

    Raises
    ------
    ProtocolError
        If it is not one, or cut short.
    """
    if len(data) < _HEADER.size or data[0] != FRAME:
        raise ProtocolError(f"a frame must begin with byte {FRAME} and a header of {_HEADER.size} bytes")
    _, flags, count, sequence, tick, server_ms = _HEADER.unpack_from(data)
    bits = -(-count // 8)
    lengths = [4 * count, 4 * count, bits, count if flags & KEYFRAME else 0]
    lengths.append(2 * GRID_CELLS**2 if flags & WITH_FIELDS else 0)
    if len(data) != _HEADER.size + sum(lengths):
        raise ProtocolError(f"a frame of {count} drones must have {_HEADER.size + sum(lengths)} bytes, got {len(data)}")
    ends = np.cumsum([_HEADER.size, *lengths])
    positions, velocities, teams, altitudes, fields = (data[start:end] for start, end in itertools.pairwise(ends))
    unpacked = np.unpackbits(np.frombuffer(teams, np.uint8), count=count, bitorder="little").astype(np.int8)
    hidden = next((team for team, flag in enumerate(HIDDEN) if flags & flag), None)
    told = np.where(unpacked == hidden, np.nan, 1.0) if hidden is not None else np.ones(count)
    return Frame(
        sequence=sequence,
        tick=tick,
        server_ms=server_ms,
        positions=np.frombuffer(positions, "<u2").reshape(count, 2) / 65535.0 * told[:, None],
        velocities=np.frombuffer(velocities, "<i2").reshape(count, 2) / 32767.0 * FASTEST * told[:, None],
        teams=unpacked,
        altitudes=np.frombuffer(altitudes, np.uint8) / 255.0 * told if flags & KEYFRAME else None,
        fields=np.frombuffer(fields, np.uint8).reshape(2, GRID_CELLS, GRID_CELLS) if flags & WITH_FIELDS else None,
        hidden=hidden,
    )


def encode_target(team: int, number: int, picture: NDArray[np.uint8]) -> bytes:
    """Write a target as the swarm receives it.

    A header of 8 bytes (uint8 kind, uint8 team, uint16 cells a side, uint32 number of the command) and
    uint8 (cells, cells), 255 value / maximum.
    """
    return _TARGET_HEADER.pack(TARGET, team, len(picture), number) + np.ascontiguousarray(picture, np.uint8).tobytes()
