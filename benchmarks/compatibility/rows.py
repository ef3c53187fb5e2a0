"""A row of the table: what a user would write, what keywords of ours it needs, and why it fails where it must."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any

SMALL: dict[str, Any] = {"drones_per_team": 3, "max_cycles": 5}
"""Games that end soon; nothing here depends on their rules."""


@dataclass(frozen=True)
class Row:
    """Something that users of a library do.

    Attributes
    ----------
    what : str
        What is tried, in a line.
    run : callable
        Does it; gets the keywords.
    keywords : mapping
        What our environments must be told so that the library takes them.
    fails : str
        Why the library cannot; empty where it can.
    """

    what: str
    run: Callable[..., Any]
    keywords: Mapping[str, Any]
    fails: str


def row(what: str, fails: str = "", **keywords: Any) -> Callable[[Callable[..., Any]], Row]:
    """Make a row of a function."""
    return lambda run: Row(what, run, keywords, fails)


def rows_of(library: ModuleType) -> dict[str, Row]:
    """Return a library's rows by name, in the order of its file."""
    return {name: value for name, value in vars(library).items() if isinstance(value, Row)}
