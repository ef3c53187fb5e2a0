"""Measurements of the game, its controllers and the simulator, for the documentation."""
