"""Compile the machine code that tests in several processes need, before each process compiles it for itself.

    python -m tests.kernels.compiled

Each kind of rules in `KINDS` needs its own machine code, since its arguments have other types.
"""

from __future__ import annotations

import numpy as np

from swarm_pz.config import GameConfig, MemoryConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.kernels.step import solve
from swarm_pz.simulator import CheckedCommands, Simulator

KINDS = {
    "paper": GameConfig(),
    "variants": GameConfig(controllers="flocking"),
    "coverage": GameConfig(controllers="coverage"),
    "potential field": GameConfig(controllers="potential_field"),
    "kernel ergodic": GameConfig(controllers="kernel_ergodic"),
    "released": GameConfig.preset("released"),
    "endless trails": GameConfig(memory=MemoryConfig(trail=None)),
    "the controller alone": None,
}


def make(kind: str) -> None:
    """Compile what games of a kind need, unless it is on disk already."""
    if (config := KINDS[kind]) is None:
        simulator = Simulator()
        simulator.reset([0])
        solve(simulator.games, simulator.controller)
        return
    env = BatchEnv(config)
    env.reset([0])
    games, control = env.simulator.games, env.simulator.control
    density = np.ones((1, config.command_cells, config.command_cells))
    sides = [control.read(density, games, np.zeros(1, int), team, "density", "densities") for team in range(2)]
    env.step(CheckedCommands(np.stack(sides, axis=1)))
    for team, observation in enumerate(config.observations):
        env.observe(observation, team)


if __name__ == "__main__":
    for kind in KINDS:  # in one process, since kinds share parts
        make(kind)
