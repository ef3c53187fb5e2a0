"""Compile the machine code that tests in several processes need, before each process compiles it for itself.

    python -m tests.kernels.compiled

Each kind of rules in `KINDS` needs its own machine code, since its arguments have other types.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor

import numpy as np

from swarm_pz.config import GameConfig, MemoryConfig
from swarm_pz.envs.batch_env import BatchEnv
from swarm_pz.simulator import CheckedCommands

KINDS = {
    "paper": GameConfig(),
    "variants": GameConfig(controllers="flocking"),
    "coverage": GameConfig(controllers="coverage"),
    "potential field": GameConfig(controllers="potential_field"),
    "kernel ergodic": GameConfig(controllers="kernel_ergodic"),
    "released": GameConfig.preset("released"),
    "endless trails": GameConfig(memory=MemoryConfig(trail=None)),
}
GROUPS = tuple(KINDS)[:5], tuple(KINDS)[5:]
"""Kinds that share most parts, since their boards have numbers of the same type: of 16 and of 32 bits."""


def make(kind: str) -> None:
    """Compile what games of a kind need, unless it is on disk already."""
    config = KINDS[kind]
    env = BatchEnv(config)
    env.reset([0])
    games, control = env.simulator.games, env.simulator.control
    density = np.ones((1, config.command_cells, config.command_cells))
    sides = [control.read(density, games, np.zeros(1, int), team, "density", "densities") for team in range(2)]
    env.step(CheckedCommands(np.stack(sides, axis=1)))
    for team, observation in enumerate(config.observations):
        env.observe(observation, team)


def make_all(kinds: tuple[str, ...]) -> None:
    for kind in kinds:
        make(kind)


if __name__ == "__main__":
    with ProcessPoolExecutor(len(GROUPS)) as pool:
        list(pool.map(make_all, GROUPS))
