"""Cosine basis F_k(x, y) = cos(pi k1 x) cos(pi k2 y) of the unit square, without normalisation.

The basis is separable, so everything is done with one table of cosines and one of sines an axis.
Tables are `[mode, place]`: the places of many drones lie side by side, and are the lanes of vectors.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarm_pz.kernels import entry_point, kernel, loop
from swarm_pz.kernels.arrays import Bools, Float32s, Float64s, Floats, Int64s
from swarm_pz.kernels.lanes import WIDTH, Lanes, floor, load, store

PI = np.float32(math.pi)
SAME_TARGET = 1e-9
"""Targets whose cells differ by no more are the same command."""
_S1, _S3, _S5, _S7, _S9, _S11 = (
    np.float32((-1) ** (n // 2) * math.pi**n / math.factorial(n)) for n in (1, 3, 5, 7, 9, 11)
)
_C2, _C4, _C6, _C8, _C10, _C12 = (
    np.float32((-1) ** (n // 2) * math.pi**n / math.factorial(n)) for n in (2, 4, 6, 8, 10, 12)
)


@loop
def first_harmonic(places: Lanes) -> tuple[Lanes, Lanes]:
    """Return cos(pi x) and sin(pi x), to 1e-7.

    The nearest whole number n gives the sign, (-1)^n, and what is left, in [-1/2, 1/2], goes into the Taylor series.
    """
    one, two, half = np.float32(1.0), np.float32(2.0), np.float32(0.5)
    whole = floor(places + half)
    x = places - whole
    sign = one - two * (whole - two * floor(half * whole))
    q = x * x
    sine = sign * x * (_S1 + q * (_S3 + q * (_S5 + q * (_S7 + q * (_S9 + q * _S11)))))
    return sign * (one + q * (_C2 + q * (_C4 + q * (_C6 + q * (_C8 + q * (_C10 + q * _C12)))))), sine


@loop
def fill_harmonics(x: Float32s, places: int, modes: tuple[int, ...], cosines: Float32s, sines: Float32s) -> None:
    """Tabulate cos(pi k x) and sin(pi k x) at the first places: 2k and 2k + 1 from k and 1, by the addition theorems.

    Tables are (K, or K + 1 if K is odd, at least `places`); k = 0 never changes.
    """
    for r in range(0, places, WIDTH):
        cosine_1, sine_1 = first_harmonic(load(x, r))
        store(cosine_1, cosines, 1, r)
        store(sine_1, sines, 1, r)
        for k in range(1, (len(modes) + 1) // 2):
            cosine_k, sine_k = load(cosines, k, r), load(sines, k, r)
            cosine, sine = cosine_k * cosine_k - sine_k * sine_k, np.float32(2.0) * sine_k * cosine_k
            store(cosine, cosines, 2 * k, r)
            store(sine, sines, 2 * k, r)
            store(cosine * cosine_1 - sine * sine_1, cosines, 2 * k + 1, r)
            store(sine * cosine_1 + cosine * sine_1, sines, 2 * k + 1, r)


@loop
def largest(image: Floats) -> float:
    """Return the largest value of an image; NumPy's method takes half a second to compile."""
    most: float = image[0, 0]
    for row in range(image.shape[0]):
        for column in range(image.shape[1]):
            most = max(most, image[row, column])
    return most


@loop
def normalise(density: Float64s, target: Float64s) -> None:
    """Scale a density image (A, A) so that its cells sum to 1; an empty one becomes uniform."""
    peak = largest(density)
    if peak == 0.0:
        target[:] = 1.0 / density.size
        return
    total = 0.0
    for row in range(density.shape[0]):
        for column in range(density.shape[1]):
            # Division by the largest value first keeps the smallest subnormal commands from overflowing.
            target[row, column] = density[row, column] / peak
            total += target[row, column]
    for row in range(density.shape[0]):
        for column in range(density.shape[1]):
            target[row, column] /= total


@loop
def differ(one: Float64s, other: Float64s) -> bool:
    """Test that two targets (A, A) differ. An image and its double make the same target."""
    most = 0.0
    for row in range(one.shape[0]):
        for column in range(one.shape[1]):
            most = max(most, abs(one[row, column] - other[row, column]))
    return most > SAME_TARGET


@loop
def transform(
    target: Float64s, matrix: Float64s, mass: float, along_x: Float64s, sums: Float64s, coefficients: Float32s
) -> None:
    """Compute the Fourier coefficients (K, K) of a target, phi_0 = mass: matrix' target' matrix, normalised.

    `along_x` (A, K) and `sums` (K, K) are scratch.
    """
    cells, modes = matrix.shape
    along_x[:], sums[:] = 0.0, 0.0
    for row in range(cells):
        for column in range(cells):
            for k1 in range(modes):
                along_x[row, k1] += target[row, column] * matrix[column, k1]
    for row in range(cells):
        for k1 in range(modes):
            for k2 in range(modes):
                sums[k1, k2] += along_x[row, k1] * matrix[row, k2]
    scale = mass / sums[0, 0]
    for k1 in range(modes):
        for k2 in range(modes):
            coefficients[k1, k2] = sums[k1, k2] * scale


class Aims(NamedTuple):
    """The targets of E games, and how densities become targets."""

    targets: Float64s
    """(E, 2, A, A) each sums to 1."""
    coefficients: Float32s
    """(E, 2, K, K) of the targets; indexed `[k1 (x), k2 (y)]`."""
    sent: Bools | None
    """(E, 2) whether each team was sent a target; None if that has no effect."""
    matrix: Float64s
    """(A, K) integrals of cos(pi k x) times each cell's interpolation weight."""
    mass: float
    """Sum of a target, as the controller sees it: phi_0."""
    holds: bool
    """True: a density that gives the target in force changes nothing; only if `sent` is not None."""


@kernel
def set_target(density: Float64s, e: int, team: int, aims: Aims, sent: Bools | None) -> None:
    """Turn a density (A, A), whose cells `[row = y, column = x]` are not negative, into the target of a team."""
    matrix, target = aims.matrix, aims.targets[e, team]
    if sent is not None:
        asked = np.empty_like(target)
        normalise(density, asked)
        if aims.holds and not differ(asked, target):
            return
        sent[e, team] = True
    normalise(density, target)
    along_x, sums = np.empty(matrix.shape, np.float64), np.empty((matrix.shape[1], matrix.shape[1]), np.float64)
    transform(target, matrix, aims.mass, along_x, sums, aims.coefficients[e, team])


@entry_point
def make_targets(densities: Float64s, rows: Int64s, teams: Int64s, aims: Aims) -> None:
    """Turn densities (n, t, A, A) of the games `rows` (n,) and the teams (t,) into targets."""
    for place in range(len(rows)):
        for number in range(len(teams)):
            set_target(densities[place, number], rows[place], teams[number], aims, aims.sent)
