"""How well the controller covers its target: the ergodic metric over time, without captures.

python -m benchmarks.convergence
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import GameConfig
from swarm_pz.figures.coverage import TARGETS, lone_team, start
from swarm_pz.simulator.ergodicity import ErgodicMetric

SIZES = (6, 12, 24)
TIMES = (1, 10, 30, 60)


def ergodic_metric(size: int, command: NDArray[np.float64], config: GameConfig, seeds: int) -> NDArray[np.float64]:
    """Return the metric (seeds, times) of a lone team from the corners, over all ticks since the start."""
    simulator = start(lone_team(size, config), range(seeds), command)
    past = ErgodicMetric(simulator, team=0)
    metric = []
    for tick in range(1, 30 * max(TIMES) + 1):
        simulator.advance(1)
        past.observe()
        if tick in {30 * seconds for seconds in TIMES}:
            metric.append(past.value())
    return np.stack(metric, axis=1)


def main() -> None:
    """Print the table of means over seeds."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=20)
    seeds = parser.parse_args().seeds
    print(f"mean ergodic metric over {seeds} seeds; at 30 s every one should be at most 0.001")
    print(f"{'target':>8} {'drones':>6} " + " ".join(f"{f'{time} s':>9}" for time in TIMES) + "   worst seed at 30 s")
    for name, command in TARGETS.items():
        for size in SIZES:
            metric = ergodic_metric(size, command, GameConfig(), seeds)
            row = " ".join(f"{value:9.5f}" for value in metric.mean(axis=0))
            print(f"{name:>8} {size:>6} {row}   {metric[:, TIMES.index(30)].max():9.5f}", flush=True)


if __name__ == "__main__":
    main()
