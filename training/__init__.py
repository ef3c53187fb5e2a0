"""Training of tactics with Stable-Baselines3."""

import policies  # noqa: F401  (before torch: see there)
