"""What the messages of both sides are made of."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Struct

from swarm_pz.play.strokes import DEFAULT_MAPPING, Mapping

Side = Literal["red", "blue"]
Milliseconds = Annotated[float, Meta(ge=-1e15, le=1e15)]
Count = Annotated[int, Meta(ge=0, lt=2**32)]
Reason = Literal["malformed", "too_many", "out_of_turn", "not_valid", "taken", "unknown", "full"]
Code = Annotated[str, Meta(pattern="^[A-Za-z0-9]{4,8}$")]
Token = Annotated[str, Meta(pattern="^[0-9a-f]{32}$")]
Name = Annotated[str, Meta(min_length=1, max_length=200)]
# One line of text: no control characters (of terminals, too), no line ends, nothing that turns its direction.
Label = Annotated[
    str, Meta(max_length=40, pattern=r"^(?![\s\S]*[\u0000-\u001f\u007f-\u009f\u2028-\u202e\u2066-\u2069\ufeff])")
]


class Message(Struct, forbid_unknown_fields=True):
    """A message, or a part of one."""


class Settings(Message):
    """How a room plays; None for the time limit plays without one."""

    red: Annotated[int, Meta(ge=0, le=200)] = 10
    blue: Annotated[int, Meta(ge=0, le=200)] = 10
    time_limit: Annotated[float, Meta(ge=1, le=36_000)] | None = 300.0
    mapping: Mapping = DEFAULT_MAPPING
    speed: Annotated[float, Meta(ge=0.25, le=2)] = 1.0
    red_system: Name | None = None
    """The control system that flies red; None for that of the table. So below."""
    blue_system: Name | None = None
