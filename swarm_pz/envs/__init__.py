"""The environments: many games at once, and a wrapper for each library's interface."""

from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.envs.drones_env import DronesEnv
from swarm_pz.envs.gymnasium_env import DuelEnv
from swarm_pz.envs.gymnasium_vector_env import DuelVectorEnv
from swarm_pz.envs.one_game import STATE_CHANNELS
from swarm_pz.envs.parallel_env import CaptureEnv

__all__ = ["STATE_CHANNELS", "BatchEnv", "CaptureEnv", "DronesEnv", "DuelEnv", "DuelVectorEnv"]
