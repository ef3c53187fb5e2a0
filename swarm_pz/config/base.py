"""Base of every configuration: checked fields, plain dicts in and out, and a hash."""

from __future__ import annotations

import dataclasses
import functools
import hashlib
import json
import math
import types
import typing
from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Self

import numpy as np

from swarm_pz.errors import ConfigError, UnknownNameError, nearest

PER_TEAM = {"per_team": True}
"""Metadata of a field that holds one value for both teams, or a pair (red, blue) of two different ones."""
_LONGEST = 200
"""Characters of a value that a message shows."""


class Range(NamedTuple):
    """Least and largest number that a field takes: `share: Annotated[float, Range(0.0, 1.0)]`."""

    low: float
    high: float


_EVERY = Range(-math.inf, math.inf)
_WORDS = {bool: "True or False", types.NoneType: "None", str: "a text", Any: "anything"}

Share = Annotated[float, Range(0.0, 1.0)]
ToMillion = Annotated[float, Range(0.0, 1e6)]


def check(holds: bool, name: str, value: object, expected: str) -> None:
    """Raise a ConfigError that names field, value and range, unless the value holds."""
    if not holds:
        raise ConfigError(f"{name} must be {expected}, got {_shown(value)}")


def check_type(value: Any, name: str, hint: Any) -> Any:
    """Return a value with NumPy's scalars and lists as Python's scalars and tuples; check that it fits `hint`."""
    value = _one_form(value)
    check(_fits(value, hint), name, value, _words(hint))
    return value


def check_number(value: Any, name: str, low: float, high: float) -> float:
    """Return a real number in [low, high]."""
    return float(check_type(value, name, Annotated[float, Range(low, high)]))


def check_count(value: Any, name: str, low: int, high: int) -> int:
    """Return a whole number in [low, high]."""
    return int(check_type(value, name, Annotated[int, Range(low, high)]))


def check_choice(value: object, name: str, choices: tuple[str, ...]) -> None:
    """Check that a value is one of some names."""
    check(isinstance(value, str) and value in choices, name, value, " or ".join(map(repr, choices)))


def _shown(value: object) -> str:
    """Return a value as a message shows it; Python does not write whole numbers of thousands of digits."""
    try:
        text = repr(value)
    except ValueError:
        return "numbers of thousands of digits"
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _parts(hint: Any) -> tuple[Any, tuple[Any, ...]]:
    """Return the origin of a type and its arguments; all unions have the same origin."""
    origin = typing.get_origin(hint)
    return (types.UnionType if origin is typing.Union else origin), typing.get_args(hint)


def _fits(value: Any, hint: Any, ends: Range = _EVERY) -> bool:
    """Test that a value is of a type; NaN is in no range."""
    origin, args = _parts(hint)
    if origin is Annotated:
        return _fits(value, args[0], next((one for one in args[1:] if isinstance(one, Range)), ends))
    if origin is types.UnionType:
        return any(_fits(value, one, ends) for one in args)
    if origin is Literal:
        return isinstance(value, str) and value in args
    if origin is tuple and isinstance(value, tuple):
        items = args[:1] * len(value) if args[-1] is Ellipsis else args
        return len(items) == len(value) and all(_fits(*pair, ends) for pair in zip(value, items, strict=True))
    if hint in (int, float):
        is_number = isinstance(value, int if hint is int else (int, float)) and not isinstance(value, bool)
        return is_number and ends.low <= value <= ends.high  # not converted: an int may be too large for a float
    kind = origin or hint
    return not isinstance(kind, type) or isinstance(value, kind)


def _words(hint: Any, ends: Range = _EVERY) -> str:
    """Return a type in words."""
    origin, args = _parts(hint)
    if origin is Annotated:
        return _words(args[0], next((one for one in args[1:] if isinstance(one, Range)), ends))
    if origin is types.UnionType:
        return " or ".join(_words(one, ends) for one in args)
    if origin is Literal:
        return " or ".join(map(repr, args))
    if origin is tuple:
        return f"a {'tuple' if args[-1] is Ellipsis else 'pair'}, each {_words(args[0], ends)}"
    if hint in (int, float):
        form = "" if hint is int else "g"
        within = "" if ends is _EVERY else f" in [{ends.low:{form}}, {ends.high:{form}}]"
        return f"{'a whole number' if hint is int else 'a number'}{within}"
    name = getattr(origin or hint, "__name__", str(hint))
    return _WORDS.get(hint, f"{'an' if name[0] in 'AEIOU' else 'a'} {name}")


@functools.cache
def hints_of(kind: type) -> dict[str, Any]:
    """Return the types of a configuration's fields, with their ranges."""
    try:
        return typing.get_type_hints(kind, include_extras=True)
    except NameError:  # another package's class, with names imported only for type checkers
        return {}


def hash_exempt(default: Any, metadata: Mapping[str, Any] | None = None) -> Any:
    """Declare a field that is left out of the hash at its default, so that older files keep their hashes."""
    return dataclasses.field(default=default, metadata={"hash_exempt": True, **(metadata or {})})


class Config:
    """Checked fields; unknown names are refused with the nearest known one; plain dicts in and out.

    Equal values are stored in one form: NumPy's scalars as Python's, lists as tuples, and in a `PER_TEAM` field a pair
    of two equal values as that value. Each value must then be of its field's type, and each number in its `Range`;
    subclasses check conditions on several fields. Raises a ConfigError if a name is unknown or a value is out of range.
    """

    _section: ClassVar[str] = ""

    def __post_init__(self) -> None:
        hints = hints_of(type(self))  # type: ignore[arg-type]
        for entry in dataclasses.fields(self):  # type: ignore[arg-type]
            value = _one_form(getattr(self, entry.name))
            is_pair = "per_team" in entry.metadata and isinstance(value, tuple) and len(value) == 2
            value = value[0] if is_pair and _are_equal(*value) else value
            object.__setattr__(self, entry.name, value)
            if value is not entry.default and entry.name in hints:
                check_type(value, self._path(entry.name), hints[entry.name])

    def _path(self, field: str) -> str:
        """Return a field's name in errors, as `spawn.inset`."""
        return f"{self._section}.{field}" if self._section else field

    def __new__(cls, *_: object, **keywords: object) -> Self:
        """Refuse unknown names before `__init__` would, with a better message."""
        known = [entry.name for entry in dataclasses.fields(cls)]  # type: ignore[arg-type]
        for name in keywords:
            if name not in known:
                raise UnknownNameError(f"{cls.__name__} has no field {name!r}; {nearest(name, known)}")
        return super().__new__(cls)

    def tag(self) -> dict[str, str]:
        """Return plain values that name the class, for fields that accept several classes."""
        return {}

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Build the configuration from nested plain dicts, as `to_dict` writes them."""
        if not isinstance(values, Mapping):
            raise UnknownNameError(f"{cls.__name__} expects a mapping of field names, got {values!r}")
        for entry in dataclasses.fields(cls):  # type: ignore[arg-type]
            is_needed = entry.default is entry.default_factory is dataclasses.MISSING
            if is_needed and entry.name not in values:
                raise ConfigError(f"{cls.__name__} needs the field {entry.name!r}, got {_shown(dict(values))}")
        hints = hints_of(cls)  # type: ignore[arg-type]
        return cls(**{name: _from_plain(hints.get(name), value) for name, value in values.items()})

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some fields changed."""
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
    # The types must match, too: True equals 1, but is not a number of drones.
    return type(red) is type(blue) and isinstance(red, (int, str, Config)) and red == blue


def _from_plain(hint: Any, value: Any) -> Any:
    """Turn a plain value into what a field of type `hint` holds."""
    origin, args = _parts(hint)
    options = args if origin is types.UnionType else (hint,)
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
    """Return the plain values that are hashed; they are the same for equal configurations.

    Integers become floats, so that 1 and 1.0 hash the same; exempt fields at their defaults are left out.
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
        return float(value) + 0.0  # -0.0 becomes 0.0, which it equals
    return value
