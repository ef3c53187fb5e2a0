"""Cosine basis F_k(x, y) = cos(pi k1 x) cos(pi k2 y) of the unit square, without normalisation.

The basis is separable, so everything is done with one table of cosines and one of sines an axis.
Tables are `[mode, place]`: the places of many drones lie side by side, so that the inner loops run
over them and become vector instructions.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarm_pz.kernels import kernel

PI = np.float32(math.pi)


@kernel
def fill_first_harmonic(
    position: np.float32, step: np.float32, cosines: NDArray[np.float32], sines: NDArray[np.float32]
) -> None:
    """Tabulate cos(pi x) and sin(pi x) along a straight path x = position + h step, h = 0, 1, ...

    Each point comes from the one before by rotation (the addition theorems), so that cos and sin
    themselves are called twice.

    Parameters
    ----------
    position, step : float32
        One coordinate of the first point and its change to the next, in map widths.
    cosines, sines : float32 array (points,)
        Overwritten.
    """
    c, s = math.cos(PI * position), math.sin(PI * position)
    cos_step, sin_step = math.cos(PI * step), math.sin(PI * step)
    for h in range(cosines.shape[0]):
        cosines[h] = c
        sines[h] = s
        c, s = c * cos_step - s * sin_step, s * cos_step + c * sin_step


@kernel
def fill_higher_harmonics(cosines: NDArray[np.float32], sines: NDArray[np.float32]) -> None:
    """Complete tables of cos(pi k x) and sin(pi k x), of which k = 1 is given, by rotation.

    Parameters
    ----------
    cosines, sines : float32 array (modes, places)
        Row 1 is read, the others are overwritten.
    """
    cosines[0] = np.float32(1.0)
    sines[0] = np.float32(0.0)
    for k in range(2, cosines.shape[0]):
        for r in range(cosines.shape[1]):
            cosines[k, r] = cosines[k - 1, r] * cosines[1, r] - sines[k - 1, r] * sines[1, r]
        for r in range(cosines.shape[1]):
            sines[k, r] = sines[k - 1, r] * cosines[1, r] + cosines[k - 1, r] * sines[1, r]
