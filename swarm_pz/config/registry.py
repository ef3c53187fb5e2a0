"""Which control systems there are: what is installed under the entry points `swarm_pz.systems`."""

from __future__ import annotations

import functools
import importlib.metadata
from collections.abc import Mapping
from typing import Any

from swarm_pz.config.system import ControlSystem
from swarm_pz.errors import ConfigError, nearest

GROUP = "swarm_pz.systems"
_FAULTS = (Exception, SystemExit)
"""Whatever another package's code does wrong; to end the process is for who started it."""


def registered() -> dict[str, importlib.metadata.EntryPoint]:
    """Return the entry point of every installed control system, by name: of several, swarm-pz's own or the first."""
    found: dict[str, importlib.metadata.EntryPoint] = {}
    for point in _entry_points():
        found.setdefault(point.name, point)
    return found


def _entry_points() -> list[importlib.metadata.EntryPoint]:
    points = importlib.metadata.entry_points(group=GROUP)
    return sorted(points, key=lambda one: (_origin(one) != "swarm-pz", _origin(one), one.value))


def _origin(point: importlib.metadata.EntryPoint) -> str:
    """Return the name of the package that registered a control system."""
    return str(point.dist.name) if point.dist is not None else "unknown"


def faults() -> dict[str, str]:
    """Return what is wrong with what is registered, in words: broken systems by name, copies by name and origin."""
    known, found = registered(), {}
    for point in _entry_points():
        if point != known[point.name]:
            taken = _origin(known[point.name])
            found[f"{point.name} of {_origin(point)}"] = f"{_said(point)}: {taken} has a system of that name already"
            continue
        try:
            system_of(point.name)
        except ConfigError as error:
            found[point.name] = str(error).removeprefix("controllers: ")
    return found


def _said(point: importlib.metadata.EntryPoint) -> str:
    return f"control system {point.name!r} of {_origin(point)} ({point.value})"


@functools.cache
def system_class(name: str) -> type[ControlSystem]:
    """Return the class of an installed control system.

    Raises
    ------
    ConfigError
        If there is none of that name, or it cannot be imported, or is no control system of that name.
    """
    point = _find(name)
    said = f"controllers: {_said(point)}"
    try:
        found = point.load()
    except _FAULTS as error:
        raise ConfigError(f"{said} cannot be imported: {error!r}") from error
    if not (isinstance(found, type) and issubclass(found, ControlSystem)):
        raise ConfigError(f"{said} must be a subclass of swarm_pz.systems.ControlSystem, got {found!r}")
    if (called := getattr(found, "name", None)) != name:
        raise ConfigError(f"{said} must say name = {name!r} as its entry point does, got {called!r}")
    if not isinstance(getattr(found, "takes", None), str):
        raise ConfigError(f"{said} must say by takes = '...' which kind of commands it takes")
    return found


@functools.cache  # looking through what is installed takes milliseconds, and every configuration asks
def _find(name: str) -> importlib.metadata.EntryPoint:
    points = registered()
    if name not in points:
        raise ConfigError(f"controllers: there is no control system {name!r}; {nearest(name, points)}")
    return points[name]


def system_of(choice: str | ControlSystem) -> ControlSystem:
    """Return a control system by its name, with its usual numbers; one that is given is returned as it is.

    Raises
    ------
    ConfigError
        As of `system_class`, and if it cannot be made.
    """
    if not isinstance(choice, str):
        return choice
    found = system_class(choice)
    try:
        return found()
    except _FAULTS as error:
        raise ConfigError(f"controllers: {_said(_find(choice))} cannot be made: {error!r}") from error


def about(name: str) -> str:
    """Return a line about an installed control system: the first of its docstring."""
    return (system_class(name).__doc__ or "").strip().partition("\n")[0]


def read_choice(choice: Any) -> str | ControlSystem:
    """Return a control system in its one form: its name if all its numbers are the usual ones.

    Parameters
    ----------
    choice : str, ControlSystem or mapping
        A name, a control system, or one as plain values: its `name` and those numbers that differ.

    Raises
    ------
    ConfigError
        If it is none of these, there is none of that name, or a number is out of range.
    """
    if isinstance(choice, Mapping):
        if "name" not in choice:
            raise ConfigError(f"controllers: a control system as plain values has a name, got {dict(choice)!r}")
        numbers = {key: value for key, value in choice.items() if key != "name"}
        choice = system_class(str(choice["name"])).from_dict(numbers)
    if isinstance(choice, str):
        _find(choice)
        return choice
    if not isinstance(choice, ControlSystem) or type(choice) is not system_class(choice.name):
        raise ConfigError(
            f"controllers must be the name of a control system, one of them, or a pair of these, got {choice!r}; "
            f"{nearest(str(choice), registered())}"
        )
    return choice.name if choice == type(choice)() else choice
