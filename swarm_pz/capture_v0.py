"""The game as a PettingZoo module: `from swarm_pz import capture_v0`."""

from swarm_pz.envs.parallel_env import env, parallel_env, raw_env

__all__ = ["env", "parallel_env", "raw_env"]
