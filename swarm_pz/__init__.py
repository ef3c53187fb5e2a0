"""swarm-pz: two swarms, each trying to capture the other; a benchmark for tactics."""

from importlib.metadata import version

import gymnasium
import pettingzoo

from swarm_pz.config import (
    CaptureConfig,
    ControllerConfig,
    DynamicsConfig,
    FlockingConfig,
    GameConfig,
    MemoryConfig,
    ObservationConfig,
    RewardConfig,
    SpawnConfig,
)
from swarm_pz.envs.drones_env import drones_env
from swarm_pz.envs.parallel_env import env, parallel_env
from swarm_pz.errors import (
    CheckpointError,
    CommandError,
    ConfigError,
    FlightError,
    GameOverError,
    MissingExtraError,
    OutputError,
    PolicyError,
    ProtocolError,
    RecordingError,
    RenderError,
    ResultsError,
    SwarmError,
    UnknownNameError,
)
from swarm_pz.evaluation.match import paired_difference, play_match
from swarm_pz.policy import Policy, PrivilegedPolicy
from swarm_pz.simulator import Simulator
from swarm_pz.systems import FlockingCommand

__all__ = [
    "CaptureConfig",
    "CheckpointError",
    "CommandError",
    "ConfigError",
    "ControllerConfig",
    "DynamicsConfig",
    "FlightError",
    "FlockingCommand",
    "FlockingConfig",
    "GameConfig",
    "GameOverError",
    "MemoryConfig",
    "MissingExtraError",
    "ObservationConfig",
    "OutputError",
    "Policy",
    "PolicyError",
    "PrivilegedPolicy",
    "ProtocolError",
    "RecordingError",
    "RenderError",
    "ResultsError",
    "RewardConfig",
    "Simulator",
    "SpawnConfig",
    "SwarmError",
    "UnknownNameError",
    "drones_env",
    "env",
    "paired_difference",
    "parallel_env",
    "play_match",
]
__version__ = version("swarm-pz")

_ID = "swarm_pz/Capture-v0"
pettingzoo.register("parallel", _ID, "swarm_pz.envs.parallel_env:parallel_env")
pettingzoo.register("aec", _ID, "swarm_pz.envs.parallel_env:env")
gymnasium.register(
    _ID,
    entry_point="swarm_pz.envs.gymnasium_env:DuelEnv",
    vector_entry_point="swarm_pz.envs.gymnasium_vector_env:DuelVectorEnv",
)
