"""How well the controller covers its target: the ergodic metric over time, without captures.

python -m benchmarks.convergence
"""

from __future__ import annotations

import argparse

import numpy as np
from numpy.typing import NDArray

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.ergodicity import ErgodicMetric
from swarm_pz.simulator import Simulator

SIZES = (6, 12, 24)
TIMES = (1, 10, 30, 60)


def _gaussian(x0: float, y0: float, sigma: float) -> NDArray[np.float64]:
    """Return a Gaussian of unit mass at the centres of a command's cells."""
    centres = (np.arange(10) + 0.5) / 10
    squares = (centres[None, :] - x0) ** 2 + (centres[:, None] - y0) ** 2
    return np.asarray(np.exp(-squares / (2 * sigma**2)) / sigma**2)


TARGETS = {
    "uniform": np.ones((10, 10)),
    "centre": _gaussian(0.5, 0.5, 0.1),
    "bimodal": _gaussian(0.25, 0.25, 0.12) + _gaussian(0.75, 0.75, 0.08),
}


def ergodic_metric(size: int, command: NDArray[np.float64], config: GameConfig, seeds: int) -> NDArray[np.float64]:
    """Return the metric (seeds, times) of a lone team from the corners, over all ticks since the start."""
    simulator = Simulator(
        config.replace(drones_per_team=(size, 0), capture=CaptureConfig(enabled=False)), num_games=seeds, threads=2
    )
    simulator.reset(range(seeds))
    simulator.command(0, np.broadcast_to(command / command.max(), (seeds, 10, 10)))
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
