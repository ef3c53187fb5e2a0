"""The rules of a game as nested, frozen, keyword-only dataclasses; control systems; constants of all games."""

from swarm_pz.config.constants import (
    AGENTS,
    BLUE,
    CHANNELS,
    CONTROL_PERIOD,
    GRID_CELLS,
    MAX_MODES,
    MOTION_CHANNELS,
    RED,
    SOON,
    TEAM_NAMES,
    TICKS_PER_CONTROL_PERIOD,
    TICKS_PER_SECOND,
)
from swarm_pz.config.game import GameConfig, resolve
from swarm_pz.config.presets import PRESETS
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

__all__ = [
    "AGENTS",
    "BLUE",
    "CHANNELS",
    "CONTROL_PERIOD",
    "GRID_CELLS",
    "MAX_MODES",
    "MOTION_CHANNELS",
    "PRESETS",
    "RED",
    "SOON",
    "TEAM_NAMES",
    "TICKS_PER_CONTROL_PERIOD",
    "TICKS_PER_SECOND",
    "CaptureConfig",
    "ControllerConfig",
    "DynamicsConfig",
    "FlockingConfig",
    "GameConfig",
    "MemoryConfig",
    "ObservationConfig",
    "RewardConfig",
    "SpawnConfig",
    "resolve",
]
