"""What every configuration is made of: checked fields, plain dicts in and out, and a hash."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import types
import typing
from collections.abc import Mapping
from typing import Any, Self

import numpy as np

from swarm_pz.errors import ConfigError, UnknownNameError, nearest

PER_TEAM = {"per_team": True}
"""Metadata of a field that holds one value for both teams, or a pair (red, blue) of two different ones."""
_LONGEST = 200
"""Characters of a value that a message shows."""


def check(holds: bool, name: str, value: object, expected: str) -> None:
    """Raise a ConfigError that names field, value and range, unless the value holds."""
    if not holds:
        raise ConfigError(f"{name} must be {expected}, got {_shown(value)}")


def _shown(value: object) -> str:
    """Return a value as a message shows it; Python refuses to write whole numbers of thousands of digits."""
    if isinstance(value, int) and value.bit_length() > 4 * _LONGEST:
        return f"a whole number of {value.bit_length()} bits"
    text = repr(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def check_number(value: Any, name: str, low: float, high: float) -> float:
    """Return a finite real number in [low, high]; one of NumPy as Python's."""
    is_number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
    # Compared as they are: a whole number may be too large for a float. NaN is in no range.
    check(bool(is_number and low <= value <= high), name, value, f"a number in [{low:g}, {high:g}]")
    return float(value)


def check_count(value: Any, name: str, low: int, high: int) -> int:
    """Return a whole number in [low, high]; one of NumPy as Python's."""
    holds = isinstance(value, (int, np.integer)) and not isinstance(value, bool) and low <= value <= high
    check(bool(holds), name, value, f"a whole number in [{low}, {high}]")
    return int(value)


def check_choice(value: object, name: str, choices: tuple[str, ...]) -> None:
    """Check that a value is one of some names."""
    check(isinstance(value, str) and value in choices, name, value, " or ".join(map(repr, choices)))


def hash_exempt(default: Any, metadata: Mapping[str, Any] | None = None) -> Any:
    """Declare a field that does not count in the hash at its default, so files from before it keep theirs."""
    return dataclasses.field(default=default, metadata={"hash_exempt": True, **(metadata or {})})


class Config:
    """Refuses unknown names with the nearest known one; reads and writes plain dicts.

    What means the same is kept the same, before anything is checked: numpy's scalars as Python's, lists as
    tuples, and a pair of two equal values as that value where a field is `PER_TEAM`.
    """

    def __post_init__(self) -> None:
        """Keep every field in its one form; the checks of a subclass come after this."""
        for entry in dataclasses.fields(self):  # type: ignore[arg-type]
            value = _one_form(getattr(self, entry.name))
            is_pair = "per_team" in entry.metadata and isinstance(value, tuple) and len(value) == 2
            object.__setattr__(self, entry.name, value[0] if is_pair and _are_equal(*value) else value)

    def __new__(cls, *_: object, **given: object) -> Self:
        """Refuse unknown names before `__init__` would, with a better message."""
        known = [entry.name for entry in dataclasses.fields(cls)]  # type: ignore[arg-type]
        for name in given:
            if name not in known:
                raise UnknownNameError(f"{cls.__name__} has no field {name!r}; {nearest(name, known)}")
        return super().__new__(cls)

    def tag(self) -> dict[str, str]:
        """Return what stands before the plain values of one of several kinds, so that who reads them knows which."""
        return {}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Build the configuration from nested plain dicts, as `to_dict` writes them.

        Raises
        ------
        ConfigError
            If a name is unknown or a value is out of range.
        """
        if not isinstance(values, Mapping):
            raise UnknownNameError(f"{cls.__name__} expects a mapping of field names, got {values!r}")
        for entry in dataclasses.fields(cls):  # type: ignore[arg-type]
            is_needed = entry.default is entry.default_factory is dataclasses.MISSING
            if is_needed and entry.name not in values:
                raise ConfigError(f"{cls.__name__} needs the field {entry.name!r}, got {_shown(dict(values))}")
        hints = typing.get_type_hints(cls)
        return cls(**{name: _from_plain(hints.get(name), value) for name, value in values.items()})

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        Raises
        ------
        ConfigError
            If a name is unknown or a value is out of range.
        """
        fields = {entry.name: getattr(self, entry.name) for entry in dataclasses.fields(self)}  # type: ignore[arg-type]
        return type(self)(**(fields | changes))

    def to_dict(self) -> dict[str, Any]:
        """Return the configuration as nested dicts, lists, numbers and strings."""
        fields = dataclasses.fields(self)  # type: ignore[arg-type]
        return self.tag() | {entry.name: _plain(getattr(self, entry.name)) for entry in fields}

    @property
    def hash(self) -> str:
        """Sixteen hexadecimal digits that are the same for equal configurations, on every machine."""
        return digest(canonical(self))


def _plain(value: Any) -> Any:
    if isinstance(value, Config):
        return value.to_dict()
    return tuple(_plain(entry) for entry in value) if isinstance(value, tuple) else value


def digest(plain: Any) -> str:
    """Return sixteen hexadecimal digits that identify plain values."""
    text = json.dumps(plain, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _one_form(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    return tuple(_one_form(entry) for entry in value) if isinstance(value, (list, tuple)) else value


def _are_equal(red: Any, blue: Any) -> bool:
    # Of one type: True equals 1, but is no number of drones.
    return type(red) is type(blue) and isinstance(red, (int, str, Config)) and red == blue


def _from_plain(hint: Any, value: Any) -> Any:
    """Turn a plain value into what a field of type `hint` holds."""
    is_union = isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union
    options = typing.get_args(hint) if is_union else (hint,)
    if isinstance(value, Mapping):
        for option in options:
            if isinstance(option, type) and issubclass(option, Config) and hasattr(option, "__dataclass_fields__"):
                return option.from_dict(value)
    if isinstance(value, (list, tuple)):
        for option in options:
            if typing.get_origin(option) is tuple:
                items = typing.get_args(option)
                if items[-1] is Ellipsis:
                    items = items[:1] * len(value)
                if len(items) == len(value):
                    return tuple(_from_plain(item, entry) for item, entry in zip(items, value, strict=True))
    return value


def canonical(value: Any) -> Any:
    """Return the plain values that a hash is of; the same for equal configurations.

    Whole floats and integers are written alike, so that 1 and 1.0 hash the same; exempt fields at their defaults are
    left out.
    """
    if isinstance(value, Config):
        plain: dict[str, Any] = dict(value.tag())
        for entry in dataclasses.fields(value):  # type: ignore[arg-type]
            held = getattr(value, entry.name)
            if not ("hash_exempt" in entry.metadata and held == entry.default):
                plain[entry.name] = canonical(held)
        return plain
    if isinstance(value, dict):
        return {name: canonical(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [canonical(entry) for entry in value]
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value) + 0.0  # -0.0 equals 0.0, and is written as it
    return value
