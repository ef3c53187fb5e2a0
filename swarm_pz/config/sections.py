"""The sections of a game's configuration: every number stands here once, with the range it may take.

What divides has a least value: whatever is reckoned from numbers in their ranges is finite, in float32 too.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, Self, get_args

from swarm_pz.config.base import (
    Config,
    check,
    check_choice,
    check_count,
    check_number,
    hash_exempt,
)
from swarm_pz.config.constants import (
    CHANNELS,
    GRID_CELLS,
    LONGEST_TRAIL,
    MAX_MODES,
    MOTION_CHANNELS,
    TICKS_PER_SECOND,
)

Occasion = Literal["capture", "command", "sending"]
"""When something can be forgotten: a drone is captured, its team follows another command than before, or its team is
sent one, the same again too."""

_REMOVED = (("message_loss", 0.0), ("relay", False))
"""Options of the controller that this version no longer has, at the values of protocol 2 and of its players."""


@dataclass(frozen=True, kw_only=True)
class SpawnConfig(Config):
    """Where drones start, and how they move then.

    Attributes
    ----------
    inset : float
        Distance of the four corner points, or of the squares, from the walls, in map widths.
    radius : float
        Largest distance of a drone from its corner point, in map widths; not above `inset`.
    layout : {"corners", "squares"}
        Each drone near a corner point of its own drawing, or each team in a square of its own: red at
        the lower left, blue at the upper right.
    side : float
        Side of these squares, in map widths.
    speed : float
        Red's drones start with velocities drawn evenly from [0, speed] along each axis, blue's from [-speed, 0]; 0:
        at rest. Drawn after all else, so that the places of a seed's start do not depend on it.
    """

    inset: float = 0.1
    radius: float = 0.08
    layout: Literal["corners", "squares"] = hash_exempt("corners")
    side: float = hash_exempt(0.1)
    speed: float = hash_exempt(0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number(self.inset, "spawn.inset", 0.0, 0.5)
        check_number(self.radius, "spawn.radius", 0.0, self.inset if self.layout == "corners" else 0.5)
        check_choice(self.layout, "spawn.layout", ("corners", "squares"))
        check_number(self.side, "spawn.side", 0.0, 1.0 - self.inset)
        check_number(self.speed, "spawn.speed", 0.0, 10.0)


@dataclass(frozen=True, kw_only=True)
class MemoryConfig(Config):
    """How long the game and the controller remember where drones have been.

    Attributes
    ----------
    trail : float, optional
        Seconds that a cell stays on a drone's trail; whole ticks. None: as long as `time_limit`, and
        at most as long as there is room for.
    controller : float, optional
        Time constant tau of the controller's decaying memory, in seconds. None: nothing decays.
    trail_forgotten_on : tuple of {"capture", "command", "sending"}
        When a drone's trail is emptied. What is not forgotten on a capture moves to the new team.
    controller_forgotten_on : tuple of {"capture", "command", "sending"}
        When the controller's memory of a drone is emptied. "command": its team's target is another one than at
        the last solve. "sending": its team was sent a command since then, be it the same one again. Sent is what
        `Simulator.command` or somebody at the table gives. A step of an environment, and a policy at
        the table, holds what is in force where it asks for that again, and sends whatever else it asks for.
    """

    trail: float | None = 5.0
    controller: float | None = 4.0
    trail_forgotten_on: tuple[Occasion, ...] = hash_exempt(())
    controller_forgotten_on: tuple[Occasion, ...] = hash_exempt(("capture",))

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.trail is not None:
            check_number(self.trail, "memory.trail", 1 / TICKS_PER_SECOND, LONGEST_TRAIL)
            ticks = self.trail * TICKS_PER_SECOND
            check(abs(ticks - round(ticks)) < 1e-6, "memory.trail", self.trail, "a whole number of ticks of 1/30 s")
        if self.controller is not None:
            check_number(self.controller, "memory.controller", 0.01, 1e6)
        for name in ("trail_forgotten_on", "controller_forgotten_on"):
            occasions, known = getattr(self, name), get_args(Occasion)
            fits = isinstance(occasions, tuple) and all(occasion in known for occasion in occasions)
            check(fits, f"memory.{name}", occasions, f"a tuple of any of {', '.join(known)}")
            object.__setattr__(self, name, tuple(occasion for occasion in known if occasion in occasions))


@dataclass(frozen=True, kw_only=True)
class CaptureConfig(Config):
    """When a drone is captured.

    Attributes
    ----------
    enabled : bool
        Whether captures happen at all; without them no game is ever won.
    threshold : float
        A drone is captured where the opposing capture field exceeds this fraction of its maximum.
    field : {"occupancy", "reconstruction"}
        What the ring averages are taken of: the team's trails, or the density that its controller
        believes to cover, with the averages rescaled to [0, 1]; see `swarm_pz.kernels.reconstruction`.
    """

    enabled: bool = True
    threshold: float = 0.75
    field: Literal["occupancy", "reconstruction"] = hash_exempt("occupancy")

    def __post_init__(self) -> None:
        super().__post_init__()
        check(isinstance(self.enabled, bool), "capture.enabled", self.enabled, "True or False")
        check_number(self.threshold, "capture.threshold", 0.001, 0.999)
        check_choice(self.field, "capture.field", ("occupancy", "reconstruction"))


@dataclass(frozen=True, kw_only=True)
class ControllerConfig(Config):
    """The decentralized ergodic controller, the same for every team that it flies.

    Attributes
    ----------
    modes : int
        Fourier modes a side.
    horizon : int
        Points of the look-ahead, one control period apart.
    ergodic_weight : float
        Weight q of the ergodic cost.
    control_weight : float
        Weight R of the control effort.
    wall_weight : float
        Weight of the squared distance beyond the wall margin.
    wall_margin : float
        Distance from the walls, in map widths, at which the wall cost begins.
    max_acceleration : float
        Largest magnitude of an acceleration, in map widths per second squared; of any controller.
    spectrum : {"sobolev", "exponential"}
        Weights Lambda_k of the modes: (1 + |k|^2)^(-3/2), or exp(-0.8 |k|).
    communication_radius : float, optional
        Drones average over the team-mates within this distance, in map widths; None: over all.
    target_mass : float
        What a target that was sent sums to, as the controller sees it: it compares c_k with this times the phi_k
        of a density. The uniform target of the start, which nobody sent, sums to 1.
    warm_start : bool
        Whether a solve looks ahead along the controls that the last one planned, as the authors' code does; False: as
        if drones coasted. A drone that is captured keeps its plan. Where another system flies a team, its drones have
        none, and coast.
    """

    modes: int = 10
    horizon: int = 10
    ergodic_weight: float = 200.0
    control_weight: float = 0.1
    wall_weight: float = 100.0
    wall_margin: float = 0.05
    max_acceleration: float = 1.0
    spectrum: Literal["sobolev", "exponential"] = hash_exempt("sobolev")
    communication_radius: float | None = hash_exempt(None)
    target_mass: float = hash_exempt(1.0)
    warm_start: bool = hash_exempt(False)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Build it from plain values, in which frozen protocols and players name two options more: both are off."""
        if isinstance(values, Mapping):
            values = {name: value for name, value in values.items() if (name, value) not in _REMOVED}
        return super().from_dict(values)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_count(self.modes, "controller.modes", 2, MAX_MODES)
        check_count(self.horizon, "controller.horizon", 2, 100)
        check_number(self.ergodic_weight, "controller.ergodic_weight", 0.0, 1e6)
        check_number(self.control_weight, "controller.control_weight", 1e-4, 1e6)
        check_number(self.wall_weight, "controller.wall_weight", 0.0, 1e6)
        check_number(self.wall_margin, "controller.wall_margin", 0.0, 0.5)
        check_number(self.max_acceleration, "controller.max_acceleration", 1e-9, 100.0)
        check_choice(self.spectrum, "controller.spectrum", ("sobolev", "exponential"))
        if self.communication_radius is not None:
            check_number(self.communication_radius, "controller.communication_radius", 0.0, 2.0)
        check_number(self.target_mass, "controller.target_mass", 1e-3, 1e3)
        check(isinstance(self.warm_start, bool), "controller.warm_start", self.warm_start, "True or False")


@dataclass(frozen=True, kw_only=True)
class FlockingConfig(Config):
    """Flocking; see `swarm_pz.kernels.controllers.flocking` for what the numbers weigh.

    Attributes
    ----------
    alignment, cohesion, separation : float
        Weights of the neighbours' mean velocity, of their mean position, and of keeping apart.
    migration : (float, float)
        Least and largest weight of an attractor.
    communication_radius : float
        Distance up to which team-mates are neighbours, in map widths.
    separation_radius : float
        Distance below which they push each other away, in map widths.
    max_turn : float
        Largest turn in one control period, in radians.
    speed : float
        Velocity that drones aim at; map widths per second where the speed factor is 1.
    dwell : float
        Seconds that each attractor of a command is in force before the next one is; the last one stays.
    """

    alignment: float = 0.1
    cohesion: float = 0.1
    separation: float = 0.15
    migration: tuple[float, float] = (50.0, 100.0)
    communication_radius: float = 0.15
    separation_radius: float = 0.05
    max_turn: float = math.pi / 10
    speed: float = 0.25
    dwell: float = hash_exempt(5.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("alignment", "cohesion", "separation"):
            check_number(getattr(self, name), f"flocking.{name}", 0.0, 1e6)
        is_pair = isinstance(self.migration, tuple) and len(self.migration) == 2
        check(is_pair, "flocking.migration", self.migration, "a pair (least, largest)")
        least, largest = self.migration
        check_number(least, "flocking.migration[0]", 0.0, 1e6)
        check_number(largest, "flocking.migration[1]", least, 1e6)
        object.__setattr__(self, "migration", (float(least), float(largest)))
        check_number(self.communication_radius, "flocking.communication_radius", 0.0, 2.0)
        check_number(self.separation_radius, "flocking.separation_radius", 0.0, 2.0)
        check_number(self.max_turn, "flocking.max_turn", 1e-3, math.pi)
        check_number(self.speed, "flocking.speed", 1e-3, 10.0)
        check_number(self.dwell, "flocking.dwell", 0.1, 1e6)


@dataclass(frozen=True, kw_only=True)
class DynamicsConfig(Config):
    """How drones move, and how they fail.

    Attributes
    ----------
    speed_factor : float
        Map widths travelled per unit of velocity: p' = speed_factor v. The controller knows it.
    failure_rate : float
        Failures of a working drone per second. A failed one stands still, says and hears nothing and
        leaves no trail; it can be captured where it stands.
    repair_rate : float
        Returns of a failed drone to work, with an empty memory, per second.
    min_speed : float
        Least airspeed, in units of velocity, as of fixed-wing drones: a slower one is brought to it along its heading,
        from rest towards the middle, and walls turn velocities round. 0: drones may stop, and walls stop them. Drones
        that must fly cannot fail.
    """

    speed_factor: float = 1.0
    failure_rate: float = 0.0
    repair_rate: float = 0.0
    min_speed: float = hash_exempt(0.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number(self.speed_factor, "dynamics.speed_factor", 1e-3, 10.0)
        check_number(self.failure_rate, "dynamics.failure_rate", 0.0, 1e3)
        check_number(self.repair_rate, "dynamics.repair_rate", 0.0, 1e3)
        check_number(self.min_speed, "dynamics.min_speed", 0.0, 2.0)
        stands = self.min_speed == 0.0 or self.failure_rate == 0.0
        check(stands, "dynamics.failure_rate", self.failure_rate, "0 with a min_speed: failed drones stand still")


@dataclass(frozen=True, kw_only=True)
class ObservationConfig(Config):
    """What one side sees.

    Attributes
    ----------
    kind : {"grids", "entities", "drones"}
        Images, channel first; padded and masked lists of drones; or one row for every drone, by its number.
    grid : int
        Cells a side of the images; divides 50.
    channels : tuple of str
        What the images show, in this order; see `swarm_pz.spaces.observation`. What nobody looks at costs
        no time.
    """

    kind: Literal["grids", "entities", "drones"] = "grids"
    grid: int = GRID_CELLS
    channels: tuple[str, ...] = CHANNELS

    def __post_init__(self) -> None:
        super().__post_init__()
        every = CHANNELS + MOTION_CHANNELS
        known = isinstance(self.channels, tuple) and all(channel in every for channel in self.channels)
        fits = known and 0 < len(self.channels) == len(set(self.channels))
        check(fits, "observation.channels", self.channels, f"different ones of {', '.join(every)}")
        check_choice(self.kind, "observation.kind", ("grids", "entities", "drones"))
        check_count(self.grid, "observation.grid", 1, GRID_CELLS)
        check(GRID_CELLS % self.grid == 0, "observation.grid", self.grid, f"a divisor of {GRID_CELLS}")


@dataclass(frozen=True, kw_only=True)
class RewardConfig(Config):
    """Weights of the reward's terms; the reward is zero-sum whatever they are.

    Attributes
    ----------
    size_change : float
        Weight of the team's change of size over the mean starting size of a team.
    outcome : float
        Weight of +1 for a win and -1 for a loss.
    """

    size_change: float = 1.0
    outcome: float = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number(self.size_change, "reward.size_change", -1e6, 1e6)
        check_number(self.outcome, "reward.outcome", -1e6, 1e6)
