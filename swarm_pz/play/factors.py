"""Factors of an experiment at one seat: delays, hidden things, the frame rate, a helper that shares the command."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Literal

from swarm_pz.config import TEAM_NAMES
from swarm_pz.config.base import Config, Range, Share, check
from swarm_pz.errors import ConfigError, nearest
from swarm_pz.files import read_toml

Hideable = Literal["opponents", "ground", "trails", "target"]
Delay = Annotated[float, Range(0.0, 5000.0)]
FULL_RATE = 30
"""The frame rate that shows every frame."""


@dataclass(frozen=True, kw_only=True)
class Factors(Config):
    """The factors of one seat.

    Attributes
    ----------
    command_delay_ms, display_delay_ms : float
        Delays of commands and of what the seat is shown.
    frame_rate : int
        Frames shown a second, at most 30.
    speed : float
        Seconds of game per second, for both seats.
    hide : tuple of str
        Things that the seat is not shown.
    share : float
        The helper's share of the command, from 0 to 1.
    helper : str
        The policy that makes this share.
    """

    command_delay_ms: Delay = 0.0
    display_delay_ms: Delay = 0.0
    frame_rate: Annotated[int, Range(1, FULL_RATE)] = FULL_RATE
    speed: Annotated[float, Range(0.25, 2.0)] = 1.0
    hide: tuple[Hideable, ...] = ()
    share: Share = 0.0
    helper: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        check(self.share == 0.0 or bool(self.helper), "helper", self.helper, "a policy, if it has a share")

    @property
    def bare(self) -> Factors:
        """The factors of a condition, without its other fields."""
        return Factors(**{entry.name: getattr(self, entry.name) for entry in fields(Factors)})


def read_factors(path: Path) -> tuple[Factors, Factors]:
    """Return the factors of red and blue from the tables [red] and [blue] of a TOML file.

    Raises ConfigError if the file or a value is invalid.
    """
    try:
        plain = read_toml(path)
    except ConfigError as error:
        raise ConfigError(f"{path} holds no factors: it {error}") from error
    for name in plain:
        if name not in TEAM_NAMES:
            raise ConfigError(f"{path}: expected tables [red] and [blue], got {name!r}; {nearest(name, TEAM_NAMES)}")
    try:
        red, blue = (Factors.from_dict(plain.get(name, {})) for name in TEAM_NAMES)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error
    return red, blue
