"""What an experimenter varies at one seat: delays, what is shown and how often, and who shares the command."""

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
"""The frame rate that leaves nothing out."""


@dataclass(frozen=True, kw_only=True)
class Factors(Config):
    """What a seat can do and see, as far as that may be varied.

    Attributes
    ----------
    command_delay_ms, display_delay_ms : float
        How much later commands come into force, and moments are shown, than they would.
    frame_rate : int
        Moments shown a second, at most 30; with 30, all that there are.
    speed : float
        Seconds of game a second, for all at the table.
    hide : tuple of str
        Of "opponents", "ground", "trails", "target": what the seat is not shown.
    share : float
        Share of the command that a policy makes, from 0 to 1; the rest is the player's.
    helper : str
        That policy.
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
        """These alone, of what may be a condition that has more."""
        return Factors(**{entry.name: getattr(self, entry.name) for entry in fields(Factors)})


def read_factors(path: Path) -> tuple[Factors, Factors]:
    """Return the factors of red and blue as a TOML file has them, in a table for each side that has any.

    Raises
    ------
    ConfigError
        If it cannot be read, or says what cannot be.
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
