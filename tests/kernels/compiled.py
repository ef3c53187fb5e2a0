"""Machine code that tests in several processes need, made before they begin: else each of them makes it for itself.

    python -m tests.kernels.compiled

Each kind of rules in `KINDS` has machine code of its own, since its arguments are of other types.
"""

from __future__ import annotations

import os
from concurrent.futures import ProcessPoolExecutor

from swarm_pz.bench import batch_env_face
from swarm_pz.config import GameConfig, MemoryConfig
from swarm_pz.kernels.profiling import solve
from swarm_pz.simulator import Simulator

KINDS = {
    "paper": GameConfig(),
    "variants": GameConfig(controllers="flocking"),
    "released": GameConfig.preset("released"),
    "endless trails": GameConfig(memory=MemoryConfig(trail=None)),
    "the controller alone": None,
}


def make(kind: str) -> None:
    """Compile what games of a kind need, unless it is kept already."""
    if (config := KINDS[kind]) is not None:
        batch_env_face(config, 1, 1)()
    else:
        simulator = Simulator()
        simulator.reset([0])
        solve(simulator.games, simulator.controller)


def main() -> None:
    with ProcessPoolExecutor(os.cpu_count()) as processes:
        list(processes.map(make, KINDS))


if __name__ == "__main__":
    main()
