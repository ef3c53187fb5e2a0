"""What an experimenter varies at one seat: delays, what is shown and how often, and who shares the command."""

from __future__ import annotations

from dataclasses import dataclass

from swarm_pz.config.base import Config, check, check_choice, check_count, check_number

HIDEABLE = ("opponents", "ground", "trails", "target")
"""What a seat may not be shown."""


@dataclass(frozen=True, kw_only=True)
class Factors(Config):
    """What a seat can do and see, as far as that may be varied.

    Attributes
    ----------
    command_delay_ms, display_delay_ms : float
        How much later commands come into force, and moments are shown, than they would.
    frame_rate : int
        Moments shown a second, at most 30.
    speed : float
        Seconds of game a second, for all at the table.
    hide : tuple of str
        Of "opponents", "ground", "trails", "target": what the seat is not shown.
    share : float
        Share of the command that a policy makes, from 0 to 1; the rest is the player's.
    helper : str
        That policy.
    """

    command_delay_ms: float = 0.0
    display_delay_ms: float = 0.0
    frame_rate: int = 30
    speed: float = 1.0
    hide: tuple[str, ...] = ()
    share: float = 0.0
    helper: str = ""

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("command_delay_ms", "display_delay_ms"):
            check_number(getattr(self, name), name, 0.0, 5000.0)
        check_count(self.frame_rate, "frame_rate", 1, 30)
        check_number(self.speed, "speed", 0.25, 2.0)
        check_number(self.share, "share", 0.0, 1.0)
        check(self.share == 0.0 or bool(self.helper), "helper", self.helper, "a policy, if it has a share")
        for name in self.hide:
            check_choice(name, "hide", HIDEABLE)
