"""Entry points of installed packages, swarm-pz's own first."""

from __future__ import annotations

import contextlib
import functools
import importlib.metadata
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

FAULTS = (Exception, SystemExit)
"""Exceptions of another package's code, which must not end the process."""


def entry_points(group: str) -> list[importlib.metadata.EntryPoint]:
    """Return all entry points of a group: swarm-pz's own first, then sorted by package and value."""
    return list(_looked_up(importlib.metadata.entry_points, group, _where()))


def _where() -> tuple[tuple[str, float], ...]:
    """Return the folders that packages are installed in, and when each was last modified."""
    folders = []
    for folder in sys.path:
        with contextlib.suppress(OSError):  # the folder does not exist
            folders.append((folder, Path(folder).stat().st_mtime))
    return tuple(folders)


@functools.lru_cache(maxsize=16)  # a look-up takes tens of milliseconds, and every name of a policy needs one
def _looked_up(
    look: Callable[..., Iterable[importlib.metadata.EntryPoint]],
    group: str,
    where: tuple[tuple[str, float], ...],  # noqa: ARG001 - else what is installed meanwhile is not found
) -> tuple[importlib.metadata.EntryPoint, ...]:
    pairs = [(origin(point), point) for point in look(group=group)]  # once each: `origin` reads a package's metadata
    return tuple(point for name, point in sorted(pairs, key=lambda it: (it[0] != "swarm-pz", it[0], it[1].value)))


def registered_in(group: str) -> dict[str, importlib.metadata.EntryPoint]:
    """Return the entry points of a group by name; if several share a name, swarm-pz's own or else the first."""
    points: dict[str, importlib.metadata.EntryPoint] = {}
    for point in entry_points(group):
        points.setdefault(point.name, point)
    return points


def origin(point: importlib.metadata.EntryPoint) -> str:
    """Return the name of the package that registered an entry point."""
    return str(point.dist.name) if point.dist is not None else "unknown"


def is_own(point: importlib.metadata.EntryPoint) -> bool:
    """Test that an entry point is swarm-pz's own."""
    return origin(point) == "swarm-pz"
