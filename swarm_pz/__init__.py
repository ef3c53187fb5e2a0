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
from swarm_pz.policy import Policy, PrivilegedPolicy
from swarm_pz.simulator import Simulator

__all__ = [
    "CaptureConfig",
    "ControllerConfig",
    "DynamicsConfig",
    "FlockingConfig",
    "GameConfig",
    "MemoryConfig",
    "ObservationConfig",
    "Policy",
    "PrivilegedPolicy",
    "RewardConfig",
    "Simulator",
    "SpawnConfig",
    "drones_env",
    "env",
    "parallel_env",
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
