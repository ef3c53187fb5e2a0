"""Training of tactics with Stable-Baselines3."""
