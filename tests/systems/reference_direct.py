"""Direct control, slowly, from the equation of docs/control_systems.md, drone by drone in float64."""

from __future__ import annotations

import math

import numpy as np

from swarm_pz.config import CaptureConfig, ControllerConfig, GameConfig
from swarm_pz.simulator import Simulator


def compare(states: int, seed: int) -> float:
    """Compare games of one tick with the equation; return the worst error over the largest acceleration."""
    generator, worst = np.random.default_rng(seed), 0.0
    for number in range(states):
        drones, largest = int(generator.integers(1, 41)), 1.0 if number % 2 else 0.3
        config = GameConfig(
            drones_per_team=(drones, 0),
            controllers="direct",
            controller=ControllerConfig(max_acceleration=largest),
            capture=CaptureConfig(enabled=False),
        )
        simulator = Simulator(config)
        simulator.reset([number], scenario={"teams": generator.integers(2, size=drones)})
        commands = generator.uniform(-1, 1, (2, drones, 2))
        for team in range(2):
            simulator.command(team, commands[team][None])
        simulator.advance(1)
        for i, team in enumerate(simulator.teams[0]):
            row = commands[team, i]
            expected = [largest * part / max(1.0, math.hypot(*row)) for part in row]
            worst = max(worst, float(np.abs(simulator.games.accelerations[0, i] - expected).max()) / largest)
    return worst
