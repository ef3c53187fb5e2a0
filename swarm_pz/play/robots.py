"""The numbers of a lab whose robots fly games."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from swarm_pz.config.base import Config, Range, check


@dataclass(frozen=True, kw_only=True)
class RobotsConfig(Config):
    """A lab, its frame and its limits, in m and s; the map is a square there.

    Attributes
    ----------
    speed : float
        Seconds of game a second, at most.
    frame : str
        Name of the lab's frame, in which poses come.
    scale : float
        Side of the map.
    corner : (float, float)
        x and y of the map's lower left corner.
    altitudes : (float, float)
        Altitudes of the first and of the last drone; the others' are evenly between them.
    separation : float
        Least horizontal distance between two setpoints.
    max_speed : float
        Of setpoints; poses that change faster are jumps.
    leash : float
        Largest distance of a setpoint from its drone.
    late : float
        A drone holds its place once its last pose is so old.
    lost : float
        A drone has failed once its last pose is so old.
    fence : float
        A drone has failed that is so far outside of the map, or above or below all altitudes.
    """

    speed: Annotated[float, Range(0.25, 2.0)] = 0.5
    frame: str = "world"
    scale: Annotated[float, Range(0.1, 1000.0)] = 3.0
    corner: tuple[float, float] = (-1.5, -1.5)
    altitudes: tuple[float, float] = (0.5, 1.4)
    separation: Annotated[float, Range(0.0, 100.0)] = 0.3
    max_speed: Annotated[float, Range(0.01, 100.0)] = 2.0
    leash: Annotated[float, Range(0.01, 100.0)] = 0.5
    late: Annotated[float, Range(0.04, 60.0)] = 0.2
    lost: Annotated[float, Range(0.04, 60.0)] = 1.0
    fence: Annotated[float, Range(0.0, 100.0)] = 0.3

    def __post_init__(self) -> None:
        super().__post_init__()
        check(self.altitudes[0] <= self.altitudes[1], "robots.altitudes", self.altitudes, "(lowest, highest)")
        check(self.late <= self.lost, "robots.late", self.late, f"at most lost, {self.lost:g}")


Lab = tuple[RobotsConfig, str]
"""The numbers of a lab, and the token by which the bridge to it reaches the server."""
