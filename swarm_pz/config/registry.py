"""Control systems that are installed under the entry points `swarm_pz.systems`."""

from __future__ import annotations

import functools
import importlib.metadata
import re
from collections.abc import Callable, Mapping
from typing import Any

from swarm_pz.config.installed import FAULTS, entry_points, is_own, origin, registered_in
from swarm_pz.config.system import ControlSystem
from swarm_pz.config.values import repr_of
from swarm_pz.errors import ConfigError, nearest

GROUP = "swarm_pz.systems"
_NAMES = re.compile(r"\w[\w-]*(\.[\w-]+)*", re.ASCII)
_UNINSTALLED = re.compile(r"[\w.:<>-]+")
"""Names of systems that are not installed: by default module and qualified name, module:make.<locals>.System."""


def registered() -> dict[str, importlib.metadata.EntryPoint]:
    """Return the entry points of the installed control systems, by name, as `registered_in` chooses them."""
    return registered_in(GROUP)


def faults() -> dict[str, str]:
    """Return errors of registered systems: of broken ones by name, of duplicates by name and package."""
    known, errors = registered(), {}
    for point in entry_points(GROUP):
        if point != known[point.name]:
            taken = origin(known[point.name])
            errors[f"{point.name} of {origin(point)}"] = f"{_label(point)}: {taken} has a system of that name already"
            continue
        try:
            system_of(point.name)
        except ConfigError as error:
            errors[point.name] = str(error).removeprefix("controllers: ")
    return errors


def _label(point: importlib.metadata.EntryPoint) -> str:
    return f"control system {point.name!r} of {origin(point)} ({point.value})"


@functools.cache
def system_class(name: str) -> type[ControlSystem]:
    """Return the class of an installed control system; raise a ConfigError if it is unknown or broken."""
    point = _find(name)
    label = f"controllers: {_label(point)}"
    try:
        kind = point.load()
    except FAULTS as error:
        raise ConfigError(f"{label} cannot be imported: {repr_of(error)}") from error
    if not (isinstance(kind, type) and issubclass(kind, ControlSystem)):
        raise ConfigError(f"{label} must be a subclass of swarm_pz.systems.ControlSystem, got {kind!r}")
    if kind.name != name:
        raise ConfigError(f"{label} must say name = {name!r} as its entry point does, got {kind.name!r}")
    if _NAMES.fullmatch(name) is None:
        raise ConfigError(f"{label} must have a name of letters, digits, _, - and inner dots: it names files")
    _check_class(kind, label, may_have_kernel=is_own(point))
    return kind


def _check_class(kind: type[ControlSystem], label: str, *, may_have_kernel: bool = False) -> None:
    if "__dataclass_fields__" not in vars(kind) or not kind.__dataclass_params__.frozen:  # type: ignore[attr-defined]
        raise ConfigError(f"{label} must be a frozen dataclass: put @dataclass(frozen=True, kw_only=True) above it")
    if kind.kernel and not may_have_kernel:
        raise ConfigError(f"{label} must fly by its own solve: kernel is for swarm-pz's own, got {kind.kernel!r}")
    if not isinstance(getattr(kind, "takes", None), str):
        raise ConfigError(f"{label} must say by takes = '...' which kind of commands it takes")


def is_installed(kind: type[ControlSystem]) -> bool:
    """Test that a class is the control system installed under its name."""
    try:
        return kind is system_class(kind.name)
    except ConfigError:
        return False


@functools.cache  # a look-up takes milliseconds, and every configuration needs one
def _find(name: str) -> importlib.metadata.EntryPoint:
    points = registered()
    if name not in points:
        raise ConfigError(f"controllers: there is no control system {name!r}; {nearest(name, points)}")
    return points[name]


def system_of(choice: str | ControlSystem) -> ControlSystem:
    """Return a control system by its name, with default parameters; an object is returned as it is."""
    if not isinstance(choice, str):
        return choice
    return _make(system_class(choice), lambda: _label(_find(choice)))


def _make(kind: type[ControlSystem], label: Callable[[], str]) -> ControlSystem:
    """Return a control system with default parameters; `label` returns its name for an error."""
    try:
        return kind()
    except FAULTS as error:
        raise ConfigError(f"controllers: {label()} cannot be made: {repr_of(error)}") from error


def about(name: str) -> str:
    """Return the first line of an installed control system's docstring."""
    return (system_class(name).__doc__ or "").strip().partition("\n")[0]


def read_choice(choice: Any) -> str | ControlSystem:
    """Return a control system in one form: as its name if all its parameters are defaults.

    `choice` is a name, a control system or its class, installed or not, or plain values: `name` and other parameters.
    Raises a ConfigError if it is none of these, its name is unknown or another class's, or a parameter is out of range.
    """
    if isinstance(choice, Mapping):
        if "name" not in choice:
            raise ConfigError(f"controllers: a control system as plain values has a name, got {dict(choice)!r}")
        numbers = {key: value for key, value in choice.items() if key != "name"}
        choice = system_class(str(choice["name"])).from_dict(numbers)
    if isinstance(choice, str):
        _find(choice)
        return choice
    if isinstance(kind := choice, type) and issubclass(kind, ControlSystem):
        choice = _make(kind, lambda: kind.__qualname__)
    if not isinstance(choice, ControlSystem):
        raise ConfigError(
            f"controllers must be the name of a control system, one of them, or a pair of these, got {choice!r}; "
            f"{nearest(str(choice), registered())}"
        )
    label = f"controllers: {type(choice).__qualname__}"
    if not isinstance(choice.name, str) or _UNINSTALLED.fullmatch(choice.name) is None:
        raise ConfigError(f"{label} must have a name of letters, digits, _, -, . and :, got {choice.name!r}")
    if is_installed(type(choice)):
        return choice.name if choice == type(choice)() else choice
    if choice.name in registered():
        raise ConfigError(f"{label} must have a name of its own: {choice.name!r} is {_label(_find(choice.name))}")
    _check_class(type(choice), label)
    return choice
