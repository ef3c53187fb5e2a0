"""Training of tactics with Stable-Baselines3."""

from swarm_pz import policies  # noqa: F401  (before torch: see there)
