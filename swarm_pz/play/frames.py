"""Binary messages of the server: one moment of a game, or a target, as little-endian bytes.

Every frame is complete in itself, so any frame may be lost. `docs/protocol.md` explains them.
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
"""Flags of a frame: red's drones are hidden; blue's."""
EXACT = 16
"""Flag of a frame in the recording of a game that was played in a page: positions and velocities are float32."""
FASTEST = 4.0
"""Largest velocity that a frame holds, in map widths per second."""
_HEADER = struct.Struct("<BBHIId")
_TARGET_HEADER = struct.Struct("<BBHI")


@dataclass(frozen=True, kw_only=True)
class Frame:
    """One moment of a game, of N drones, in map widths and seconds.

    `server_ms` is on the server's clock; `altitudes` are in a keyframe. `fields` are the capture fields of red and
    blue: 255 value / maximum, at least 192 exactly where they capture. The drones of a `hidden` team have NaN. If it
    `is_exact`, positions and velocities are float32, else rounded.
    """

    sequence: int
    tick: int
    server_ms: float
    positions: NDArray[np.floating[Any]]  # (N, 2), and so velocities
    velocities: NDArray[np.floating[Any]]
    teams: NDArray[np.int8]  # 0 red, 1 blue
    altitudes: NDArray[np.floating[Any]] | None = None
    fields: NDArray[np.uint8] | None = None
    hidden: int | None = None
    is_exact: bool = False


@dataclass(frozen=True, kw_only=True)
class Target:
    """The target of a team's command with a number, as a picture (cells, cells) of 255 value / maximum."""

    team: int
    number: int
    picture: NDArray[np.uint8]


def encode_frame(frame: Frame) -> bytes:
    """Write a frame.

    A header of 20 bytes (uint8 kind, uint8 flags, uint16 N, uint32 sequence, uint32 tick, float64
    milliseconds), then uint16 positions (N, 2) with 65535 for 1, int16 velocities (N, 2) with 32767 for
    `FASTEST`, one team bit per drone, lowest first, padded to whole bytes; in a keyframe uint8
    altitudes (N,); with fields uint8 (2, 50, 50). All little-endian. Positions, velocities and altitudes of a hidden
    team's drones are 0.
    """
    flags = (KEYFRAME if frame.altitudes is not None else 0) | (WITH_FIELDS if frame.fields is not None else 0)
    flags |= HIDDEN[frame.hidden] if frame.hidden is not None else 0
    is_shown = np.ones(len(frame.teams), bool) if frame.hidden is None else frame.teams != frame.hidden

    def scaled(values: NDArray[Any], low: float, scale: float, dtype: str) -> bytes:
        shown = is_shown.reshape(-1, *[1] * (values.ndim - 1))
        return np.rint(np.clip(np.where(shown, values, 0.0), low, 1.0) * scale).astype(dtype).tobytes()

    return b"".join(
        [
            _HEADER.pack(FRAME, flags, len(frame.teams), frame.sequence, frame.tick, frame.server_ms),
            scaled(frame.positions, 0.0, 65535.0, "<u2"),
            scaled(frame.velocities / FASTEST, -1.0, 32767.0, "<i2"),
            np.packbits(frame.teams.astype(np.uint8), bitorder="little").tobytes(),
            b"" if frame.altitudes is None else scaled(frame.altitudes, 0.0, 255.0, "u1"),
            b"" if frame.fields is None else np.ascontiguousarray(frame.fields, np.uint8).tobytes(),
        ]
    )


def decode_frame(data: bytes) -> Frame:
    """Read a frame; raise ProtocolError if it is malformed or cut short."""
    if len(data) < _HEADER.size or data[0] != FRAME:
        raise ProtocolError(f"a frame must begin with byte {FRAME} and a header of {_HEADER.size} bytes")
    _, flags, count, sequence, tick, server_ms = _HEADER.unpack_from(data)
    bits, has_altitudes, has_fields = -(-count // 8), flags & KEYFRAME, flags & WITH_FIELDS
    pairs = (8 if flags & EXACT else 4) * count
    sizes = [pairs, pairs, bits, count if has_altitudes else 0, 2 * GRID_CELLS**2 if has_fields else 0]
    ends = np.cumsum([_HEADER.size, *sizes])
    if len(data) != ends[-1]:
        raise ProtocolError(f"a frame of {count} drones must have {ends[-1]} bytes, got {len(data)}")
    positions, velocities, packed, altitudes, fields = (data[start:end] for start, end in itertools.pairwise(ends))
    teams = np.unpackbits(np.frombuffer(packed, np.uint8), count=count, bitorder="little").astype(np.int8)
    hidden = next((team for team, flag in enumerate(HIDDEN) if flags & flag), None)
    shown = np.ones(count) if hidden is None else np.where(teams == hidden, np.nan, 1.0)
    if flags & EXACT:
        places, speeds = (np.frombuffer(part, "<f4").astype(np.float64) for part in (positions, velocities))
        is_so = ((places >= 0.0) & (places <= 1.0)).all() and (np.abs(speeds) <= FASTEST).all()
        if hidden is not None or not is_so:
            raise ProtocolError(f"an exact frame's drones must all be shown, on the map, no faster than {FASTEST:g}")
    else:
        places = np.frombuffer(positions, "<u2") / 65535.0
        speeds = np.frombuffer(velocities, "<i2") / 32767.0 * FASTEST
    return Frame(
        sequence=sequence,
        tick=tick,
        server_ms=server_ms,
        positions=places.reshape(count, 2) * shown[:, None],
        velocities=speeds.reshape(count, 2) * shown[:, None],
        teams=teams,
        altitudes=np.frombuffer(altitudes, np.uint8) / 255.0 * shown if has_altitudes else None,
        fields=np.frombuffer(fields, np.uint8).reshape(2, GRID_CELLS, GRID_CELLS) if has_fields else None,
        hidden=hidden,
        is_exact=bool(flags & EXACT),
    )


def encode_target(team: int, number: int, picture: NDArray[np.uint8]) -> bytes:
    """Write a target as the swarm receives it.

    A header of 8 bytes (uint8 kind, uint8 team, uint16 cells a side, uint32 number of the command) and
    uint8 (cells, cells), 255 value / maximum.
    """
    return _TARGET_HEADER.pack(TARGET, team, len(picture), number) + np.ascontiguousarray(picture, np.uint8).tobytes()


def decode_target(data: bytes) -> Target:
    """Read a target; raise ProtocolError if it is malformed or cut short."""
    if len(data) < _TARGET_HEADER.size or data[0] != TARGET:
        raise ProtocolError(f"a target must begin with byte {TARGET} and a header of {_TARGET_HEADER.size} bytes")
    _, team, cells, number = _TARGET_HEADER.unpack_from(data)
    if team > 1 or len(data) != _TARGET_HEADER.size + cells**2:
        expected = f"team 0 or 1 and {_TARGET_HEADER.size + cells**2} bytes"
        raise ProtocolError(f"a target of {cells} cells a side has {expected}, got team {team} and {len(data)} bytes")
    picture = np.frombuffer(data, np.uint8, offset=_TARGET_HEADER.size).reshape(cells, cells)
    return Target(team=team, number=number, picture=picture)
