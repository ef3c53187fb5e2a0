"""Random numbers that depend only on a game's seed and on their purpose.

A number is a function of counters, so games draw the same numbers whatever runs beside them, and a copied
game continues as the original would.
"""

from __future__ import annotations

import numpy as np

from swarm_pz.kernels import kernel

FAILURE = 0
"""The purpose of a draw: whether a drone fails or returns."""
_STEP = np.uint64(0x9E3779B97F4A7C15)
_FIRST, _SECOND = np.uint64(0xBF58476D1CE4E5B9), np.uint64(0x94D049BB133111EB)
_30, _27, _31, _11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)


@kernel
def mix(state: np.uint64, number: int) -> np.uint64:
    """Return a state that depends on every bit of another state and of a number: a step of SplitMix64."""
    x = (state ^ np.uint64(number)) + _STEP
    x = (x ^ (x >> _30)) * _FIRST
    x = (x ^ (x >> _27)) * _SECOND
    return x ^ (x >> _31)


@kernel
def draw(seed: np.uint64, purpose: int, tick: int, first: int, second: int) -> float:
    """Return a number in [0, 1) for a game's seed, a purpose, a tick, and one drone or two."""
    state = mix(mix(mix(mix(seed, purpose), tick), first), second)
    return np.float64(state >> _11) / 9007199254740992.0
