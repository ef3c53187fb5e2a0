"""Checks of arrays that come from outside: commands, actions, outputs of policies and control systems."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from swarm_pz.config.installed import FAULTS
from swarm_pz.errors import CommandError

TOLERANCE = 1e-6
"""Numbers this far outside their range are clipped: rounding."""
_FAINTEST = 1e-300
"""Numbers nearer to 0 become 0: fast math divides by means of reciprocals, which would overflow."""


def check_densities(densities: ArrayLike, shape: tuple[int, ...], name: str = "command") -> NDArray[np.float64]:
    """Return densities (..., A, A) as `check_values` does, with values in [0, 1]."""
    return check_values(densities, shape, 0.0, 1.0, name)


def check_values(
    given: ArrayLike,
    shape: tuple[int, ...],
    low: float | NDArray[Any],
    high: float | NDArray[Any],
    name: str,
) -> NDArray[np.float64]:
    """Return numbers as a fresh float64 array of a shape; `low` and `high` are for all, or arrays along the last axes.

    Numbers up to 1e-6 outside are clipped; those within 1e-300 of 0 become 0. Errors begin with `name`. Raises a
    CommandError if they do not cast to float, have another shape, or hold NaN, infinity or numbers outside the range.
    """
    plain = type(given) is np.ndarray and given.dtype.kind in "biuf"  # these cast without the checks of `as_floats`
    values = np.array(given, np.float64, order="C") if plain else as_floats(given, _expected(name, shape, low, high))
    if values.shape != shape:
        received = describe(given) if values.ndim == 0 else f"shape {values.shape}"
        raise CommandError(f"{_expected(name, shape, low, high)}, got {received}")
    if not values.size:
        return values
    least, largest = values.item(values.argmin()), values.item(values.argmax())  # NaN if any value is; quicker than min
    if not (math.isfinite(least) and math.isfinite(largest)):
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(values))[0])
        raise CommandError(f"{_expected(name, shape, low, high)}, got {values[place]} at index {place}")
    if least < _FAINTEST:
        values[np.abs(values) < _FAINTEST] = 0.0
    if not isinstance(low, np.ndarray):
        if least < low - TOLERANCE or largest > high + TOLERANCE:
            raise CommandError(f"{_expected(name, shape, low, high)}, got values from {least:g} to {largest:g}")
        if least < low or largest > high:
            np.clip(values, low, high, out=values)
        return values
    outside = (values < low - TOLERANCE) | (values > high + TOLERANCE)
    if outside.any():
        place = tuple(int(i) for i in np.argwhere(outside)[0])
        own = tuple(place[len(place) - np.ndim(low) :])
        fits = _range(low[own], np.asarray(high)[own])
        expected = _expected(name, shape, low, high)
        raise CommandError(f"{expected}, within {fits} at index {place}, got {values[place]:g} there")
    return np.asarray(np.clip(values, low, high, out=values))


def check_indices(given: ArrayLike, shape: tuple[int, ...], count: int, expected: str) -> NDArray[np.integer]:
    """Return whole numbers in [0, count) of a shape; raise a CommandError that begins with `expected` otherwise."""
    try:
        numbers = np.array(given)
        fits = numbers.shape == shape and np.issubdtype(numbers.dtype, np.integer)
        fits = fits and bool(((numbers >= 0) & (numbers < count)).all())
    except (TypeError, ValueError):
        fits = False
    if not fits:
        raise CommandError(f"{expected}, got {describe(given)}")
    return numbers


def as_floats(given: Any, expected: str) -> NDArray[np.float64]:
    """Return real numbers as a fresh float64 array in C order; none may be masked, a date or complex.

    Raises a CommandError that begins with `expected` otherwise.
    """
    try:
        array = np.asanyarray(given)
        if array.dtype.kind in "cmM" or isinstance(array, np.ma.MaskedArray):
            kind = "a masked array" if isinstance(array, np.ma.MaskedArray) else f"numbers of type {array.dtype}"
            raise CommandError(f"{expected}, got {kind}: give plain real numbers")
        return np.array(array, np.float64, order="C")  # sums must not depend on memory order
    except CommandError:
        raise
    except (TypeError, ValueError, OverflowError) as error:
        raise CommandError(f"{expected}, got {describe(given)}") from error


def _expected(name: str, shape: tuple[int, ...], low: Any, high: Any) -> str:
    within = "" if isinstance(low, np.ndarray) else f"in {_range(low, high)} "
    return f"{name} must be numbers {within}of shape {shape}"


def _range(low: Any, high: Any) -> str:
    return f"[{low:g}, {high:g}]"


def describe(value: Any) -> str:
    """Return a value as an error shows it: its type, and its beginning."""
    text = repr_of(value)
    return f"{type(value).__name__} {text if len(text) <= 60 else text[:57] + '...'}"


def repr_of(value: Any) -> str:
    """Return the repr of another package's object; its type's name if that fails."""
    try:
        return repr(value)
    except FAULTS:
        return f"<{type(value).__name__} that cannot be shown>"
