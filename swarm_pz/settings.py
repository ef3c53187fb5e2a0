"""What every configuration is made of: checked fields, plain dicts in and out, and a hash."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
import types
import typing
from collections.abc import Mapping
from typing import Any, Self

from swarm_pz.errors import ConfigError, UnknownNameError, nearest


def check(holds: bool, name: str, value: object, expected: str) -> None:
    """Raise a ConfigError that names field, value and range, unless the value holds."""
    if not holds:
        raise ConfigError(f"{name} must be {expected}, got {value!r}")


def check_number(value: object, name: str, low: float, high: float, *, open_low: bool = False) -> None:
    """Check that a value is a finite real number in [low, high], or (low, high] if `open_low`."""
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    holds = is_number and (low < value if open_low else low <= value) and value <= high  # type: ignore[operator]
    bracket = "(" if open_low else "["
    check(holds, name, value, f"a number in {bracket}{low:g}, {high:g}]")


def check_count(value: object, name: str, low: int, high: int) -> None:
    """Check that a value is a whole number in [low, high]."""
    holds = isinstance(value, int) and not isinstance(value, bool) and low <= value <= high
    check(holds, name, value, f"a whole number in [{low}, {high}]")


def check_choice(value: object, name: str, choices: tuple[str, ...]) -> None:
    """Check that a value is one of some names."""
    check(isinstance(value, str) and value in choices, name, value, " or ".join(map(repr, choices)))


def later(default: Any) -> Any:
    """Declare a field that came after files with hashes had been written.

    At its default it does not count in the hash, so those files keep theirs.
    """
    return dataclasses.field(default=default, metadata={"later": True})


class Config:
    """Refuses unknown names with the nearest known one; reads and writes plain dicts."""

    def __new__(cls, *_: object, **given: object) -> Self:
        """Refuse unknown names before `__init__` would, with a better message."""
        known = cls.__dataclass_fields__  # type: ignore[attr-defined]
        for name in given:
            if name not in known:
                raise UnknownNameError(f"{cls.__name__} has no field {name!r}; {nearest(name, known)}")
        return super().__new__(cls)

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
        hints = typing.get_type_hints(cls)
        return cls(**{name: _from_plain(hints.get(name), value) for name, value in values.items()})

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed.

        Raises
        ------
        ConfigError
            If a name is unknown or a value is out of range.
        """
        fields = {name: getattr(self, name) for name in self.__dataclass_fields__}  # type: ignore[attr-defined]
        return type(self)(**(fields | changes))

    def to_dict(self) -> dict[str, Any]:
        """Return the configuration as nested dicts, lists, numbers and strings."""
        return dataclasses.asdict(self)  # type: ignore[call-overload, no-any-return]

    @property
    def hash(self) -> str:
        """Sixteen hexadecimal digits that are the same for equal configurations, on every machine."""
        plain = json.dumps(_canonical(self), sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(plain.encode()).hexdigest()[:16]


def _from_plain(hint: Any, value: Any) -> Any:
    """Turn a plain value into what a field of type `hint` holds."""
    is_union = isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union
    options = typing.get_args(hint) if is_union else (hint,)
    if isinstance(value, Mapping):
        for option in options:
            if isinstance(option, type) and issubclass(option, Config):
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


def _canonical(value: Any) -> Any:
    """Write whole floats and integers alike, so that 1 and 1.0 hash the same, and leave out later fields at rest."""
    if isinstance(value, Config):
        fields = [(entry, getattr(value, entry.name)) for entry in dataclasses.fields(value)]  # type: ignore[arg-type]
        return {
            entry.name: _canonical(held)
            for entry, held in fields
            if not ("later" in entry.metadata and held == entry.default)
        }
    if isinstance(value, dict):
        return {name: _canonical(entry) for name, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_canonical(entry) for entry in value]
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return float(value)
    return value
