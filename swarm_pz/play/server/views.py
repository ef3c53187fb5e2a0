"""Frames, capture fields and targets, as clients see them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GRID_CELLS, RED, ObservationConfig
from swarm_pz.play.frames import Frame, encode_frame, encode_target
from swarm_pz.simulator import Simulator
from swarm_pz.simulator.ergodicity import reconstruct
from swarm_pz.spaces.observation import observe

_FIELDS = ObservationConfig(channels=("own_capture_field", "opposing_capture_field"))


def capture_fields(simulator: Simulator) -> NDArray[np.uint8]:
    """Return the capture fields of red and blue (2, G, G) of a single game, as frames hold them."""
    return np.asarray(observe(simulator, _FIELDS, np.array([RED]), np.zeros(1, np.int64))[0])


def frame_of(
    simulator: Simulator, sequence: int, server_ms: float, *, altitudes: bool = False, fields: bool = False
) -> bytes:
    """Return the present moment of a single game as a frame's bytes."""
    return encode_frame(
        Frame(
            sequence=sequence,
            tick=int(simulator.games.ticks[0]),
            server_ms=server_ms,
            positions=simulator.positions[0],
            velocities=simulator.speeds[0],
            teams=simulator.teams[0],
            altitudes=simulator.altitudes[0] if altitudes else None,
            fields=capture_fields(simulator) if fields else None,
        )
    )


def target_picture(coefficients: NDArray[np.floating[Any]]) -> NDArray[np.uint8]:
    """Return the target of Fourier coefficients (K, K) as a picture (G, G): 255 value / maximum."""
    density = np.maximum(reconstruct(coefficients, GRID_CELLS), 0.0)
    return np.asarray(np.rint(255.0 * density / density.max()), np.uint8)


def target_message(team: int, number: int, coefficients: NDArray[np.floating[Any]]) -> bytes:
    """Return the message that shows a team the target of its command of this number."""
    return encode_target(team, number, target_picture(coefficients))
