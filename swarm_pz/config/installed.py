"""What is installed under a group of entry points, swarm-pz's own first."""

from __future__ import annotations

import importlib.metadata

OWN = "swarm-pz"
FAULTS = (Exception, SystemExit)
"""Whatever another package's code does wrong; to end the process is for who started it."""


def entry_points(group: str) -> list[importlib.metadata.EntryPoint]:
    """Return all entry points of a group: swarm-pz's own, then by package and value, however they are found."""
    points = importlib.metadata.entry_points(group=group)
    names: dict[int, str] = {}  # for a package's name all that it says about itself is read: once for each package
    for point in points:
        if id(point.dist) not in names:
            names[id(point.dist)] = origin(point)

    def order(point: importlib.metadata.EntryPoint) -> tuple[bool, str, str]:
        name = names[id(point.dist)]
        return name != OWN, name, point.value

    return sorted(points, key=order)


def registered_in(group: str) -> dict[str, importlib.metadata.EntryPoint]:
    """Return the entry points of a group by name: of several, swarm-pz's own or else the first."""
    found: dict[str, importlib.metadata.EntryPoint] = {}
    for point in entry_points(group):
        found.setdefault(point.name, point)
    return found


def origin(point: importlib.metadata.EntryPoint) -> str:
    """Return the name of the package that registered an entry point."""
    return str(point.dist.name) if point.dist is not None else "unknown"


def is_own(point: importlib.metadata.EntryPoint) -> bool:
    """Whether swarm-pz registered an entry point itself."""
    return origin(point) == OWN
