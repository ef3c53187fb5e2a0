"""Settings of a lab whose robots fly games."""

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
        Largest speed of a game, in seconds of game per second.
    frame : str
        Name of the lab's coordinate frame, which poses use.
    scale : float
        Side of the map.
    corner : (float, float)
        x and y of the map's lower left corner.
    altitudes : (float, float)
        Altitudes of the first and of the last drone; the others' are evenly between them.
    separation : float
        Least horizontal distance between two setpoints.
    max_speed : float
        Largest speed of setpoints; faster poses count as jumps.
    leash : float
        Largest distance of a setpoint from its drone.
    late : float
        A drone holds its place if its last pose is older than this.
    lost : float
        A drone has failed if its last pose is older than this.
    fence : float
        A drone has failed if it is farther than this outside the map, or above or below all altitudes.
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
"""The settings of a lab, and the token with which its bridge connects to the server."""
