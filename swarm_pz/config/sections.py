"""The sections of a game's configuration: every number, its default and its range.

Divisors are bounded away from 0: all results of numbers in their ranges are finite, in float32 too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, Self, get_args

from swarm_pz.config.base import Config, Range, Share, ToMillion, check, hash_exempt
from swarm_pz.config.constants import (
    CHANNELS,
    GRID_CELLS,
    LONGEST_TRAIL,
    MAX_MODES,
    MOTION_CHANNELS,
    TICKS_PER_SECOND,
)

Occasion = Literal["capture", "command", "sending"]
"""Occasions of forgetting: a drone is captured, its team follows a new command, or its team is sent any command."""

_REMOVED = (("message_loss", 0.0), ("relay", False))
"""Removed options of the controller, with the values that files of protocol 2 and its players still hold."""


@dataclass(frozen=True, kw_only=True)
class SpawnConfig(Config):
    """Positions and velocities of drones at the start."""

    _section: ClassVar[str] = "spawn"

    inset: Annotated[float, Range(0.0, 0.5)] = 0.1
    """Distance of the four corner points, or of the squares, from the walls, in map widths."""
    radius: Annotated[float, Range(0.0, 0.5)] = 0.08
    """Largest distance of a drone from its corner point, in map widths; not above `inset`."""
    layout: Literal["corners", "squares"] = hash_exempt("corners")
    """With "corners", each drone starts near a corner point drawn at random for it.
    With "squares", each team starts in a square: red at the lower left, blue at the upper right."""
    side: Share = hash_exempt(0.1)
    """Side of the squares, in map widths."""
    speed: Annotated[float, Range(0.0, 10.0)] = hash_exempt(0.0)
    """Red's drones start with velocities drawn evenly from [0, speed] along each axis, blue's from [-speed, 0].
    0: at rest. Velocities are drawn last, so that a seed's starting places do not depend on them."""

    def __post_init__(self) -> None:
        super().__post_init__()
        fits = self.layout == "squares" or self.radius <= self.inset
        check(fits, "spawn.radius", self.radius, f"at most spawn.inset, {self.inset:g}")
        check(self.side <= 1.0 - self.inset, "spawn.side", self.side, f"at most 1 - spawn.inset, {1 - self.inset:g}")


@dataclass(frozen=True, kw_only=True)
class MemoryConfig(Config):
    """Lengths of trails and of the controller's memory."""

    _section: ClassVar[str] = "memory"

    trail: Annotated[float, Range(1 / TICKS_PER_SECOND, LONGEST_TRAIL)] | None = 5.0
    """Seconds that a cell stays on a drone's trail; whole ticks.
    None: as long as `time_limit`, but at most the longest that is allowed."""
    controller: Annotated[float, Range(0.01, 1e6)] | None = 4.0
    """Time constant tau of the controller's decaying memory, in seconds. None: nothing decays."""
    trail_forgotten_on: tuple[Occasion, ...] = hash_exempt(())
    """Occasions on which a drone's trail is emptied. A trail that a capture does not empty moves to the new team."""
    controller_forgotten_on: tuple[Occasion, ...] = hash_exempt(("capture",))
    """When the controller's memory of a drone is emptied. "command": its team's target differs from the last solve's.
    "sending": since then its team was sent a command, even the same, by `Simulator.command` or a person at the table.
    Environment steps, and policies at the table, send only changed commands."""

    def __post_init__(self) -> None:
        super().__post_init__()
        ticks = (self.trail or 0.0) * TICKS_PER_SECOND
        check(abs(ticks - round(ticks)) < 1e-6, "memory.trail", self.trail, "a whole number of ticks of 1/30 s")
        for name in ("trail_forgotten_on", "controller_forgotten_on"):
            occasions = getattr(self, name)
            object.__setattr__(self, name, tuple(one for one in get_args(Occasion) if one in occasions))


@dataclass(frozen=True, kw_only=True)
class CaptureConfig(Config):
    """When a drone is captured."""

    _section: ClassVar[str] = "capture"

    enabled: bool = True
    """Whether drones can be captured; without captures, no game is won."""
    threshold: Annotated[float, Range(0.001, 0.999)] = 0.75
    """A drone is captured where the opposing capture field exceeds this fraction of its maximum."""
    field: Literal["occupancy", "reconstruction"] = hash_exempt("occupancy")
    """Ring averages of the team's trails ("occupancy"), or of the density that its controller's coefficients give,
    rescaled to [0, 1] ("reconstruction"; see `swarm_pz.kernels.reconstruction`)."""


@dataclass(frozen=True, kw_only=True)
class ControllerConfig(Config):
    """The decentralized ergodic controller, the same for every team that uses it."""

    _section: ClassVar[str] = "controller"

    modes: Annotated[int, Range(2, MAX_MODES)] = 10
    """Fourier modes per axis."""
    horizon: Annotated[int, Range(2, 100)] = 10
    """Points of the look-ahead, one control period apart."""
    ergodic_weight: ToMillion = 200.0
    """Weight q of the ergodic cost."""
    control_weight: Annotated[float, Range(1e-4, 1e6)] = 0.1
    """Weight R of the control effort."""
    wall_weight: ToMillion = 100.0
    """Weight of the squared distance beyond the wall margin."""
    wall_margin: Annotated[float, Range(0.0, 0.5)] = 0.05
    """Distance from the walls, in map widths, at which the wall cost begins."""
    max_acceleration: Annotated[float, Range(1e-9, 100.0)] = 1.0
    """Largest magnitude of an acceleration, in map widths per second squared; of any controller."""
    spectrum: Literal["sobolev", "exponential"] = hash_exempt("sobolev")
    """Weights Lambda_k of the modes: (1 + |k|^2)^(-3/2), or exp(-0.8 |k|)."""
    communication_radius: Annotated[float, Range(0.0, 2.0)] | None = hash_exempt(None)
    """Drones average over the team-mates within this distance, in map widths; None: over all."""
    target_mass: Annotated[float, Range(1e-3, 1e3)] = hash_exempt(1.0)
    """Mass of a target that was sent: the controller compares c_k with this factor times phi_k of the density.
    The uniform target at the start has mass 1."""
    warm_start: bool = hash_exempt(False)
    """A solve looks ahead along the controls that the last solve planned, as in the authors' code.
    False: it assumes that drones coast. A captured drone keeps its plan; drones that another system flies have none."""

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Build it from plain values, ignoring two removed options that frozen protocols and players name, both off."""
        if isinstance(values, Mapping):
            values = {name: value for name, value in values.items() if (name, value) not in _REMOVED}
        return super().from_dict(values)


@dataclass(frozen=True, kw_only=True)
class FlockingConfig(Config):
    """Flocking; `swarm_pz.kernels.controllers.flocking` has the equations."""

    _section: ClassVar[str] = "flocking"

    alignment: ToMillion = 0.1
    """Weight of the neighbours' mean velocity."""
    cohesion: ToMillion = 0.1
    """Weight of the neighbours' mean position."""
    separation: ToMillion = 0.15
    """Weight of the separation from close team-mates."""
    migration: tuple[ToMillion, ToMillion] = (50.0, 100.0)
    """Least and largest weight of an attractor."""
    communication_radius: Annotated[float, Range(0.0, 2.0)] = 0.15
    """Distance up to which team-mates are neighbours, in map widths."""
    separation_radius: Annotated[float, Range(0.0, 2.0)] = 0.05
    """Distance below which team-mates push each other away, in map widths."""
    max_turn: Annotated[float, Range(1e-3, math.pi)] = math.pi / 10
    """Largest turn in one control period, in radians."""
    speed: Annotated[float, Range(1e-3, 10.0)] = 0.25
    """Speed that drones aim at; in map widths per second if the speed factor is 1."""
    dwell: Annotated[float, Range(0.1, 1e6)] = hash_exempt(5.0)
    """Seconds for which each attractor of a command is in force; the last one stays."""

    def __post_init__(self) -> None:
        super().__post_init__()
        check(self.migration[0] <= self.migration[1], "flocking.migration", self.migration, "(least, largest)")


@dataclass(frozen=True, kw_only=True)
class DynamicsConfig(Config):
    """Motion and failures of drones."""

    _section: ClassVar[str] = "dynamics"

    speed_factor: Annotated[float, Range(1e-3, 10.0)] = 1.0
    """Map widths travelled per unit of velocity: p' = speed_factor v. The controller knows it."""
    failure_rate: Annotated[float, Range(0.0, 1e3)] = 0.0
    """Failures of a working drone per second. A failed drone stands still, sends and hears nothing and leaves no trail.
    It can be captured where it stands."""
    repair_rate: Annotated[float, Range(0.0, 1e3)] = 0.0
    """Repairs of a failed drone per second; it returns to work with an empty memory."""
    min_speed: Annotated[float, Range(0.0, 2.0)] = hash_exempt(0.0)
    """Least airspeed, in units of velocity, as of fixed-wing drones. 0: drones may stop, and walls stop them.
    Above 0, a slower drone is sped up along its heading, from rest towards the middle; walls reverse velocities."""

    def __post_init__(self) -> None:
        super().__post_init__()
        stands = self.min_speed == 0.0 or self.failure_rate == 0.0
        check(stands, "dynamics.failure_rate", self.failure_rate, "0 with a min_speed: failed drones stand still")


@dataclass(frozen=True, kw_only=True)
class ObservationConfig(Config):
    """Observation of one side."""

    _section: ClassVar[str] = "observation"

    kind: Literal["grids", "entities", "drones"] = "grids"
    """Images, channel first; padded and masked lists of drones; or a row for each drone, by its number."""
    grid: Annotated[int, Range(1, GRID_CELLS)] = GRID_CELLS
    """Cells per side of the images; must divide 50."""
    channels: tuple[str, ...] = CHANNELS
    """The images' channels, in order; see `swarm_pz.spaces.observation`."""

    def __post_init__(self) -> None:
        super().__post_init__()
        every = CHANNELS + MOTION_CHANNELS
        fits = set(self.channels) <= set(every) and 0 < len(self.channels) == len(set(self.channels))
        check(fits, "observation.channels", self.channels, f"different ones of {', '.join(every)}")
        check(GRID_CELLS % self.grid == 0, "observation.grid", self.grid, f"a divisor of {GRID_CELLS}")


@dataclass(frozen=True, kw_only=True)
class RewardConfig(Config):
    """Weights of the reward's terms; the reward is zero-sum for all weights."""

    _section: ClassVar[str] = "reward"

    size_change: Annotated[float, Range(-1e6, 1e6)] = 1.0
    """Weight of the team's change of size over the mean starting size of a team."""
    outcome: Annotated[float, Range(-1e6, 1e6)] = 1.0
    """Weight of +1 for a win and -1 for a loss."""
