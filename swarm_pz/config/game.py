"""A whole game as one frozen dataclass of sections."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from swarm_pz.config.base import PER_TEAM, Config, Range, canonical, check, digest, hash_exempt
from swarm_pz.config.constants import (
    CONTROL_PERIOD,
    GRID_CELLS,
    LONGEST_TRAIL,
    TICKS_PER_CONTROL_PERIOD,
    TICKS_PER_SECOND,
)
from swarm_pz.config.presets import PRESETS
from swarm_pz.config.registry import is_installed, read_choice, system_of
from swarm_pz.config.sections import (
    CaptureConfig,
    ControllerConfig,
    DynamicsConfig,
    FlockingConfig,
    MemoryConfig,
    ObservationConfig,
    RewardConfig,
    SpawnConfig,
)
from swarm_pz.config.system import ControlSystem
from swarm_pz.errors import ConfigError, UnknownNameError, nearest

Controller = str | ControlSystem
"""The name of an installed control system, or an object with its own parameters."""
TeamSize = Annotated[int, Range(0, 10_000)]
Duration = Annotated[float, Range(CONTROL_PERIOD, 1e6)]
_NOT_RULES = ("observation", "reward")
"""Fields of a `GameConfig` that change no game between two policies."""


@dataclass(frozen=True, kw_only=True)
class GameConfig(Config):
    """A whole game: rules, controller, observation and reward.

    A pair of values is (red, blue). Where one learner plays against an opponent (Gymnasium, Stable-Baselines3,
    `drones_env`, training), every pair is (learner, opponent), on either side. In a match, where policies play both
    sides, only `controllers` is (policy, opponent). A pair of two equal values is the same as that value.

    Examples
    --------
    >>> GameConfig(drones_per_team=24).team_sizes
    (24, 24)
    >>> GameConfig(capture=CaptureConfig(enabled=False)).capture.threshold
    0.75
    """

    drones_per_team: TeamSize | tuple[TeamSize, TeamSize] = field(default=10, metadata=PER_TEAM)
    """Drones of each team at the start; a pair of numbers gives one side a handicap."""
    time_limit: Duration = 300.0
    """Seconds after which the game is a draw; whole control periods."""
    command_period: Duration = 1.0
    """Seconds for which one environment step holds a command; whole control periods."""
    command_cells: Annotated[int, Range(2, GRID_CELLS)] = 10
    """Cells per side of a command."""
    spawn: SpawnConfig = field(default_factory=SpawnConfig)
    memory: MemoryConfig = field(default_factory=MemoryConfig)
    capture: CaptureConfig = field(default_factory=CaptureConfig)
    controller: ControllerConfig = field(default_factory=ControllerConfig)
    observation: ObservationConfig | tuple[ObservationConfig, ObservationConfig] = field(
        default_factory=ObservationConfig, metadata=PER_TEAM
    )
    """Observations of the agents."""
    reward: RewardConfig = field(default_factory=RewardConfig)
    controllers: Controller | tuple[Controller, Controller] = hash_exempt("ergodic", PER_TEAM)
    """Names of control systems (`swarm_pz.systems`), or systems with other parameters."""
    flocking: FlockingConfig = hash_exempt(FlockingConfig())
    dynamics: DynamicsConfig = hash_exempt(DynamicsConfig())

    def __post_init__(self) -> None:
        choices = self.controllers
        read = tuple(map(read_choice, choices)) if isinstance(choices, (list, tuple)) else read_choice(choices)
        object.__setattr__(self, "controllers", read)
        super().__post_init__()
        # A team without drones has lost already, unless nobody can be captured.
        is_legal = min(self.team_sizes) > 0 or not self.capture.enabled
        check(is_legal, "drones_per_team", self.drones_per_team, "at least 1 for each team, unless captures are off")
        check(sum(self.team_sizes) > 0, "drones_per_team", self.drones_per_team, "at least one drone in all")
        for name in ("time_limit", "command_period"):
            seconds = getattr(self, name)
            periods = seconds / CONTROL_PERIOD
            check(abs(periods - round(periods)) < 1e-6, name, seconds, "a whole number of control periods of 0.1 s")

    @classmethod
    def preset(cls, name: str) -> GameConfig:
        """Return a named variant of the rules; raise a ConfigError if there is no such preset."""
        if not isinstance(name, str) or name not in PRESETS:
            raise ConfigError(f"there is no preset {name!r}; {nearest(str(name), PRESETS)}")
        return cls(**PRESETS[name])

    def to_dict(self) -> dict[str, Any]:
        """Return plain values; raise a ConfigError if a control system is not installed, since files name it."""
        for system in self._controllers:
            if isinstance(system, ControlSystem) and not is_installed(type(system)):
                raise ConfigError(
                    f"controllers: files name control systems, and {system.name} is not installed: register it under "
                    "the entry points swarm_pz.systems, as docs/tutorials/system.md shows"
                )
        return super().to_dict()

    @property
    def rules(self) -> dict[str, Any]:
        """Plain values of all fields but `observation` and `reward`, which change no game between two policies."""
        return {name: value for name, value in self.to_dict().items() if name not in _NOT_RULES}

    @property
    def rules_hash(self) -> str:
        """Sixteen hexadecimal digits that are the same for equal rules; comparable results share them.

        Times are rounded to ticks first, so 0.3 and 0.1 + 0.2 s are equal.
        """
        ticks = (self.limit_ticks, self.step_ticks, round((self.memory.trail or 0.0) * TICKS_PER_SECOND))
        limit, period, trail = (count / TICKS_PER_SECOND for count in ticks)
        memory = self.memory.replace(trail=trail if self.memory.trail is not None else None)
        plain = canonical(self.replace(time_limit=limit, command_period=period, memory=memory))
        return digest({name: value for name, value in plain.items() if name not in _NOT_RULES})

    @property
    def team_sizes(self) -> tuple[int, int]:
        """Drones of (red, blue) at the start."""
        sizes = self.drones_per_team
        return (sizes[0], sizes[1]) if isinstance(sizes, tuple) else (sizes, sizes)

    @property
    def num_drones(self) -> int:
        """Drones of both teams together, which never changes."""
        return sum(self.team_sizes)

    @property
    def observations(self) -> tuple[ObservationConfig, ObservationConfig]:
        """Observations of (red, blue)."""
        observation = self.observation
        return observation if isinstance(observation, tuple) else (observation, observation)

    @property
    def _controllers(self) -> tuple[Controller, ...]:
        both = self.controllers
        return both if isinstance(both, tuple) else (both, both)

    @property
    def team_controllers(self) -> tuple[str, str]:
        """Names of the control systems that fly (red, blue)."""
        red, blue = (one if isinstance(one, str) else one.name for one in self._controllers)
        return red, blue

    @property
    def team_systems(self) -> tuple[ControlSystem, ControlSystem]:
        """The control systems that fly (red, blue)."""
        red, blue = map(system_of, self._controllers)
        return red, blue

    @property
    def tells_sending(self) -> bool:
        """True if resending the command in force has an effect."""
        memory = self.memory
        forgets = "sending" in (*memory.trail_forgotten_on, *memory.controller_forgotten_on)
        return forgets or self.controller.target_mass != 1.0

    @property
    def trail_ticks(self) -> int:
        """Length of a trail, in ticks."""
        seconds = min(self.time_limit, LONGEST_TRAIL) if self.memory.trail is None else self.memory.trail
        return round(seconds * TICKS_PER_SECOND)

    @property
    def step_ticks(self) -> int:
        """Ticks of one environment step."""
        return round(self.command_period / CONTROL_PERIOD) * TICKS_PER_CONTROL_PERIOD

    @property
    def limit_ticks(self) -> int:
        """Ticks until the time limit."""
        return round(self.time_limit / CONTROL_PERIOD) * TICKS_PER_CONTROL_PERIOD


def resolve(
    config: GameConfig | Mapping[str, Any] | None,
    overrides: Mapping[str, Any],
    wrapper: type,
    more: Iterable[str] = (),
) -> GameConfig:
    """Return a configuration (or that of a dict, or the keyword `preset`) with fields replaced by a wrapper's keywords.

    Raises an UnknownNameError if a keyword is unknown, which lists those of the wrapper's constructor and `more`,
    and a ConfigError if a value is out of range, or config and preset are both given.
    """
    fields = dict(overrides)
    preset = fields.pop("preset", None)
    for name in fields:
        if name not in GameConfig.__dataclass_fields__:
            named = inspect.signature(wrapper).parameters.values()
            known = {"preset", *more, *GameConfig.__dataclass_fields__}
            known |= {parameter.name for parameter in named if parameter.kind is not parameter.VAR_KEYWORD}
            # Python's own words: libraries look for them to find out which arguments to leave out.
            argument = f"{wrapper.__name__}() got an unexpected keyword argument {name!r}"
            raise UnknownNameError(f"{argument}; {nearest(name, known)}")
    if preset is not None:
        check(config is None, "preset", preset, "given alone, not beside a config")
        config = GameConfig.preset(preset)
    config = (
        GameConfig.from_dict(config) if isinstance(config, Mapping) else config if config is not None else GameConfig()
    )
    check(isinstance(config, GameConfig), "config", config, "a GameConfig, or its dict")
    return config.replace(**fields)
